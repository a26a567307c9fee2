"""Intervals over runs of touches: their closed forms, and how often they contain the truth with few runs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm
from study_modules import study

RUNS = (7, 10, 20, 100)
TOUCHES, SIMULATED = 20, 1000
# Correlation of the errors of two touches of a run.
SHARED = 0.15


def shared_errors(runs: int, rng: np.random.Generator) -> np.ndarray:
    """Errors (t,) with variance 1 of runs of touches."""
    own, common = rng.standard_normal(runs * TOUCHES), np.repeat(rng.standard_normal(runs), TOUCHES)
    return np.sqrt(1 - SHARED) * own + np.sqrt(SHARED) * common


def test_interval_of_a_share_of_equal_runs() -> None:
    """Runs of equal length: the standard error is that of the mean of their shares, and the odds have the interval."""
    shares = np.array([0.5, 0.8, 0.9, 1.0, 0.8])
    run = np.repeat(np.arange(5), 10)
    inside = np.concatenate([np.arange(10) < 10 * share for share in shares]).astype(float)
    share, low, high = study("_runs").share_of_runs(inside, run)
    assert share == pytest.approx(0.8)
    wide = 2.131847 * shares.std(ddof=1) / np.sqrt(5) / (0.8 * 0.2)  # t of four degrees of freedom, from a table
    assert np.log([low / (1 - low), high / (1 - high)]) == pytest.approx(np.log(4) + np.array([-wide, wide]), rel=1e-6)


def test_share_of_runs_without_scatter() -> None:
    """The same share in each run has no error; of touches that all are inside, nobody knows it."""
    module = study("_runs")
    assert module.share_over_runs(np.array([90.0, 180.0]), np.array([100.0, 200.0])) == pytest.approx((0.9, 0.9, 0.9))
    share, *ends = module.share_over_runs(np.array([10.0, 20.0]), np.array([10.0, 20.0]))
    assert share == 1 and np.isnan(ends).all()


def test_difference_of_rms_of_one_run_has_no_interval() -> None:
    value, *ends = study("_runs").difference_of_rms(np.array([3.0, 4.0]), np.array([1.0, 1.0]), np.array([0, 0]))
    assert value == pytest.approx(np.sqrt(12.5) - 1)
    assert np.isnan(ends).all()


@pytest.mark.parametrize("runs", RUNS)
def test_interval_of_a_difference_contains_the_truth_in_nine_of_ten(runs: int) -> None:
    """Two ways whose errors have the same distribution, half of it in common: the true difference is 0."""
    module, rng = study("_runs"), np.random.default_rng(runs)
    run, contained = np.repeat(np.arange(runs), TOUCHES), 0
    for _ in range(SIMULATED):
        common, one, two = (shared_errors(runs, rng) * np.sqrt(0.5) for _ in range(3))
        _, low, high = module.difference_of_rms(common + one, common + two, run)
        contained += low <= 0 <= high
    # Three standard errors of the share of simulations. A bootstrap over 7 runs has 0.79.
    assert contained / SIMULATED == pytest.approx(0.9, abs=3 * np.sqrt(0.09 / SIMULATED))


@pytest.mark.parametrize("runs", RUNS)
def test_interval_of_a_share_contains_the_truth_in_nine_of_ten(runs: int) -> None:
    """Intervals with the right half width: they hold 0.9 of the touches. No side takes more than its part."""
    module, rng = study("_runs"), np.random.default_rng(runs)
    run, above, below = np.repeat(np.arange(runs), TOUCHES), 0, 0
    for _ in range(SIMULATED):
        _, low, high = module.share_of_runs((abs(shared_errors(runs, rng)) < norm.ppf(0.95)).astype(float), run)
        above, below = above + (low > 0.9), below + (high < 0.9)
    # A bootstrap over 7 runs has 0.83, and lies above 0.9 in 0.12.
    assert 1 - (above + below) / SIMULATED == pytest.approx(0.9, abs=3 * np.sqrt(0.09 / SIMULATED))
    assert above / SIMULATED == pytest.approx(0.05, abs=0.025) and below / SIMULATED == pytest.approx(0.05, abs=0.025)
