"""The noise of rest readings is in the results: of those of each touch, and of those that touches share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rest_rows import DESIGN, dataset, with_own_rest

import bayestouch


@pytest.mark.slow
def test_a_rest_row_in_each_touch_counts_as_noise_of_the_touch() -> None:
    """One row at rest and eight in contact: a mean has nine times the variance that the rows in contact give."""
    made = bayestouch.simulate(DESIGN, seed=5).dataset
    assert made.calibration is not None
    rng = np.random.default_rng(5)
    tables = [with_own_rest(table, rng) for table in (made.calibration, made.touches)]
    data = replace(made, calibration=tables[0], touches=tables[1])
    calibration = bayestouch.calibrate(data, draws=400, seed=1)
    # 225 residuals: 1 ± 0.1, four times; it would be 9 without the noise of the rest rows.
    assert calibration.statistics["lack_of_fit"] == pytest.approx(1.0, abs=0.4)
    read = bayestouch.infer(data.touches, calibration, draws=400, seed=1)
    for name in ("R", "theta_c"):
        z = (read.mean(name) - read.reference[name]) / read.sd(name)
        # 81 touches: their mean square is 1 ± 0.16, four times, and they share the errors of the calibration.
        assert 0.3 < np.mean(z**2) < 2.0, name


@pytest.mark.slow
def test_the_rest_reading_that_touches_share_has_an_error() -> None:
    """Four rows at rest, and eight rows in each of 70 touches: depths and angles of four fingers of five elements."""
    z, shown = [], []
    for seed in range(4):
        data, _ = dataset(seed)
        truth = bayestouch.simulate(DESIGN, seed=seed).truth
        calibration = bayestouch.calibrate(data, draws=400, seed=1)
        for name in ("r_s", "theta_s"):
            draws = calibration.posterior[name]
            z.append((draws.mean(axis=(0, 1)) - truth[name]) / draws.std(axis=(0, 1)))
        assert calibration.rest_reading is not None
        shown.append(calibration.rest_reading - 300.0)
    # 40 values, 20 of them with the common error of the rubber: mean square 1 ± 0.3, four times. It is 7.9
    # where the error of the rest reading is left in the readings.
    assert 0.2 < np.mean(np.square(z)) < 2.2
    # The rest reading is better than the mean of its rows, whose error is 10.
    assert np.sqrt(np.mean(np.square(shown))) < 3.0
