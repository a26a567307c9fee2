"""Planned touches have the samples that are stated, and the noise of a rest reading like the calibration's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bayestouch
from bayestouch.model.planned_table import planned_table


@pytest.fixture(scope="module")
def calibration() -> bayestouch.Calibration:
    design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0, samples_per_touch=20)
    return bayestouch.calibrate(bayestouch.simulate(design, seed=3).dataset, draws=64)


@pytest.mark.parametrize("samples", [None, 5])
def test_planned_touches_have_rest_readings_like_those_of_the_calibration(
    calibration: bayestouch.Calibration, samples: int | None
) -> None:
    """20 samples minus a rest reading of 4 reads have the noise of 80/24 reads; 5 samples then that of 20/9."""
    rows = calibration.rows
    of_rest = np.array([4.0, 4.0, np.inf, 4.0])
    counts = np.tile(1 / (1 / 20 + 1 / of_rest), (len(rows.touch), 1))
    counts[0], counts[:, 3] = 20.0, 0.0
    own = replace(calibration, rows=replace(rows, counts=counts, samples=np.full(len(rows.touch), 20.0)))
    table = bayestouch.candidate_touches(own, places=[-5.0, 5.0], tips_mm=[0.0], samples=samples)
    n = 20 if samples is None else samples
    assert table.reads is not None and set(table.reads) == {n}
    means = planned_table(table, own)
    np.testing.assert_array_equal(means.samples, [n, n])
    np.testing.assert_array_equal(means.reads_of_load, [n, n])
    np.testing.assert_allclose(means.counts[:, :3], np.tile([4 * n / (4 + n), 4 * n / (4 + n), n], (2, 1)))


def test_planned_touches_without_rest_readings_are_the_mean_of_their_samples(
    calibration: bayestouch.Calibration,
) -> None:
    means = planned_table(bayestouch.candidate_touches(calibration, places=[0.0], tips_mm=[0.0]), calibration)
    np.testing.assert_array_equal(means.counts, [[20.0] * 4])


@pytest.mark.parametrize(("reads", "samples", "expected"), [(1.0, 20, 1), (1.0, 5, 1), (4.0, 3, 3), (20.0, 5, 5)])
def test_a_force_sensor_is_read_as_often_as_in_the_calibration(
    calibration: bayestouch.Calibration, reads: float, samples: int, expected: int
) -> None:
    """Touches of 20 samples in the calibration; with 20 reads of the load there is one with each sample."""
    rows = replace(calibration.rows, load_reads=np.full(len(calibration.rows.touch), reads))
    own = replace(calibration, rows=rows)
    means = planned_table(bayestouch.candidate_touches(own, places=[0.0], tips_mm=[0.0], samples=samples), own)
    assert (means.reads_of_load[0], means.samples[0]) == (expected, samples)
