"""Advice on what to measure next, from what limits the estimates now."""

from __future__ import annotations

from typing import Any

from bayestouch.checking.lacking import lacking
from bayestouch.diagnosis.outcome import not_used, worse_lines
from bayestouch.model.silent import means_by_table
from bayestouch.output.text import listed, number, percent, plural
from bayestouch.reporting.bodies import PAGES
from bayestouch.reporting.body_pages import BodyPages
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.phrases import MOSTLY_SEVERAL

# If one part has more than this percentage of a variance, it is hardly useful to lower the other part.
_MOST = 65.0


def next_steps(evidence: Evidence, numbers: dict[str, Any]) -> list[dict[str, str]]:
    """Advice in order of usefulness: what to do, and why."""
    pages = PAGES[numbers["places"]["body"]]
    steps = _effects(numbers["diagnosis"], pages)
    steps += _errors(numbers, pages.read, evidence.sensor.n_elements)
    trust = numbers["trust"]
    return [
        *steps,
        *_range(trust["convergence"]),
        *_sampler(trust),
        *(_made_up_for(line) for line in lacking(evidence.dataset, means_by_table(evidence.dataset))),
    ]


def _effects(found: dict[str, Any] | None, pages: BodyPages) -> list[dict[str, str]]:
    # A calibration that makes the estimates worse is not recommended.
    if not found or not found.get("effects") or worse_lines(found) or not_used(found):
        return []
    names = listed([effect["name"].replace("_", " ") for effect in found["effects"]])
    why = f"With {names} the model predicts touches better that were held out of its fit."
    return [{"what": pages.next_after_diagnosis, "why": why}]


def _errors(numbers: dict[str, Any], quantity: str, elements: int) -> list[dict[str, str]]:
    """Advice on how to lower the errors of the quantity."""
    # A finger has no touches with several separate places.
    several = numbers["estimates"].get("several_modes_percent", 0.0)
    if several >= MOSTLY_SEVERAL:
        # The parts of the variance are those about one of the places, and the distance between places is the error.
        why = (
            f"At {percent(several)} % of touches more than one separate place fits the readings. Neither more samples "
            "of a touch nor more calibration touches lower the distance between these places."
        )
        return [{"what": "Use more elements, or find out in another way which of the places was touched", "why": why}]
    # Without repeats, noise and model error cannot be separated, so their parts are not compared.
    if numbers["calibration"]["lack_of_fit"] is None:
        return []
    return _limit(numbers["places"], quantity, numbers["diagnosis"], elements)


def _limit(places: dict[str, Any], quantity: str, found: dict[str, Any] | None, elements: int) -> list[dict[str, str]]:
    """Advice on which part of the variance of the quantity to lower."""
    shared, samples = places["shared_percent"], places["samples"]
    taken = "one sample a touch" if samples == 1 else f"{samples} samples a touch"
    average = f"Average more samples of each touch (now {taken})"
    if shared < 100 - _MOST:
        gain = (shared / 100 + (1 - shared / 100) / 4) ** 0.5
        return [
            {
                "what": average,
                "why": f"{percent(100 - shared)} % of the {quantity}'s variance is noise: four times as many samples "
                f"would lower the standard deviation to some {number(100 * gain, 2)} % of what it is. More calibration "
                "touches would change little.",
            }
        ]
    what, largest = _lasting(places, found, elements)
    if shared > _MOST:
        why = (
            f"{percent(shared)} % of the {quantity}'s variance stays however many samples of a touch are averaged, and "
            f"the largest part of that is {largest}."
        )
        return [{"what": what, "why": why}]
    why = (
        f"Noise ({percent(100 - shared)} % of the {quantity}'s variance) and what stays however many samples are "
        f"averaged ({percent(shared)} %) weigh the same. The largest part of what stays is {largest}."
    )
    return [{"what": f"{average} and {what[:1].lower()}{what[1:]}, both", "why": why}]


def _lasting(places: dict[str, Any], found: dict[str, Any] | None, elements: int) -> tuple[str, str]:
    """Advice on the part of the variance that no averaging lowers, and the name of its largest part."""
    of_calibration, of_model = places["calibration_percent"], places["model_percent"]
    of_neither = places["shared_percent"] - of_calibration - of_model
    largest = max(of_calibration, of_model, of_neither)
    if largest == of_calibration:
        what = "Make more calibration touches, densest where readings are to be trusted"
        return what, f"the uncertainty of the calibration ({percent(of_calibration)} %)"
    if largest == of_model:
        searched = found is not None and "verdict" in found
        what = f"{'Read in the diagnosis' if searched else 'Find with bayestouch diagnose'} what the model lacks"
        why = f"the error of the model ({percent(of_model)} %): more calibration touches would change little"
        return what, why
    load = "Measure the load with less noise" if places["use_load"] else "Measure the load of each touch"
    nearer = "use more elements" if elements == 1 else "place elements nearer to each other"
    return (
        f"{load}, or {nearer}",
        f"that the readings do not tell load and place ({percent(of_neither)} %)",
    )


def _sampler(trust: dict[str, Any]) -> list[dict[str, str]]:
    sampled = trust["calibration_convergence"]
    missed = trust["convergence"]["missed"]
    if (sampled is None or sampled["met"]) and not missed:
        return []
    return [{"what": "Draw more (--draws)", "why": "The sampler missed its targets, see the convergence table."}]


def _range(grades: dict[str, Any]) -> list[dict[str, str]]:
    if not grades["beyond"]:
        return []
    why = (
        f"{grades['beyond']} of {plural(grades['touches'], 'touch')} are beyond the loads or places of the calibration."
    )
    return [{"what": "Calibrate with harder touches, or over a wider range", "why": why}]


def _made_up_for(line: str) -> dict[str, str]:
    """What to do, and what is missing; only what is missing if the line does not say what to do."""
    what, why = (each[:1].upper() + each[1:] for each in reversed(line.partition("; ")[::2]))
    return {"what": what, "why": f"{why}."} if what else {"what": why, "why": ""}
