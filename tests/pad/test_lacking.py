"""What a pad's data set lacks for its calibration."""

from __future__ import annotations

import numpy as np
import pytest

import bayestouch
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Pad, Sensor
from bayestouch.data.touches import touches_from

SENSOR = Sensor("square", Pad((0.0, 6.0, 0.0), (0.0, 0.0, 6.0)))
PLACE = np.arange(12.0)
ACROSS = 3 * PLACE % 7  # not on one line with it


@pytest.mark.parametrize(
    ("places", "lacks"),
    [
        ({"x_mm": PLACE, "y_mm": ACROSS}, None),
        ({"x_mm": PLACE, "y_mm": np.full(12, np.nan)}, "y_mm"),
        ({}, "x_mm and y_mm"),
        (
            {"x_mm": np.where(PLACE < 6, PLACE, np.nan), "y_mm": np.where(PLACE < 6, np.nan, PLACE)},
            "touch has x_mm and y_mm",
        ),
        ({"x_mm": np.where(PLACE < 7, PLACE, np.nan), "y_mm": np.where(PLACE < 1, np.nan, ACROSS)}, None),
    ],
)
def test_touches_without_a_place_cannot_calibrate(places: dict[str, np.ndarray], lacks: str | None) -> None:
    touches = touches_from(np.arange(12), np.random.default_rng(1).standard_normal((12, 3)), load=1.0, **places)
    advice = bayestouch.check(DataSet(SENSOR, touches, touches)).facts["advice"]
    told = [line for line in advice if line.startswith("cannot be calibrated")]
    assert told == ([] if lacks is None else [f"cannot be calibrated: no {lacks}"])


LINE = Sensor("line", Pad((0.0, 6.0, 12.0)))


@pytest.mark.parametrize(
    ("places", "readings", "why"),
    [
        # Gain, offset and position of an element on a line are three unknowns.
        (
            3,
            20,
            "calibration has touches at 3 known locations: gain, offset and position of each element need at least 4",
        ),
        (4, 20, None),
        (5, 3, "column e02: 3 calibration touches have a reading: its gain, offset and position need at least 4"),
        (5, 0, "no element responds: every one's readings are missing or all the same"),
    ],
)
def test_the_check_says_what_the_calibration_will_say(places: int, readings: int, why: str | None) -> None:
    """Of the second element, or of all, only the first few readings are there."""
    rng = np.random.default_rng(3)
    x = np.tile(np.linspace(0.0, 12.0, places), 20)[:20]
    signal = np.exp(-((x[:, None] - np.array([0.0, 6.0, 12.0])) ** 2) / 50) + 0.01 * rng.standard_normal((20, 3))
    signal[readings:, 1 if readings else slice(None)] = np.nan
    table = touches_from(np.arange(20), signal, load=rng.uniform(1, 2, 20), x_mm=x)
    data = DataSet(LINE, table, table)
    told = [line for line in bayestouch.check(data).facts["advice"] if line.startswith("cannot be calibrated")]
    assert [line[: len(f"cannot be calibrated: {why}")] for line in told] == (
        [] if why is None else [f"cannot be calibrated: {why}"]
    )
    if why is None:
        bayestouch.calibrate(data, draws=64)
    else:
        with pytest.raises(bayestouch.InputError, match=why.removeprefix("column e02: ")):
            bayestouch.calibrate(data)


@pytest.mark.parametrize("missing", [False, True])
def test_elements_that_no_touch_comes_near_to_are_named(missing: bool) -> None:
    """Two by three elements 6 mm apart, touched below y = 7 mm; the last two are 5 mm more than the pitch away."""
    places = np.array([[x, y] for y in (0.0, 6.0, 18.0) for x in (0.0, 6.0)])
    rng = np.random.default_rng(0)
    touched, load = rng.uniform([-2.0, -2.0], [8.0, 7.0], (60, 2)), rng.uniform(1.0, 3.0, 60)
    away = np.sqrt(((touched[:, None] - places) ** 2).sum(axis=2))
    readings = 50 + load[:, None] * 100 * np.exp(-0.5 * (away / 3) ** 2) + rng.standard_normal((60, 6))
    loads = {} if missing else {"load": load}
    touches = touches_from(np.arange(60), readings, x_mm=touched[:, 0], y_mm=touched[:, 1], **loads)
    sensor = Sensor("half touched", Pad(tuple(places[:, 0]), tuple(places[:, 1])))
    advice = bayestouch.check(DataSet(sensor, touches, touches)).facts["advice"]
    told = [line for line in advice if line.startswith("no calibration touch comes within")]
    assert len(told) == 1 and "within 6 mm, the distance between elements, of e05 and e06: their gains" in told[0]
    notes = bayestouch.calibrate(DataSet(sensor, touches, touches), kernel="gaussian", e_map="model", draws=8).notes
    assert told[0] in notes
