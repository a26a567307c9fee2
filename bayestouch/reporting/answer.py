"""Summary at the top of a report: sentences about the errors, made from its numbers."""

from __future__ import annotations

from typing import Any

from bayestouch.output.text import listed, number, percent, plural
from bayestouch.reporting.bodies import PAGES
from bayestouch.results.targets import targets_missed

# Coverage counts as right if it is within this many percentage points of 90 %, or within two standard errors if there
# are few touches. Within the second number of points it counts as nearly right.
_AS_CLAIMED, _NEARLY = 2.5, 6.0
# With fewer touches, coverage of 90 % intervals cannot be judged.
_FEWEST = 10
# A larger ratio of mean squares (residuals to repeats) is not explained by the scatter of a few hundred touches.
_LACK_OF_FIT = 1.25
# From this error on, a model that says zero for every reading would be better: no reading exceeds the peak by much.
_NOTHING_PERCENT_PEAK = 100.0
# Nonlinearity is reported if the exponent differs from one by this much and lowers the error by a tenth.
_NOT_LINEAR = 0.05
_SYMBOLS = {"theta_c": "location θ_c", "R": "radius R", "P": "load P", "x": "x", "y": "y", "region": "location"}


def answer(numbers: dict[str, Any]) -> dict[str, Any]:
    """Sentences, those among them on the calibrated model, and key numbers, from all other numbers of the report."""
    errors, key_numbers = PAGES[numbers["data"]["body"]].errors_and_limits(numbers)
    of_model = _model(numbers)
    sentences = [*errors, *_intervals(numbers), *of_model]
    if numbers["data"]["simulated"]:
        sentences.append("These touches are simulated: they say what such a sensor could do, not what one did.")
    return {"sentences": sentences, "of_model": of_model, "key_numbers": key_numbers}


def _intervals(numbers: dict[str, Any]) -> list[str]:
    rows = without_coordinates(numbers["trust"]["coverage"])
    if not rows:
        return []
    what = "regions and intervals" if len(rows) > 1 and rows[-1]["parameter"] == "region" else "intervals"
    parts = [f"{percent(row['percent_inside']['90'])} % of touches for {_SYMBOLS[row['parameter']]}" for row in rows]
    trusted = not explains_nothing(numbers["calibration"])
    return [f"The stated 90 % {what} hold the reference in {listed(parts)}: {_verdict(rows, trusted=trusted)}."]


def without_coordinates(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows of the coverage, without x and y where there is one of the region: it has both."""
    region = any(row["parameter"] == "region" for row in rows)
    return [row for row in rows if not (region and row["parameter"] in ("x", "y"))]


def decisive(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows of the coverage that can be judged: those of enough touches, or all if there is none."""
    rows = without_coordinates(rows)
    return [row for row in rows if row["touches"] >= _FEWEST] or rows


def _verdict(rows: list[dict[str, Any]], *, trusted: bool = True) -> str:
    """Clause on the stated uncertainties; of those that can be judged, the one with the worst coverage decides.

    `trusted` is false for a model that explains nothing of the readings, whose intervals are only wide.
    """
    grade, words = coverage_verdict(rows)
    if grade == "unknown" or not trusted:
        return words
    trust = {"bad": "are too small", "fair": "are somewhat too small", "good": "can be trusted"}[grade]
    return f"{words}, so the stated uncertainties {trust}"


def coverage_verdict(rows: list[dict[str, Any]]) -> tuple[str, str]:
    """Grade of the coverage of 90 % intervals (``good``, ``fair``, ``bad``, ``unknown``), and the same in words."""
    rows = decisive(rows)
    touches = min(row["touches"] for row in rows)
    if touches < _FEWEST:
        return "unknown", f"{plural(touches, 'touch')} cannot show whether that is as often as it should be"
    below = min(map(below_limit, rows))
    if below < _AS_CLAIMED - _NEARLY:
        return "bad", "less often than they should"
    if below < 0:
        return "fair", "a little less often than they should"
    caution = f", as far as {plural(touches, 'touch')} can show" if max(map(_tolerance, rows)) > _NEARLY else ""
    if any(row["percent_inside"]["90"] - 90 > _tolerance(row) for row in rows):
        return "good", f"as often as they should or more{caution}"
    return "good", f"as often as they should{caution}"


def below_limit(row: dict[str, Any]) -> float:
    """Coverage of 90 % intervals minus the least that is as claimed, in percentage points; the lowest one decides."""
    return float(row["percent_inside"]["90"]) - 90 + _tolerance(row)


def _tolerance(row: dict[str, Any]) -> float:
    return max(_AS_CLAIMED, 2 * float(row["se_90"]))


def has_lack_of_fit(calibration: dict[str, Any]) -> bool:
    """True if the calibrated model deviates from its own touches by more than noise explains."""
    lack = calibration["lack_of_fit"]
    return lack is not None and bool(lack > _LACK_OF_FIT)


def explains_nothing(calibration: dict[str, Any]) -> bool:
    """True if the calibrated model is further from its own touches than a model that says zero for every reading."""
    error = calibration["error_percent_peak"]
    return error is not None and bool(error > _NOTHING_PERCENT_PEAK)


def error_of_nothing(calibration: dict[str, Any]) -> str:
    """Sentence on the error of a model that explains nothing."""
    error = number(calibration["error_percent_peak"], 2)
    return (
        f"The calibrated model is wrong by {error} % of what an element reads at its peak, so that a model that says "
        "zero for every reading would be better: the places or the order of the elements, or a unit, are wrong."
    )


def _model(numbers: dict[str, Any]) -> list[str]:
    sentences = []
    lack = numbers["calibration"]["lack_of_fit"]
    if explains_nothing(numbers["calibration"]):
        sentences.append(error_of_nothing(numbers["calibration"]))
    if lack is not None and lack > _LACK_OF_FIT:
        sentences.append(
            f"The calibrated model does not fit its own touches to within noise (lack of fit {number(lack, 2)}, "
            "1 for a model that is right): it has a systematic error."
        )
    elif lack is not None:
        sentences.append(
            f"The calibrated model fits its own touches to within noise (lack of fit {number(lack, 2)}, 1 for a model "
            "that is right)."
        )
    sentences += _linearity(numbers["calibration"]["linearity"])
    sampled = numbers["trust"]["calibration_convergence"] or {}
    sentences += targets_missed(sampled, sampled.get("draws"))
    grades = numbers["trust"]["convergence"]
    if grades["beyond"]:
        sentences.append(
            f"{grades['beyond']} of {plural(grades['touches'], 'touch')} are harder or farther outside than the "
            "calibration allows: their estimates are wrong."
        )
    if grades["missed"]:
        sentences.append(
            f"The sampler did not reach its targets at {grades['missed']} of {plural(grades['touches'], 'touch')}: "
            "their means and intervals are rough."
        )
    return sentences


def _linearity(found: dict[str, Any]) -> list[str]:
    exponent, linear, power = (
        found[name] for name in ("load_exponent", "error_percent_peak_linear", "error_percent_peak_power")
    )
    if exponent is None or linear is None or abs(exponent - 1) < _NOT_LINEAR or linear < 1.1 * power:
        return []
    return [
        f"The readings are not linear in the load: beyond an offset they grow as {_power(exponent)}. On readings left "
        f"out of the calibration, the error of the linear model is {number(linear, 2)} % of the peak, and that of this "
        f"law {number(power, 2)} %."
    ]


def _power(exponent: float) -> str:
    """Text of a power law of the load; a power near zero with an offset is a logarithm."""
    return "the logarithm of the load" if exponent < 0.05 else f"the load to the power {number(exponent, 2)}"
