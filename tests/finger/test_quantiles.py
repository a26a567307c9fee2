"""Maps that make a skewed density normal, against quantiles of known distributions."""

from __future__ import annotations

import numpy as np
from scipy import stats

from bayestouch.finger.quantiles import END, STEP, QuantileMaps


def maps() -> QuantileMaps:
    """A normal of mean 2 and sd 3, and a gamma."""
    grids = [np.linspace(-16, 20, 2001), np.linspace(0.005, 40, 4001)]
    densities = [stats.norm(2, 3).pdf(grids[0]), stats.gamma(4).pdf(grids[1])]
    return QuantileMaps.of(grids, [density / density.sum() for density in densities])


def test_values_are_quantiles() -> None:
    """To half a grid step; straight beyond four standard deviations."""
    assert (END, STEP) == (4.0, 0.125)
    made = maps()
    for z in (-3.0, -1.03, 0.0, 0.4, 2.51, 3.9):
        (normal, gamma), _ = made(np.array([z, z]))
        assert abs(normal - (2 + 3 * z)) < 0.01
        assert abs(gamma - stats.gamma(4).ppf(stats.norm.cdf(z))) < 0.01
    ends, _ = made(np.array([[-4.0, 4.0], [-6.0, 6.0]]))
    np.testing.assert_allclose(ends[1] - ends[0], [-2, 2] * made.slopes[[0, 1], [0, -1]], rtol=1e-6)


def test_logarithm_of_the_derivatives() -> None:
    made = maps()
    z, h = np.array([[0.3, -1.2], [2.05, 0.77], [-5.0, 4.7]]), 1e-5
    _, log = made(z)
    slope = (made(z + h)[0] - made(z - h)[0]) / (2 * h)
    np.testing.assert_allclose(log, np.log(slope).sum(axis=1), rtol=1e-6)


def test_points_that_are_missing_stay_so() -> None:
    """A chain has NaN until it finds a point of the posterior."""
    made = maps()
    values, log = made(np.array([[np.nan, 0.4], [0.3, -1.2]]))
    wanted, at = made(np.array([[0.3, -1.2]]))
    assert np.isnan(values[0, 0]) and np.isnan(log[0])
    np.testing.assert_array_equal(values[1:], wanted)
    np.testing.assert_array_equal(log[1:], at)
