"""Expected errors over a pad: which places count as inside the array."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from bayestouch.pad.reading.reader import PadReader
from bayestouch.reporting.pad import places


def test_places_right_above_the_outermost_elements_are_inside(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a line of 0 … 120 mm with elements at 30 and 90 mm and an error of x/10 the best and worst are at these.

    The root mean square over 30, 31 … 90 mm is written out.
    """
    reader = SimpleNamespace(map=SimpleNamespace(low=[0.0], high=[120.0]))

    def spots(_reader: Any, where: np.ndarray, *, reads: int) -> SimpleNamespace:
        assert reads == 4
        error = where / 10
        return SimpleNamespace(sd=error[:, 0], noise_sd=0.6 * error, bias_rms=0.8 * error)

    monkeypatch.setattr(PadReader, "from_calibration", lambda _calibration: reader)
    monkeypatch.setattr("bayestouch.reliability.pad_spots", spots)
    monkeypatch.setattr(places, "element_places", lambda _evidence: np.array([[30.0], [90.0]]))
    monkeypatch.setattr(places, "typical_samples", lambda _evidence: 4)
    found = places.about_places(cast(Any, SimpleNamespace(calibration=None)))
    assert (found["best"]["x_mm"], found["worst"]["x_mm"]) == pytest.approx((30.0, 90.0))
    assert found["within"] == "the array of elements"
    assert found["inside_rms_mm"] == pytest.approx(np.sqrt(np.mean(np.arange(30, 91) ** 2)) / 10)
    # variances of 0.6² and 0.8² of the error
    assert found["shared_percent"] == pytest.approx(64.0)
    # between two steps there is no place that is inside of the array
    monkeypatch.setattr(places, "element_places", lambda _evidence: np.array([[30.5]]))
    found = places.about_places(cast(Any, SimpleNamespace(calibration=None)))
    assert found["within"] == "the calibrated region"
    assert (found["best"]["x_mm"], found["worst"]["x_mm"]) == pytest.approx((0.0, 120.0))
