"""Stated standard deviations of calibrations against the scatter of many of them; minutes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import test_pad_density as pads
import written_out as w
from scipy import stats

import bayestouch

REPLICATES = 100
M = w.ELEMENTS


def within(rng: np.random.Generator, mean: float, sd: float, low: float, high: float, n: int) -> np.ndarray:
    """Normal numbers, cut off."""
    return stats.truncnorm((low - mean) / sd, (high - mean) / sd, mean, sd).rvs(n, random_state=rng)


@pytest.mark.slow  # a hundred calibrations of a second each
def test_calibrations_of_new_data_scatter_as_each_says() -> None:
    """Errors of 17 parameters in a hundred data sets, in the directions that each covariance makes round.

    The truth is drawn from the prior of each, so that the mean square is one exactly; of 1,700 squares it scatters by
    3.4 %. A covariance that is 10 % too small makes it 1.11, three of these.
    """
    squares = []
    for seed in range(REPLICATES):
        rng = np.random.default_rng(1000 + seed)
        # σ keeps a little further from 0.5 than its prior: at the very limit a contact takes minutes to solve
        truth = np.concatenate(
            [
                rng.uniform(3.5, 6.0, M),
                within(rng, w.DEPTH, 0.1 * (w.OUTER - w.CORE), w.CORE + 3.3e-3, w.OUTER - 3.3e-3, M),
                np.radians(np.array(w.ANGLES) + rng.normal(0, 0.25 * 8.8, M)),
                within(rng, 0.46, 0.02, 0.0, 0.4985, 1),
                np.log(0.15) + np.log(1.35) * rng.standard_normal(1),
            ]
        )
        pressed = w.calibrating(rng, 2.0)
        table = w.recorded(w.finger_at(truth), pressed, rng, samples=4)
        made = bayestouch.calibrate(w.dataset(table, table), draws=400, seed=seed)
        draws = w.parameters_of(made.posterior).reshape(-1, len(truth))
        error = truth - draws.mean(axis=0)
        # the inverse of a covariance of n draws is too large by (n - 1)/(n - d - 2); the mean of n scatters as well
        n, d = len(draws), len(truth)
        squares.append(error @ np.linalg.solve(made.covariance, error) / d * (n - d - 2) / (n - 1) / (1 + 1 / n))
    error = np.std(squares) / np.sqrt(REPLICATES)
    assert error < 0.04
    assert np.mean(squares) == pytest.approx(1, abs=2.5 * error)


@pytest.mark.slow  # a hundred calibrations of a pad
def test_calibrations_of_pads_scatter_as_each_says(tmp_path: Path) -> None:
    """The same of a pad's 13 parameters, whose noise is fitted to forty touches: its covariance is 5 % uncertain."""
    truth = pads.line(**pads.SETTINGS).chain
    flat = np.concatenate([truth.gain, truth.offset, truth.position.ravel(), truth.values])
    squares = []
    for seed in range(REPLICATES):
        found = pads.on_file(tmp_path, 500 + seed, touches=40, measured=True)
        error = found.flat("mode") - flat
        covariance = found.group("laplace")["covariance"]
        squares.append(error @ np.linalg.solve(covariance, error) / len(flat))
    # 2,600 squares: 2.8 %, as they are; noise from left-out readings makes some data sets' larger than others'
    assert np.mean(squares) == pytest.approx(1, abs=0.09)
