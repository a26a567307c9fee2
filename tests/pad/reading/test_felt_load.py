"""Acting loads given felt ones near zero: normal distributions that are cut off there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from bayestouch.pad.reading.felt_load import acting_given_felt, acting_loads, cut_at_zero
from bayestouch.pad.reading.reader import PadTouches


@pytest.mark.parametrize("mean", [-30.0, -2.0, 0.0, 0.5, 5.0, 50.0])
def test_moments_of_a_load_that_is_cut_off_at_zero(mean: float) -> None:
    """Beyond 6 sd nothing is cut off, which leaves errors of 1e-8."""
    sd = 2.0
    cut = stats.truncnorm(-mean, np.inf, mean * sd, sd)
    found = cut_at_zero(np.array([mean * sd]), sd)
    np.testing.assert_allclose(np.ravel(found), [cut.mean(), cut.var()], rtol=1e-6 if mean > -10 else 3e-3)


@pytest.mark.parametrize("load", [-0.2, 0.0, 0.1, 3.0])
def test_draws_of_a_load_are_those_of_the_cut_off_distribution(load: float) -> None:
    touches = PadTouches(np.zeros((1, 2)), np.ones((1, 2)), np.array([load]), np.array([0.1]), 0.05)
    felt = np.full((4, 5000, 1), 0.04)
    kept, sd = acting_given_felt(np.array([0.1]), 0.05)
    mean = load + float(kept[0]) * (0.04 - load)
    cut = stats.truncnorm(-mean / sd[0], np.inf, mean, sd[0])
    draws = acting_loads(felt, touches, np.array([7]), seed=1).ravel()
    assert draws.min() >= 0
    assert stats.kstest(draws, cut.cdf).pvalue > 1e-3
