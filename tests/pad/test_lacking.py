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
