"""The four questions that a report opens with: trusted at all, where, down to which radius, and what to fix."""

from __future__ import annotations

from typing import Any

from bayestouch.diagnosis.outcome import errors_of_samples, verdict_sentence, worse_lines
from bayestouch.output.text import fixed, listed, number, percent
from bayestouch.reporting.answer import coverage_verdict, has_lack_of_fit

_FIRST = "Can its readings be trusted?"
#: Prediction errors of a diagnosis: of samples, or of touch means where these are all; and of touch means.
_PREDICTION = ("prediction_error_percent_peak", "touch_error_percent_peak")


def short_answers(numbers: dict[str, Any]) -> list[dict[str, str]]:
    """Question, short answer and the reason for it, four times (three on a pad, which has no radius)."""
    finger = numbers["data"]["body"] == "finger"
    out = [_trusted(numbers), _where(numbers["places"])]
    if finger:
        out.append(_radius(numbers))
    out.append(_fix(numbers))
    return out


def _row(question: str, short: str, reason: str) -> dict[str, str]:
    return {"question": question, "short": short, "reason": reason}


def _trusted(numbers: dict[str, Any]) -> dict[str, str]:
    coverage = numbers["trust"]["coverage"]
    if not coverage:
        reason = "The touches have no references that stated intervals could be held against."
        return _row(_FIRST, "Not shown by these data", reason)
    grade, words = coverage_verdict(coverage)
    worst = min(coverage, key=lambda row: float(row["percent_inside"]["90"]))
    reason = (
        f"Stated 90 % intervals hold the reference {words} (least: {percent(worst['percent_inside']['90'])} %, "
        f"{worst['touches']} touches)."
    )
    missed = numbers["calibration"]["lack_of_fit"] is not None and has_lack_of_fit(numbers["calibration"])
    if missed:
        reason += " The model misses more than noise explains."
    short = {"good": "Yes", "fair": "With care", "bad": "Not as stated", "unknown": "Too few touches to tell"}[grade]
    if grade == "good" and missed:
        short = "Yes, though the model misses something"
    return _row(_FIRST, short, reason)


def _where(places: dict[str, Any]) -> dict[str, str]:
    best, worst = places["best"], places["worst"]
    if places["body"] == "finger":
        short = f"Best at θ = {fixed(best['angle_deg'], 0)}°, worst at {fixed(worst['angle_deg'], 0)}°"
        reason = (
            f"Predicted from the calibration: the error of R is {number(best['R_error_mm'], 2)} mm rms at the best "
            f"location and {number(worst['R_error_mm'], 2)} mm at the worst, within half a pitch of the elements."
        )
    else:
        short = f"Best at {_place(best)}, worst at {_place(worst)}"
        reason = (
            f"Predicted from the calibration: location to {number(best['error_mm'], 2)} mm at the best place and "
            f"{number(worst['error_mm'], 2)} mm at the worst, within the array of elements."
        )
    return _row("Where?", short, reason)


def _place(place: dict[str, Any]) -> str:
    axes = (("x", "x_mm"), ("y", "y_mm"))
    return ", ".join(f"{axis} = {fixed(place[key], 1)}" for axis, key in axes if key in place) + " mm"


def _radius(numbers: dict[str, Any]) -> dict[str, str]:
    span, nowhere = numbers["places"]["threshold_mm"], numbers["places"]["nowhere_percent"]
    question = "Down to which radius?"
    seen = _seen(numbers["estimates"]["radius_limits"])
    if span["lowest"] is None:
        return _row(question, "None", f"Nowhere is even a flat told from a knife edge in one touch of two.{seen}")
    if number(span["lowest"], 2) == number(span["highest"], 2):
        short = f"r_c = {number(span['lowest'], 2)} mm"
    else:
        short = f"r_c = {number(span['lowest'], 2)} to {number(span['highest'], 2)} mm, depending on location"
    lost = f" At {percent(nowhere)} % of locations nothing is." if nowhere else ""
    return _row(
        question, short, f"Blunter tips are told from a knife edge with 95 % probability (predicted).{lost}{seen}"
    )


def _seen(limits: dict[str, Any]) -> str:
    radius = limits["told_from_edge_r_c_mm"]
    if not limits["told_from_edge_tried"] or radius is None:
        return ""
    return f" Of the tips tried, {radius:.4g} mm and blunter were."


def _gain(found: dict[str, Any]) -> str:
    """Prediction errors without and with effects but no correction; of samples and of touch means if they differ."""
    stands = found["before"], (found["correction"] or {}).get("before", found["after"])
    (before, after), means = ([stand.get(key) for stand in stands] for key in _PREDICTION)
    if None in (before, after):
        return ""
    if not errors_of_samples(*stands):
        return f" ({number(before, 2)} % of the peak falls to {number(after, 2)} %)"
    return (
        f" (of samples: {number(before, 2)} % of the peak falls to {number(after, 2)} %; of touch means: "
        f"{number(means[0], 2)} % before, {number(means[1], 2)} % after)"
    )


def _fix(numbers: dict[str, Any]) -> dict[str, str]:
    question, found = "What to fix?", numbers["diagnosis"]
    parts = []
    if found is not None and found.get("effects"):
        names = [effect["name"].replace("_", " ") for effect in found["effects"]]
        parts += worse_lines(found) or [
            f"Taking {listed(names)} into account lowers the prediction error on held-out touches{_gain(found)}."
        ]
        short = f"{listed(names)[:1].upper()}{listed(names)[1:]}"
    elif found is not None and found.get("verdict") == "unattributed":
        parts.append("The model misses something that no known effect explains.")
        short = "Something that no known effect explains"
    elif found is not None and found.get("verdict") == "adequate":
        parts.append(f"The search for effects found none. {verdict_sentence(found)}")
        short = "Nothing that was looked for"
    else:
        parts.append("No effect was searched for: bayestouch diagnose does that.")
        short = "See what to measure next"
    steps = numbers["next"]
    if steps:
        what = steps[0]["what"]
        lacks = what.startswith(("No ", "Cannot "))
        parts.append(f"{'Lacking' if lacks else 'Next'}: {what[:1].lower()}{what[1:]}.")
    return _row(question, short, " ".join(parts))
