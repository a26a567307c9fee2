"""Questions and answers at the top of a report: can it be trusted, where, down to which radius, what to fix."""

from __future__ import annotations

from typing import Any

from bayestouch.diagnosis.outcome import (
    chance_lines,
    errors_of_samples,
    is_tested,
    not_used,
    untested_verdict,
    verdict_sentence,
    verdict_word,
    why_untested,
    worse_lines,
)
from bayestouch.output.text import listed, number, percent, plural
from bayestouch.reporting.answer import (
    below_limit,
    coverage_verdict,
    decisive,
    error_of_nothing,
    explains_nothing,
    has_lack_of_fit,
)
from bayestouch.reporting.bodies import PAGES
from bayestouch.reporting.phrases import verdict_row

_FIRST = "Can its readings be trusted?"
_TOO_FEW = "Too few touches to say"
# From this percentage of copies on, errors and coverage are mostly those of touches that were calibrated with.
_MOSTLY_COPIES = 50.0
#: Keys of the prediction errors of a diagnosis: of samples (or touch means if there are only these); of touch means.
_PREDICTION = ("prediction_error_percent_peak", "touch_error_percent_peak")


def short_answers(numbers: dict[str, Any]) -> list[dict[str, str]]:
    """Rows of question, short answer and reason: trust, the questions of the body, what to fix."""
    own = PAGES[numbers["data"]["body"]].own_answers(numbers)
    return [_trusted(numbers), *own, _fix(numbers)]


def _trusted(numbers: dict[str, Any]) -> dict[str, str]:
    coverage, found = numbers["trust"]["coverage"], _verdict_of_diagnosis(numbers["diagnosis"])
    if explains_nothing(numbers["calibration"]):
        return verdict_row(_FIRST, "No, the model does not fit", error_of_nothing(numbers["calibration"]))
    said = "" if found is None else f" Verdict of the diagnosis: {found}."
    copied = numbers["data"]["copied_percent"]
    if copied > _MOSTLY_COPIES:
        reason = (
            f"{percent(copied)} % of the touches to be read are copies of calibration touches, whose errors say little "
            "of other touches."
        )
        return verdict_row(_FIRST, "Not shown by these data", reason + said)
    if not coverage:
        reason = "The touches have no references with which stated intervals could be compared."
        return verdict_row(_FIRST, "Not shown by these data", reason + said)
    grade, words = coverage_verdict(coverage)
    worst = min(decisive(coverage), key=below_limit)
    lowest = min(float(row["percent_inside"]["90"]) for row in decisive(coverage))
    which = "least" if worst["percent_inside"]["90"] == lowest else "for its number of touches the worst"
    least = f"{which}: {percent(worst['percent_inside']['90'])} %, {plural(worst['touches'], 'touch')}"
    reason = f"Stated 90 % intervals hold the reference {words} ({least})."
    if grade == "unknown":
        reason = f"{percent(worst['percent_inside']['90'])} % of the stated 90 % intervals hold the reference; {words}."
    # A diagnosis tests the model on held-out touches, and may show that a lack of fit is due to chance.
    word = _word(numbers["diagnosis"])
    missed = has_lack_of_fit(numbers["calibration"]) if word is None else word != "adequate"
    if missed and found is None:
        said = " The model has a larger error than noise explains."
    short = {"good": "Yes", "fair": "With care", "bad": "Not as stated", "unknown": _TOO_FEW}[grade]
    if grade == "good" and missed:
        short = "Yes, though the model has an error"
    return verdict_row(_FIRST, short, reason + said)


def _verdict_of_diagnosis(found: dict[str, Any] | None) -> str | None:
    """Verdict with the effects that were found; None without a diagnosis."""
    word = _word(found)
    if found is None or word is None:
        return None
    if not is_tested(found):
        return f"{why_untested(found)[0].lower()}, {word} by the touches of the fit alone"
    if word == "unattributed":
        return "unattributed, the model has an error that no known effect explains"
    names = _names(found)
    return f"{word} by {listed(names)}" if names else word


def _word(found: dict[str, Any] | None) -> str | None:
    """Word of the verdict; None if there is no diagnosis or it was not possible."""
    return None if found is None or "verdict" not in found else verdict_word(found)


def _names(found: dict[str, Any]) -> list[str]:
    return [effect["name"].replace("_", " ") for effect in found["effects"]]


def _gain(found: dict[str, Any]) -> str:
    """What effects, without a correction, do to the prediction errors; of samples and touch means if different."""
    pair = found["before"], (found["correction"] or {}).get("before", found["after"])
    (before, after), means = ([stand.get(key) for stand in pair] for key in _PREDICTION)
    if None in (before, after):
        return "describes the touches of the fit better"
    old, new = number(before, 2), number(after, 2)
    # Effects of the noise, for one, make a prediction more probable and leave its error as it is.
    if after < before and old != new:
        does, change = "lowers", f"{old} % of the peak falls to {new} %"
    else:
        does, change = "does not lower", f"{old} % of the peak before, {new} % after"
    if errors_of_samples(*pair):
        change = f"of samples: {change}; of touch means: {number(means[0], 2)} % before, {number(means[1], 2)} % after"
    return f"{does} the prediction error on held-out touches ({change})"


def _harm(found: dict[str, Any] | None) -> list[str]:
    """What is read worse with what was found, or is not used for that; a correction may be, where no effect is."""
    if found is None or _word(found) is None:
        return []
    refused = not_used(found)
    return [refused] if refused else worse_lines(found)


def _fix(numbers: dict[str, Any]) -> dict[str, str]:
    question, found = "What to fix?", numbers["diagnosis"]
    parts = []
    harm = _harm(found)
    if found is not None and _word(found) is not None and not is_tested(found):
        short, why = why_untested(found)
        parts += [f"{why[:1].upper()}{why[1:]}.", untested_verdict(found)]
        names = _names(found)
        parts += [f"Found on these touches: {listed(names)}."] if names else []
    elif found is not None and found.get("effects"):
        names = _names(found)
        parts += harm or [f"Taking {listed(names)} into account {_gain(found)}."]
        short = f"{listed(names)[:1].upper()}{listed(names)[1:]}"
    elif _word(found) == "unattributed":
        parts += ["The model has an error that no known effect explains.", *chance_lines(found or {}), *harm]
        short = "Something that no known effect explains"
    elif found is not None and _word(found) == "adequate":
        said = f"The search for effects found none. {verdict_sentence(found)}"
        parts += [said, *(line for line in harm if line not in said)]
        short = "Nothing in the model"
    else:
        parts.append((found or {}).get("missing", "No effect was searched for: bayestouch diagnose does that."))
        short = "See what to measure next"
    steps = numbers["next"]
    if steps:
        what = steps[0]["what"]
        lacks = what.startswith(("No ", "Cannot "))
        parts.append(f"{'Lacking' if lacks else 'Next'}: {what[:1].lower()}{what[1:]}.")
    return verdict_row(question, short, " ".join(parts))
