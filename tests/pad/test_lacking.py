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


@pytest.mark.parametrize(
    ("places", "lacks"),
    [
        ({"x_mm": PLACE, "y_mm": PLACE}, None),
        ({"x_mm": PLACE, "y_mm": np.full(12, np.nan)}, "y_mm"),
        ({}, "x_mm and y_mm"),
        (
            {"x_mm": np.where(PLACE < 6, PLACE, np.nan), "y_mm": np.where(PLACE < 6, np.nan, PLACE)},
            "touch has x_mm and y_mm",
        ),
        ({"x_mm": np.where(PLACE < 6, PLACE, np.nan), "y_mm": np.where(PLACE < 5, np.nan, PLACE)}, None),
    ],
)
def test_touches_without_a_place_cannot_calibrate(places: dict[str, np.ndarray], lacks: str | None) -> None:
    touches = touches_from(np.arange(12), np.ones((12, 3)), load=1.0, **places)
    advice = bayestouch.check(DataSet(SENSOR, None, touches)).facts["advice"]
    told = [line for line in advice if line.startswith("cannot be calibrated")]
    assert told == ([] if lacks is None else [f"cannot be calibrated: no {lacks}"])
