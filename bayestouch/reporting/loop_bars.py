"""Errors before and after the search for effects: rows of the table, and bars of the first screen."""

from __future__ import annotations

from typing import Any

from bayestouch.diagnosis.outcome import errors_of_samples
from bayestouch.output.text import listed

# Rows of the table that are errors, where less is better; the others are no lengths of bars.
_AS_BARS = ("% of peak", "mm", "degree", "N/m", "N")
_MOST = 4
# Error that the noise of readings and loads alone would leave in.
_OF_FLOOR = "prediction_error_percent_peak"


def loop_bars(diagnosis: dict[str, Any] | None) -> dict[str, Any] | None:
    """Bars of the errors before and after, each group relative to its largest; None without a diagnosis.

    Returns
    -------
    dict or None
        ``title``, and ``groups`` with ``quantity``, ``unit`` and ``bars`` (``name``, ``kind``, ``value``, ``percent``).
    """
    if diagnosis is None or "before" not in diagnosis:
        return None
    effects, correction = used_after(diagnosis)
    added = [*(name.replace("_", " ") for name in effects), *(["a correction"] if correction else [])]
    changed = bool(added)
    if changed:
        title = f"before and after {listed(added)}"
    elif diagnosis["effects"] or diagnosis["correction"] is not None:
        title = "nothing that was found is used"
    else:
        title = "no effect was found"
    rows = [row for row in before_after(diagnosis) if row["unit"] in _AS_BARS and "bias" not in row["quantity"]]
    groups = [_group(row, diagnosis, changed) for row in rows[:_MOST] if row["before"] is not None]
    return {"title": title, "groups": groups} if groups else None


def _group(row: dict[str, Any], diagnosis: dict[str, Any], changed: bool) -> dict[str, Any]:
    floor = diagnosis["noise_floor_percent_peak"] if row["key"] == _OF_FLOOR else None
    bars = [("before" if changed else "as calibrated", "before", row["before"])]
    bars += [("after", "after", row["after"])] if changed else []
    bars += [("noise alone", "floor", floor)]
    known = [bar for bar in bars if bar[2] is not None]
    longest = max(value for _, _, value in known) or 1.0
    return {
        "quantity": row["quantity"],
        "unit": row["unit"],
        "bars": [
            {"name": name, "kind": kind, "value": value, "percent": round(60 * value / longest, 1)}
            for name, kind, value in known
        ],
    }


def used_after(diagnosis: dict[str, Any]) -> tuple[list[str], bool]:
    """Names of the effects in the model after, and whether it has a correction; what was found may not be used."""
    # Files of version 0.1 do not contain this key: all that was found is used.
    used = diagnosis.get("calibration_after")
    if used is None:
        return [effect["name"] for effect in diagnosis["effects"]], diagnosis["correction"] is not None
    return list(used["effects"]), bool(used["correction"])


def after_in_words(diagnosis: dict[str, Any]) -> str:
    """Sentences on what the columns of the table are."""
    effects, correction = used_after(diagnosis)
    parts = [listed([name.replace("_", " ") for name in effects])] if effects else []
    if effects and len(effects) == len(diagnosis["effects"]):
        parts = ["the effects that were found"]
    parts += ["a correction without a cause"] if correction else []
    if not parts:
        found = bool(diagnosis["effects"]) or diagnosis["correction"] is not None
        what = "the same, because " + ("nothing that was found is used" if found else "no effect was found")
    else:
        what = f"with {listed(parts)}"
        if references_corrected(diagnosis):
            what += (
                ", against references as these correct them; in the last column against references as the data set "
                "states them"
            )
    return f"Before: the calibrated model alone. After: {what}."


def before_after(diagnosis: dict[str, Any]) -> list[dict[str, Any]]:
    """Rows of errors before and after, as far as the data give them; after also against stated references."""
    both = errors_of_samples(diagnosis["before"], diagnosis["after"])
    rows = (
        ("prediction_error_percent_peak", f"prediction error{' of samples' if both else ''}", "% of peak", 1),
        *([("touch_error_percent_peak", "prediction error of touch means", "% of peak", 1)] if both else []),
        ("lack_of_fit", "lack of fit (1: none)", "", 1),
        ("R_bias_mm", "bias of R", "mm", 1),
        ("R_rms_mm", "rms error of R", "mm", 1),
        ("theta_rms_deg", "rms error of θ_c", "degree", 1),
        ("P_rms_N_per_m", "rms error of P, read without the force sensor", "N/m", 1),
        ("location_rms_mm", "rms error of the location", "mm", 1),
        ("P_rms_N", "rms error of P, read without the force sensor", "N", 1),
        ("coverage_90", "touches inside 90 % intervals", "%", 100),
        ("P_coverage_90", "loads inside 90 % intervals, read without the force sensor", "%", 100),
    )
    # Files of version 0.1 do not contain this key.
    stated = diagnosis.get("after_against_stated", diagnosis["after"])
    found = []
    for key, quantity, unit, factor in rows:
        values = [whole.get(key) for whole in (diagnosis["before"], diagnosis["after"], stated)]
        if any(value is not None for value in values):
            before, after, against = (None if value is None else factor * value for value in values)
            row = {
                "key": key,
                "quantity": quantity,
                "unit": unit,
                "before": before,
                "after": after,
                "after_against_stated": against,
            }
            found.append(row)
    return found


def has_errors_of_touches(diagnosis: dict[str, Any]) -> bool:
    """True if held-out touches were read as unknown, so that the rows have errors of what was read, not of readings."""
    of_readings = ("prediction_error_percent_peak", "touch_error_percent_peak", "lack_of_fit")
    return any(row["key"] not in of_readings for row in before_after(diagnosis))


def references_corrected(diagnosis: dict[str, Any]) -> bool:
    """True if an error after is another one against references as the data set states them."""
    return any(row["after"] != row["after_against_stated"] for row in before_after(diagnosis))
