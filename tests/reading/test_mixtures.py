"""Quantiles of mixtures: by bisection of the sum of scipy's normal distribution functions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm

from bayestouch.reading.mixtures import finer, mixture_quantiles

LEVELS = np.array([0.05, 0.5, 0.95])


@pytest.mark.parametrize("apart", [0.0, 1.0, 6.0, 40.0])
def test_quantiles_solve_the_distribution_function(apart: float) -> None:
    """One peak, a skewed one, two separate ones, and two far apart, where Newton's method fails."""
    weight = np.array([0.3, 0.6, 0.1])
    mean, sd = np.array([[0.0, apart, 1.0], [5.0, 5.0 - apart, 4.0]]), np.array([[1.0, 0.5, 2.0], [1.0, 2.0, 0.1]])
    found = mixture_quantiles(weight, mean, sd, LEVELS)
    for row, middle, width in zip(found, mean, sd, strict=True):
        for level, value in zip(LEVELS, row, strict=True):
            wanted = brentq(lambda x: weight @ norm.cdf(x, middle, width) - level, -200, 200)  # noqa: B023
            # The search ends when the probability is right to 3e-4.
            assert abs(weight @ norm.cdf(value, middle, width) - level) < 4e-4 or abs(value - wanted) < 1e-6


def test_a_cubic_is_interpolated_exactly() -> None:
    knots, points = np.arange(7.0), np.linspace(0, 6, 49)
    np.testing.assert_allclose(finer(knots**3 - 4 * knots), points**3 - 4 * points, atol=1e-10)
