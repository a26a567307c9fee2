"""Sentences about the result of a sensor check, for the notes of a result."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayestouch.errors import few
from bayestouch.output.text import plural
from bayestouch.reading.fault_kinds import ColumnFault
from bayestouch.reading.fault_tests import FEWEST
from bayestouch.reading.faults import ODD, SensorCheck

# Settings of a result that say how many touches were checked, and what was found.
_CHECKED = "touches_checked"
_FAULTS = _LEFT_OUT, _FORCE, _ORDER, _WIDENED = "elements_left_out", "force_sensor", "element_order", "noise_widened"


def fault_notes(check: SensorCheck, load_unit: str) -> tuple[str, ...]:
    """One sentence for each fault that was found, or that nothing was checked; empty for a sensor without faults.

    Parameters
    ----------
    check : SensorCheck
        Result of the check.
    load_unit : str
        Unit of the load.
    """
    m = len(check.order)
    if not check.touches:
        return (
            f"the sensor is not checked: that needs at least {FEWEST} touches with two readings more than unknowns (a "
            "measured load is a reading)",
        )
    notes = [
        _force(fault, load_unit) if fault.column == m else f"{_name(fault.column)} {_element(fault)} and is left out"
        for fault in check.faults
    ]
    moved = np.flatnonzero(check.order != np.arange(m))
    if len(moved) == 2:
        notes.append(
            f"{_name(int(moved[0]))} and {_name(int(moved[1]))} are swapped: their readings are exchanged back"
        )
    elif len(moved):
        columns = ", ".join(_name(int(column)) for column in check.order)
        notes.append(f"the elements are wired in another order than in the calibration, read as {columns}")
    if check.excess > 1:
        notes.append(
            f"the readings miss the calibrated model by {check.excess:.2g} times what noise and calibration explain, "
            "and no few elements are the cause: the noise is taken as that much larger; calibrate the sensor again"
        )
    if check.odd:
        differ, whose = ("differs", "its") if len(check.odd) == 1 else ("differ", "their")
        who = f"{plural(len(check.odd), 'touch')} ({few([str(touch) for touch in check.odd])})"
        notes.append(
            f"{who} {differ} from the calibrated model by more than {ODD:g} times what noise and calibration explain, "
            f"and the others do not: {whose} posteriors are too narrow"
        )
    return tuple(f"sensor check ({check.touches} touches): {note}" for note in notes)


def is_sound(settings: Mapping[str, str | float]) -> bool:
    """True if the settings of a result say that the check of the sensor found no fault.

    It is also true if there was too little to check: then a second check would find as little.
    """
    return _CHECKED in settings and not any(key in settings for key in _FAULTS)


def fault_settings(check: SensorCheck) -> dict[str, str | float]:
    """Result of the check as settings of a result."""
    m = len(check.order)
    found: dict[str, str | float] = {_CHECKED: float(check.touches)}
    if check.left_out.any():
        found[_LEFT_OUT] = " ".join(_name(int(column)) for column in np.flatnonzero(check.left_out))
    if check.force_left_out:
        found[_FORCE] = "left out"
    if (check.order != np.arange(m)).any():
        found[_ORDER] = " ".join(_name(int(column)) for column in check.order)
    if check.excess > 1:
        found[_WIDENED] = check.excess
    return found


def _name(column: int) -> str:
    return f"e{column + 1:02d}"


def _element(fault: ColumnFault) -> str:
    match fault.kind:
        case "dead":
            when = "" if fault.since is None else f" from touch {fault.since} on"
            return f"does not follow the touches{when} (dead)"
        case "loose":
            return f"reads nothing of {100 * fault.value:.0f} % of the touches near it (loose contact)"
        case "stuck":
            when = "at every touch" if fault.since is None else f"from touch {fault.since} on"
            # Not what it reads: offsets, rest readings and effects are no longer in the readings that are checked.
            return f"reads the same {when} (stuck)"
        case "gain":
            change = f"{fault.value:.3g} ± {fault.sd:.1g} times"
            return f"reads {change} what the calibration and the other elements say (its gain has changed)"
        case "offset":
            return f"reads {100 * fault.value:+.2g} % of its peak beside what it should (its zero has moved)"
        case _:
            return "does not agree with the other elements"


def _force(fault: ColumnFault, unit: str) -> str:
    if fault.kind == "gain":
        what = (
            f"the force sensor reads {fault.value:.3g} ± {fault.sd:.1g} times the load that the elements say (it, or "
            "the gain of all elements, has changed)"
        )
    elif fault.kind in ("dead", "stuck"):
        what = f"the force sensor does not follow the touches ({fault.kind})"
    else:
        what = f"the force sensor's readings ({unit}) do not agree with the elements"
    return f"{what} and is left out: loads are inferred from the elements"
