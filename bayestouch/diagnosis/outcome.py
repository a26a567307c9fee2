"""Sentences on the result of a diagnosis."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from bayestouch.diagnosis.causes import NOTHING
from bayestouch.diagnosis.place_or_time import IN_PLACE
from bayestouch.diagnosis.verdict import structure_left
from bayestouch.effects.effect import OWN
from bayestouch.errors import few
from bayestouch.model.usable_touches import DEAD
from bayestouch.output.text import in_form, listed
from bayestouch.results.targets import targets_missed

#: Text of each verdict in ``diagnosis.json``; the first two are the beginning of a sentence.
VERDICTS = {
    "adequate": "Adequate: the model",
    "explained": "Explained: with what was found the model",
    "partly explained": "Partly explained: an effect was found, and structure remains that no effect explains.",
    "unattributed": "Unattributed: the model has an error, and no known effect explains it.",
}
_BEYOND_NOISE = {"adequate": "unattributed", "explained": "partly explained"}
# Limits of a lack of fit if a file of an earlier version has none; largest `expected` of a fit that leaves little open.
_LIMITS, _LITTLE_OPEN = {"low": 0.9, "high": 1.1, "expected": 1.0}, 1.1
# If errors of samples and of touch means differ by no more than this share, touches have one sample each.
_EQUAL = 1e-6
# More values than these are counted in a sentence, and not listed.
_MOST_VALUES = 12
# An element is named if its value is farther from the median than this many times the root mean square of the others.
# By chance one of six normal values is so in 6 % of cases, one of sixteen in 0.5 %; of fewer it says little.
_FAR, _ENOUGH_ELEMENTS = 5.0, 6
#: Sets of causes with a smaller probability are not listed.
LEAST_PROBABILITY = 0.01
# A change of an error counts if it exceeds this many standard errors.
_STANDARD_ERRORS = 2.0

#: Errors in a sentence: key, name, format, unit, factor.
_ERROR_TEXTS = (
    ("prediction_error_percent_peak", "prediction error", ".2f", " % of the peak", 1.0),
    ("touch_error_percent_peak", "prediction error of touch means", ".2f", " % of the peak", 1.0),
    ("lack_of_fit", "lack of fit", ".2f", "", 1.0),
    ("R_rms_mm", "rms error of R", ".2f", " mm", 1.0),
    ("R_bias_mm", "bias of R", "+z.2f", " mm", 1.0),
    ("theta_rms_deg", "rms error of the location", ".3f", " degree", 1.0),
    ("location_rms_mm", "rms error of the location", ".2f", " mm", 1.0),
    ("P_rms_N_per_m", "rms error of the load, read without the force sensor,", ".2g", " N/m", 1.0),
    ("P_rms_N", "rms error of the load, read without the force sensor,", ".2f", " N", 1.0),
    ("coverage_90", "coverage of 90 % intervals", ".0f", " %", 100.0),
    ("P_coverage_90", "coverage of 90 % intervals of the load", ".0f", " %", 100.0),
)


def sentences(numbers: Mapping[str, Any], *, with_causes: bool = True) -> list[str]:
    """Sentences: what got worse, verdict, effects, causes, remaining misfit, and errors before and after.

    A page that draws the probabilities of causes as bars leaves out their sentence (`with_causes`).
    """
    out = [*worse_lines(numbers), verdict_sentence(numbers)]
    if dead := numbers["data"].get("elements_left_out"):
        out.append(f"Left out: {few(dead)} ({DEAD}).")
    for effect in numbers["effects"]:
        line = f"Found {effect['name']} ({effect['summary']}): {_values(effect['parameters'])}."
        if effect["indistinguishable_from"]:
            line += f" These data cannot distinguish it from {' or '.join(effect['indistinguishable_from'])}."
        out.append(line)
    if numbers["effects"]:
        drawn = numbers.get("draws", {})
        out += targets_missed(drawn, drawn.get("kept"))
    left = numbers["unexplained"]
    causes = [f"{each['name']} {each['text']}" for each in probable_causes(numbers, 3)] if with_causes else []
    if causes:
        out.append(f"Probabilities of causes: {', '.join(causes)}.")
    out += chance_lines(numbers)
    if structure_left(numbers["verdict"]) and left["where"] != "nowhere":
        out.append(f"Unexplained: {100 * left['fraction']:.0f} % of the misfit, {left['where']}.")
    out += _place_lines(numbers)
    if numbers.get("calibration_after", {"correction": numbers["correction"] is not None})["correction"]:
        out.append("Errors after are with a correction by element and location, which is no cause.")
    if numbers["measure"] is not None:
        out.append(numbers["measure"]["advice"])
    return out + before_and_after(numbers)


def probable_causes(numbers: Mapping[str, Any], most: int) -> list[dict[str, Any]]:
    """Name, probability and its text of the most probable sets of causes, and of all others together.

    Empty for files of version 0.1, which have no probabilities.
    """
    found = numbers.get("causes", ())
    likely = [each for each in found if each["probability"] >= LEAST_PROBABILITY][:most]
    rows = [(listed(list(each["names"])), each["probability"]) for each in likely]
    others = 1 - sum(probability for _, probability in rows)
    if rows and others >= LEAST_PROBABILITY:
        rows.append(("others", others))
    return [{"name": name, "probability": each, "text": _probability(each)} for name, each in rows]


def chance_lines(numbers: Mapping[str, Any]) -> list[str]:
    """A sentence if chance may be all that the verdict "unattributed" found; else empty."""
    nothing = sum(each["probability"] for each in numbers.get("causes", ()) if list(each["names"]) == [NOTHING])
    tail = numbers.get("unexplained", {}).get("p_value")
    if verdict_word(numbers) != "unattributed" or nothing < LEAST_PROBABILITY or tail is None:
        return []
    return [f"Chance may be all of it: without an error, {100 * tail:.2g} % of sensors have a lack of fit as large."]


def _probability(value: float) -> str:
    return "> 99 %" if value > 1 - LEAST_PROBABILITY else f"{100 * value:.0f} %"


def _values(parameters: Mapping[str, Any]) -> str:
    of_elements = {name: each for name, each in parameters.items() if f"_{OWN}" in name}
    shared = {name: each for name, each in parameters.items() if name not in of_elements}
    if of_elements and shared:
        return f"{_values(shared)}; of the elements: {_summed_up(of_elements)}{_far_from_others(of_elements)}"
    if len(parameters) <= _MOST_VALUES:
        return ", ".join(_value(name, each) for name, each in parameters.items())
    return _summed_up(parameters)


def _summed_up(parameters: Mapping[str, Any]) -> str:
    clear = sum(abs(each["mean"]) > _STANDARD_ERRORS * (each["sd"] or math.inf) for each in parameters.values())
    return f"{len(parameters)} values, {clear} of which are more than {_STANDARD_ERRORS:g} standard deviations from 0"


def _far_from_others(of_elements: Mapping[str, Any]) -> str:
    """Element whose value is far from those of all others, which are near each other; empty if there is none."""
    values = np.array([each["mean"] for each in of_elements.values()])
    if len(values) < _ENOUGH_ELEMENTS:
        return ""
    distance = np.abs(values - np.median(values))
    far = int(distance.argmax())
    name, each = list(of_elements.items())[far]
    others = np.delete(values, far)
    spread = float(np.sqrt(np.mean(np.delete(distance, far) ** 2)))
    if distance[far] <= max(_FAR * spread, _STANDARD_ERRORS * (each["sd"] or math.inf)):
        return ""
    element, value = f"e{name.rpartition(OWN)[2]}", _value("", each).strip()
    return f". {element} is far from the others: {value}, and these {others.min():.3g} to {others.max():.3g}"


def _place_lines(numbers: Mapping[str, Any]) -> list[str]:
    """Sentences on what belongs to a place, or perhaps to a time; none for files of version 0.1."""
    out, gained = [], numbers.get("in_place")
    if gained is not None:
        shown = " and ".join(
            f"{each['elpd_gain']:+z.0f} ± {each['elpd_gain_se']:.0f} across {name}" for name, each in gained.items()
        )
        out.append(
            f"Something smooth in place: functions of place predict touches that are held out (log density {shown})."
        )
    for name, other in numbers.get("not_distinguishable", ()):
        if other == IN_PLACE:
            out.append(f"{name} and {other} are not distinguishable with these touches.")
    return out


def worse_quantities(numbers: Mapping[str, Any]) -> list[str]:
    """Keys of errors that are larger after than before, against stated references, by more than the standard error."""
    if "change_against_stated_se" not in numbers:
        return []  # files of version 0.1 have no standard errors, and loads were inferred with the force sensor
    before, after = numbers["before"], numbers.get("after_against_stated", numbers["after"])
    spread = numbers["change_against_stated_se"]
    skipped = () if errors_of_samples(before, after) else ("touch_error_percent_peak",)
    out = []
    for key in (key for key, *_ in _ERROR_TEXTS if key not in skipped):
        one, two = before.get(key), after.get(key)
        # Coverage is not an error: larger is better, up to a limit.
        if "coverage_90" in key or one is None or two is None:
            continue
        # A lack of fit within the limits of a correct model is not worse, such as 0.96 after 0.90.
        if key == "lack_of_fit" and two <= (_limits(numbers)["high"] or 0.0):
            continue
        if abs(two) - abs(one) > max(_STANDARD_ERRORS * (spread.get(key) or 0.0), 1e-9 * abs(one)):
            out.append(key)
    return out


def worse_lines(numbers: Mapping[str, Any]) -> list[str]:
    """First sentences if any error increased, so that the model is not mistaken for a better one; else empty."""
    keys = worse_quantities(numbers)
    if not keys:
        return []
    stated = numbers.get("after_against_stated", numbers["after"])
    shown = ", ".join(_pairs(numbers["before"], stated, keys).values())
    line = f"Worse than before, against references as the data set states them: {shown}."
    if stated != numbers["after"]:
        line += " What was found says that references are off; where they are right, the calibration before is better."
    return [line]


def verdict_word(numbers: Mapping[str, Any]) -> str:
    """Verdict, a key of `VERDICTS`, in agreement with the lack of fit that is printed."""
    word, lack, high = numbers["verdict"], numbers["after"].get("lack_of_fit"), _limits(numbers)["high"]
    beyond = lack is not None and high is not None and lack > high
    return str(_BEYOND_NOISE.get(word, word) if beyond else word)


def is_tested(numbers: Mapping[str, Any]) -> bool:
    """Whether touches were held out; without them a verdict only says how well a model fits its own touches."""
    return bool(numbers["data"]["held_out_touches"])


def why_untested(numbers: Mapping[str, Any]) -> tuple[str, str]:
    """Why nothing was tested, where no touch was held out: in short, and as a clause."""
    # Files of earlier versions do not contain this key.
    if numbers["data"].get("unreferenced"):
        return "Not tested", "no touch to be read has references, so that none was held out"
    return "Too few touches to say", "none were held out, so that nothing was tested"


def untested_verdict(numbers: Mapping[str, Any]) -> str:
    """Sentence on the final model by its own touches, where no touch was held out."""
    return f"By the touches of the fit alone: {verdict_word(numbers)}."


def verdict_sentence(numbers: Mapping[str, Any]) -> str:
    """Sentence on the final model, in agreement with the lack of fit that is printed; and on what is not used."""
    if not is_tested(numbers):
        short, why = why_untested(numbers)
        return f"{short}: {why}. {untested_verdict(numbers)}"
    refused = not_used(numbers)
    if not refused:
        return _of_final_model(numbers)
    if numbers["unexplained"]["where"] == "nowhere" and verdict_word(numbers) == "partly explained":
        # What is not used leaves nothing, what is used does.
        return f"Partly explained: what was found explains held-out touches, and not all of it can be used. {refused}"
    return f"{_of_final_model(numbers)} {refused}"


def not_used(numbers: Mapping[str, Any]) -> str:
    """Sentence on what was found and is not in the calibration after, and why; empty if all of it is."""
    refused = numbers.get("not_used")
    if not refused:
        return ""
    returned = numbers["calibration_after"]
    effects = {name for each in refused for name in each["effects"] if name not in returned["effects"]}
    names = [each["name"] for each in numbers["effects"] if each["name"] in effects]
    if not returned["correction"] and any(each["correction"] for each in refused):
        names.append("a correction by element and location")
    if not names:
        return ""
    worse = {key: values for each in reversed(refused) for key, values in each["worse"].items()}
    shown = ", ".join(_worse(key, values) for key, values in worse.items())
    them = "it" if len(names) == 1 else "them"
    against = ""
    # If no effect moves a reference, both errors are the same numbers, and there is only one kind of references.
    if any(each.get("after") != each.get("after_against_stated") for each in refused):
        how = "as they are corrected" if refused[0]["references_corrected"] else "as the data set states them"
        against = f" against references {how}"
    return (
        f"Not used for reading: {listed(names)}. With {them}, held-out touches are read worse{against} ({shown}), so "
        f"that calibration_after is without {them}."
    )


def _worse(key: str, values: Mapping[str, Any]) -> str:
    if key == "log_density":
        return f"log density of the readings of a touch {values['before']:.1f} → {values['after']:.1f}"
    # A file of another version may have an error that has no words here.
    plain = f"{key} {values['before']:.3g} → {values['after']:.3g}"
    shown = _pairs({key: values["before"]}, {key: values["after"]}).get(key, plain)
    return f"{shown} of touches {values['touches']}" if values.get("touches") else shown


def _of_final_model(numbers: Mapping[str, Any]) -> str:
    word, lack = verdict_word(numbers), numbers["after"].get("lack_of_fit")
    limits = _limits(numbers)
    low = limits["low"]
    if word not in _BEYOND_NOISE:
        return VERDICTS[word]
    begin, repeats = VERDICTS[word], numbers.get("noise_from_repeats")
    if repeats is None:
        repeats = numbers["noise_floor_percent_peak"] is not None
    if not repeats:
        test = numbers.get("unexplained", {}).get("test") or {}
        ratio, least = test.get("ratio"), test.get("low")
        if ratio is not None and least is not None and ratio < least:
            return (
                f"{begin} leaves less than the noise, which is not known from repeats: {ratio:.2f} of its mean square, "
                f"at least {least:.2f} was expected. So the estimate of the noise is too large, and may hide an error "
                "of the model. Touches that are read several times would tell."
            )
        return f"{begin} leaves nothing that these data show; the noise is not known from repeats."
    if lack is None:
        why = "" if numbers.get("loads_measured", True) else ": the loads were not measured"
        return f"{begin} leaves nothing that these data show; they cannot be compared with the noise{why}."
    if low is not None and lack < low:
        return f"{begin} leaves less than the noise that is assumed for readings and loads, which is too large."
    if limits["expected"] > _LITTLE_OPEN:
        return f"{begin} predicts held-out touches as well as the noise, and what its fit leaves open, allow."
    return f"{begin} predicts held-out touches as well as the noise allows."


def errors_of_samples(*found: Mapping[str, Any]) -> bool:
    """True if prediction errors of samples differ from those of touch means, so that both are stated."""
    for each in found:
        samples, means = each.get("prediction_error_percent_peak"), each.get("touch_error_percent_peak")
        if samples is not None and means is not None and not math.isclose(samples, means, rel_tol=_EQUAL):
            return True
    return False


def _limits(numbers: Mapping[str, Any]) -> Mapping[str, Any]:
    limits: Mapping[str, Any] = numbers.get("lack_of_fit_limits", {}).get("after", _LIMITS)
    return limits


def _value(name: str, each: Mapping[str, Any]) -> str:
    spread = "" if each["sd"] is None else f" ± {each['sd']:.2g}"
    return f"{name} {each['mean']:.3g}{spread} {each['unit']}".rstrip()


def _pairs(before: Mapping[str, Any], after: Mapping[str, Any], keys: list[str] | None = None) -> dict[str, str]:
    """Text of errors before and after, by key; only one value if nothing was changed."""
    found = (before,) if before == after else (before, after)
    of_samples = errors_of_samples(*found)
    out = {}
    for key, name, form, unit, factor in _ERROR_TEXTS:
        if key == "touch_error_percent_peak" and not of_samples:
            continue
        if key == "prediction_error_percent_peak" and of_samples:
            name = "prediction error of samples"
        known = [each[key] for each in found if each.get(key) is not None]
        if len(known) == len(found) and (keys is None or key in keys):
            out[key] = f"{name} {' → '.join(in_form(factor * value, form) for value in known)}{unit}"
    return out


def before_and_after(numbers: Mapping[str, Any]) -> list[str]:
    """Errors before and after; then, where they differ, those against references as the data set states them."""
    before, after, stated = numbers["before"], numbers["after"], numbers.get("after_against_stated")
    shown = _pairs(before, after)
    if not shown:
        return ["No touches were held out: errors are not estimated."]
    floor, limits = numbers["noise_floor_percent_peak"], numbers.get("lack_of_fit_limits", {}).get("after")
    if floor is not None and "prediction_error_percent_peak" in shown:
        shown["prediction_error_percent_peak"] += f" (noise alone {in_form(floor, '.2f')})"
    if "lack_of_fit" in shown and limits is not None and None not in (limits["low"], limits["high"]):
        shown["lack_of_fit"] += f" ({limits['low']:.2f} to {limits['high']:.2f} if nothing is missing)"
    touches = numbers["data"]["held_out_touches"]
    out = [f"On {touches} held-out touches: " + ", ".join(shown.values()) + "."]
    if stated is not None and stated != after:
        against = ", ".join(_pairs(before, stated).values())
        out.append(f"Against references as the data set states them: {against}.")
    return out
