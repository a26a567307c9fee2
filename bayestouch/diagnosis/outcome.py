"""The outcome of a diagnosis in plain words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

#: By the word for it in ``diagnosis.json``.
VERDICTS = {
    "adequate": "Adequate: the model predicts held-out touches as well as the noise allows.",
    "explained": "Explained: with what was found the model predicts held-out touches as well as the noise allows.",
    "partly explained": "Partly explained: an effect was found, and structure remains that no effect explains.",
    "unattributed": "Unattributed: the model misses something, and no known effect explains it.",
}


def sentences(numbers: Mapping[str, Any]) -> list[str]:
    """Verdict, effects, what is left, and errors before and after; a line each."""
    out = [VERDICTS[numbers["verdict"]]]
    for effect in numbers["effects"]:
        values = ", ".join(_value(name, each) for name, each in effect["parameters"].items())
        line = f"Found {effect['name']} ({effect['summary']}): {values}."
        if effect["indistinguishable_from"]:
            line += f" These data cannot tell it from {' or '.join(effect['indistinguishable_from'])}."
        out.append(line)
    left = numbers["unexplained"]
    if numbers["verdict"] in ("partly explained", "unattributed"):
        out.append(f"Unexplained: {100 * left['fraction']:.0f} % of the misfit, {left['where']}.")
    if numbers["correction"] is not None:
        out.append("A correction by element and location is in the calibration after; it is no cause.")
    if numbers["measure"] is not None:
        out.append(numbers["measure"]["advice"])
    out += _before_and_after(numbers)
    return out


def _value(name: str, each: Mapping[str, Any]) -> str:
    spread = "" if each["sd"] is None else f" ± {each['sd']:.2g}"
    return f"{name} {each['mean']:.3g}{spread} {each['unit']}".rstrip()


def _before_and_after(numbers: Mapping[str, Any]) -> list[str]:
    before, after = numbers["before"], numbers["after"]
    changed = before != after

    def pair(key: str, form: str, factor: float = 1.0) -> str | None:
        values = [each.get(key) for each in ((before, after) if changed else (before,))]
        return None if None in values else " → ".join(format(factor * value, form) for value in values)

    floor = numbers["noise_floor_percent_peak"]
    parts = [
        ("prediction error", pair("prediction_error_percent_peak", ".2f"), " % of the peak"),
        ("lack of fit", pair("lack_of_fit", ".2f"), ""),
        ("rms error of R", pair("R_rms_mm", ".2f"), " mm"),
        ("bias of R", pair("R_bias_mm", "+.2f"), " mm"),
        ("rms error of the location", pair("location_rms_mm", ".2f"), " mm"),
        ("of the load", pair("P_rms_N", ".2f"), " N"),
        ("coverage of 90 % intervals", pair("coverage_90", ".0f", 100), " %"),
    ]
    shown = [f"{name} {values}{unit}" for name, values, unit in parts if values is not None]
    if not shown:
        return ["No touches were held out: errors are not estimated."]
    if floor is not None:
        shown[0] += f" (noise alone {floor:.2f})"
    return [f"On {numbers['data']['held_out_touches']} held-out touches: " + ", ".join(shown) + "."]
