"""Errors of held-out touches on a finger with elements all around."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.data.touches import Touches, touches_from
from bayestouch.finger import touch_errors
from bayestouch.finger.touch_errors import errors_by_touch
from bayestouch.reading.options import Options


def test_an_error_of_location_is_the_shorter_way_around() -> None:
    """Across the seam at ±180° and beyond a turn; an error below half a turn is the same to the last bit."""
    found = np.array([179.5, -179.75, 365.0, 0.1, -30.3])
    true = np.array([-179.5, 179.75, 4.0, 0.3, 12.7])
    one = np.ones(5)
    errors = errors_by_touch(
        {"R": one, "theta_c": found, "P": one}, one, one, {"R": one, "theta_c": true, "P": one}, one
    )
    np.testing.assert_array_equal(errors["theta_rms_deg"][:3], [-1.0, 0.5, 1.0])
    np.testing.assert_array_equal(errors["theta_rms_deg"][3:], (found - true)[3:])


def test_held_out_touches_are_read_at_their_times(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reader gets their times on the clock of the calibration, where effects changed in time; else none."""
    given: list[Any] = []

    def infer(table: Touches, _: Any, options: Options) -> Any:
        given.append(options.recorded_s)
        raise InterruptedError

    table = touches_from(np.arange(4), np.zeros((4, 2)))
    held = np.array([False, True, False, True])
    data: Any = SimpleNamespace(table=table, held_out=held, time_s=np.array([0.0, 7.0, 8.0, 9.0]))
    calibration: Any = SimpleNamespace(has_effects=True, with_rest_reading=lambda _: None)
    monkeypatch.setattr(touch_errors, "EffectList", SimpleNamespace(of=lambda _: None))
    monkeypatch.setattr(touch_errors, "ChainWithEffects", SimpleNamespace(of=lambda _: None))
    for changing in (("load_offset",), ()):
        monkeypatch.setattr(touch_errors, "changing_in_time", lambda _, changing=changing: changing)
        with pytest.raises(InterruptedError):
            touch_errors.read_held_out(infer, calibration, data, None, seed=0)  # type: ignore[arg-type]
    np.testing.assert_array_equal(given[0], [7.0, 9.0])
    assert given[1] is None
