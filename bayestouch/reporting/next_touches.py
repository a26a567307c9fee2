"""The calibration touches that would lower most what the calibration adds to the error of a reading."""

from __future__ import annotations

from typing import Any

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError
from bayestouch.reliability.next_touches import NextTouches, next_touches
from bayestouch.results.objects import Calibration

# Number of touches in the report.
COUNT = 3


def about_next_touches(calibration: Calibration) -> dict[str, Any] | None:
    """Best next touches, and the expected sd before and after each of them; None if they cannot be planned.

    Candidates and touches that are read have the tips and the load of the calibration (see `bayestouch.next_touches`).
    """
    try:
        best = next_touches(calibration, count=COUNT, about="places")
    except InputError:  # the calibration has an identified E map
        return None
    body = calibration.sensor.body
    return {
        "units": dict(zip(best.quantities, best.units, strict=True)),
        "load_unit": best.load_unit,
        "expected_sd": _by_name(best, best.before),
        "touches": [_touch(best, i, body.location_columns) for i in range(len(best.chosen))],
    }


def _touch(best: NextTouches, i: int, columns: tuple[str, ...]) -> dict[str, Any]:
    touches = best.touches
    assert touches.reads is not None
    return {
        "touch": best.in_words(i),
        "indenter_radius_mm": float(touches.indenter_radius_mm[i]),
        "place": {name: float(getattr(touches, name)[i]) for name in columns},
        "load": float(touches.load[i]),
        "samples": int(touches.reads[i]),
        "expected_sd": _by_name(best, best.after[i]),
    }


def _by_name(best: NextTouches, values: FloatArray) -> dict[str, float]:
    return dict(zip(best.quantities, values.tolist(), strict=True))
