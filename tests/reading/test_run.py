"""What is said of touches before they are drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import bayestouch
from bayestouch.data.dataset import DataSet
from bayestouch.results.objects import TouchPosteriors
from bayestouch.simulation import FingerDesign, PadDesign

FINGER = FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
PAD = PadDesign(calibration_step_mm=2.25, n_touches=12)


@pytest.mark.parametrize("design", [FINGER, PAD])
def test_a_touch_without_a_reading_has_grade_0_and_a_note_names_it(
    design: FingerDesign | PadDesign, tmp_path: Path
) -> None:
    """Its draws are those of the prior, which meet every target of the sampler. It has a measured load."""
    data = bayestouch.simulate(design, seed=3).dataset
    calibration = bayestouch.calibrate(data, draws=40)
    touches = data.touches
    ids = np.unique(touches.touch)
    readings = touches.readings.copy()
    readings[np.isin(touches.touch, ids[[1, 3]])] = np.nan
    readings[touches.touch == ids[2], 0] = np.nan  # not all elements: a usual touch
    broken = touches.with_(readings=readings)
    bayestouch.save_dataset(DataSet(data.sensor, data.calibration, broken), tmp_path / "data")
    whole = bayestouch.infer(touches, calibration, draws=256, check_sensor=False)
    named = f"2 touches have no reading (touch {ids[1]}, {ids[3]})"
    note = f"{named}: nothing but a measured load is known, and the grade is 0"
    for given in (broken, tmp_path / "data" / "touches.csv"):
        read = bayestouch.infer(given, calibration, draws=256, check_sensor=False)
        expected = np.where(np.isin(ids, ids[[1, 3]]), 0, whole.sample_stats["grade"])
        np.testing.assert_array_equal(read.sample_stats["grade"], expected)
        assert (read.unread, read.beyond, read.missed) == (2, whole.beyond, whole.missed)
        assert note in read.notes
        assert f"2 of {len(ids)} have no reading" in repr(read)
    read.save(tmp_path / "p.nc")
    loaded = bayestouch.load(tmp_path / "p.nc")
    assert isinstance(loaded, TouchPosteriors) and loaded.unread == 2
    assert whole.unread == 0 and not any("no reading (" in each for each in whole.notes)
