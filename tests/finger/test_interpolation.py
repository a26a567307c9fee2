"""Interpolation by polynomials."""

from __future__ import annotations

import numpy as np

from bayestouch.finger.interpolation import lagrange


def test_a_polynomial_is_interpolated_exactly_and_the_same_every_time() -> None:
    nodes, places = np.array([0.0, 0.3, 1.0, 2.5]), np.linspace(-0.5, 3.0, 9)
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.5, 0.25])
    weights = lagrange(nodes, places)
    np.testing.assert_allclose(weights @ cubic(nodes), cubic(places), rtol=1e-12)
    np.testing.assert_array_equal(weights, lagrange(nodes, places))
