"""Sentences and rows that the texts of several bodies share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bayestouch.output.text import fixed, number

#: Percentage of touches with several separate places from which predicted errors are said to be those about one place,
#: and from which the advice is on the places: most touches have them.
MOSTLY_SEVERAL = 50.0


def add_key(key: list[dict[str, Any]], quantity: str, value: Any, unit: str, detail: str) -> None:
    """Add a key number to the list `key`."""
    key.append({"quantity": quantity, "value": value, "unit": unit, "detail": detail})


def verdict_row(question: str, short: str, reason: str) -> dict[str, str]:
    """Row of the table of questions and answers at the top of a report."""
    return {"question": question, "short": short, "reason": reason}


def in_spacings(error: float, spacing: float) -> str:
    """Text of an error relative to the distance between elements."""
    if error > 0.4 * spacing:
        return f"{number(error / spacing, 2)} times the element spacing"
    return f"1/{fixed(spacing / error, 0)} of the element spacing"


def with_load(places: Mapping[str, Any]) -> str:
    """Text that says whether touches have a measured load, from the numbers of the places."""
    return f"{'with' if places['use_load'] else 'without'} a measured load"


def calibrated_with(copied_percent: float) -> str:
    """Words after "touches" that say whether some of those to be read are copies of calibration touches."""
    if not copied_percent:
        return "not calibrated with"
    return f"to be read ({'all' if copied_percent == 100 else 'some'} were calibrated with)"


def load_error(load: dict[str, Any], key: list[dict[str, Any]]) -> list[str]:
    """Sentence on the error of the load inferred without the force sensor; adds a key number to the list `key`."""
    if not load["n"]:
        return ["No load was measured with these touches, so its error cannot be given."]
    add_key(
        key,
        "load error, rms",
        load["rms"],
        load["unit"],
        f"{number(load['rms_percent'], 2)} % of the mean load; the force sensor's reading was not used",
    )
    return [
        f"Without help from the force sensor, load is read to {number(load['rms'], 2)} {load['unit']} rms "
        f"({number(load['rms_percent'], 2)} % of the mean load)."
    ]
