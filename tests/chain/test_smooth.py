"""Smooth random functions as sums of basis functions: their covariance is the one they stand for."""

from __future__ import annotations

import numpy as np

from bayestouch.chain.smooth import PlaceBasis, SmoothBasis


def test_process_over_places_has_the_matern_correlation_at_its_knots() -> None:
    """Knots 3, 4 and 5 mm apart and a length of 2 mm: (1 + √3 d) exp(-√3 d), with d in lengths, and a variance of 1."""
    knots = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]])
    values = PlaceBasis.at(knots, 2.0)(knots)
    scaled = np.sqrt(3.0) * np.array([[0.0, 1.5, 2.0], [1.5, 0.0, 2.5], [2.0, 2.5, 0.0]])
    # the diagonal has 1e-9 added, so that rounding leaves it positive
    np.testing.assert_allclose(values @ values.T, (1 + scaled) * np.exp(-scaled), rtol=0, atol=1e-8)


def test_function_with_weights_is_the_sum_over_its_basis() -> None:
    """Also where x is NaN: zero."""
    basis = SmoothBasis.of(0.0, 1.0, 0.3)
    x = np.array([[-0.2, 0.0, 0.13], [0.8, 1.4, np.nan]])
    weights = np.linspace(-1.0, 2.0, len(basis.knots))
    np.testing.assert_allclose(basis.summed(x, weights), basis(x) @ weights, rtol=0, atol=1e-12)
    assert abs(basis.summed(x, weights)[1, 2]) < 1e-200
