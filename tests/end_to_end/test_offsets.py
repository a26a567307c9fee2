"""A finger whose elements read an offset that nobody subtracted: named, fitted, read, and used for new touches."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bayestouch
from bayestouch import InputError, Reader
from bayestouch.data.dataset import DataSet
from bayestouch.data.touches import Touches, touches_from
from bayestouch.effects.stated import StatedModel
from bayestouch.results.objects import Calibration
from bayestouch.simulation import FingerDesign, simulate

DESIGN = FingerDesign(n_elements=6, samples_per_touch=3, edge_step_deg=4.0, flat_step_deg=10.0, touch_step_deg=5.0)
#: Counts, a twentieth to a fifth of the peak.
OFFSETS = np.array([120.0, -80.0, 50.0, 200.0, -150.0, 60.0])
NOTE = "the calibration has the offset of each element (rest_offset): readings are taken as they are"


def raised(table: Touches) -> Touches:
    return table.with_(readings=table.readings + OFFSETS)


def data(seed: int = 4) -> DataSet:
    made = simulate(DESIGN, seed=seed).dataset
    assert made.calibration is not None
    return replace(made, calibration=raised(made.calibration), touches=raised(made.touches))


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return bayestouch.calibrate(data(), model=StatedModel("finger", "layer", (("rest_offset", {}),)), draws=400)


def test_offsets_are_fitted_and_touches_read_as_without_them(calibration: Calibration) -> None:
    """Within four standard deviations, which are less than a hundredth of the peak; touches as before the offsets."""
    names = [f"rest_offset_own_{e:02d}" for e in range(1, 7)]
    assert isinstance(calibration.extra["effect_peak"], np.ndarray)
    for name, peak, true in zip(names, calibration.extra["effect_peak"], OFFSETS, strict=True):
        draws = calibration.posterior[name] * peak
        assert abs(draws.mean() - true) < 4 * draws.std() < 10.0
    plain = simulate(DESIGN, seed=4).dataset
    without = bayestouch.infer(plain.touches, bayestouch.calibrate(plain, draws=400), draws=256)
    read = bayestouch.infer(data().touches, calibration, draws=256)
    apart = (read.mean("R") - without.mean("R")) / without.sd("R")
    # The offsets cost a part of the information: touches move by a fraction of their sds.
    assert np.sqrt((apart**2).mean()) < 0.5
    assert NOTE in read.notes


def test_readings_without_contact_are_not_subtracted_twice(calibration: Calibration, tmp_path: Path) -> None:
    """The same draws to the bit with rows that read the offsets; and a live reader refuses a rest reading."""
    touches = data().touches
    rested = touches_from(
        np.r_[touches.touch, 0, 1],
        np.vstack([touches.readings, OFFSETS, OFFSETS]),
        load=np.r_[touches.load, 0.0, 0.0],
        contact=np.r_[np.ones(touches.n_rows), 0.0, 0.0],
    )
    as_they_are, also = (bayestouch.infer(each, calibration, draws=64) for each in (touches, rested))
    np.testing.assert_array_equal(also.posterior["R"], as_they_are.posterior["R"])
    reader = Reader(calibration)
    with pytest.raises(InputError, match=r"the calibration has the offset of each element \(rest_offset\)"):
        reader.rest(OFFSETS)
    reader.save(tmp_path / "reader.nc")
    again = Reader.load(tmp_path / "reader.nc")
    row = int(np.flatnonzero(touches.touch == touches.touch[0])[0])
    one, other = (each.read(touches.readings[row], touches.load[row]) for each in (reader, again))
    np.testing.assert_array_equal(one.mean, other.mean)


@pytest.mark.slow
def test_a_diagnosis_names_offsets_alone() -> None:
    numbers = bayestouch.diagnose(data(), draws=100, sample=False).to_dict()
    assert [each["name"] for each in numbers["effects"]] == ["rest_offset"]
    assert numbers["verdict"] == "explained"
    assert numbers["before"]["lack_of_fit"] > 10 > 1.3 > numbers["after"]["lack_of_fit"]
