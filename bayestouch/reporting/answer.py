"""The answer at the top of a report: how well touches are read, in sentences made from its numbers."""

from __future__ import annotations

from typing import Any

from bayestouch.output.text import fixed, listed, number, percent, plural

# Coverage is as claimed within so many points of 90 %, or within two standard errors where touches are few; and nearly
# as claimed within so many more.
_AS_CLAIMED, _NEARLY = 2.5, 6.0
# Fewer touches than these say nothing of 90 %.
_FEWEST = 10
# A mean square of residuals this far above that of repeats is more than the scatter of a few hundred touches.
_LACK_OF_FIT = 1.25
# An exponent this far from one, with an error that it lowers by a tenth, is told.
_NOT_LINEAR = 0.05
_SYMBOLS = {"theta_c": "location θ_c", "R": "radius R", "P": "load P", "x": "x", "y": "y", "region": "location"}


def answer(numbers: dict[str, Any]) -> dict[str, Any]:
    """Sentences and key numbers from everything else in `numbers`."""
    finger = numbers["data"]["body"] == "finger"
    key: list[dict[str, Any]] = []
    sentences = [*(_finger(numbers, key) if finger else _pad(numbers, key)), *_intervals(numbers), *_model(numbers)]
    if numbers["data"]["simulated"]:
        sentences.append("These touches are simulated: they say what such a sensor could do, not what one did.")
    return {"sentences": sentences, "key_numbers": key}


def _key(key: list[dict[str, Any]], quantity: str, value: Any, unit: str, detail: str) -> None:
    key.append({"quantity": quantity, "value": value, "unit": unit, "detail": detail})


def _finger(numbers: dict[str, Any], key: list[dict[str, Any]]) -> list[str]:
    estimates = numbers["estimates"]
    location, load, radius = (estimates["overall"][name] for name in ("theta_c", "P", "R"))
    sentences = []
    if location["n"]:
        share = f", {_spacings(location['rms'], location['spacing'])}" if location["spacing"] else ""
        sentences.append(
            f"Location is read to {number(location['rms'], 2)}° rms ({number(location['rms_mm'], 2)} mm along the "
            f"surface{share}) over {plural(location['n'], 'touch')}."
        )
        _key(
            key,
            "location error, rms",
            location["rms"],
            "degree",
            f"{number(location['rms_mm'], 2)} mm along the surface",
        )
    else:
        sd = estimates["posterior_sd"]["theta_c"]
        sentences.append(
            "The touches have no reference location, so errors cannot be given; by its own account the sensor knows "
            f"the location of a typical touch to {number(sd, 2)}° (posterior standard deviation)."
        )
        _key(key, "location, posterior sd", sd, "degree", "median over touches; no reference")
    sentences += _load(load, key)
    sentences += _radius(estimates, radius, key)
    return sentences


def _spacings(error: float, spacing: float) -> str:
    """An error as a part of the distance between elements."""
    if error > 0.4 * spacing:
        return f"{number(error / spacing, 2)} times the element spacing"
    return f"1/{fixed(spacing / error, 0)} of the element spacing"


def _load(load: dict[str, Any], key: list[dict[str, Any]]) -> list[str]:
    if not load["n"]:
        return ["No load was measured with these touches, so its error cannot be given."]
    _key(
        key,
        "load error, rms",
        load["rms"],
        load["unit"],
        f"{percent(load['rms_percent'])} % of the mean load; the force sensor's reading was not used",
    )
    return [
        f"Without help from the force sensor, load is read to {number(load['rms'], 2)} {load['unit']} rms "
        f"({percent(load['rms_percent'])} % of the mean load)."
    ]


def _radius(estimates: dict[str, Any], radius: dict[str, Any], key: list[dict[str, Any]]) -> list[str]:
    if not radius["n"]:
        sd = estimates["posterior_sd"]["R"]
        _key(key, "composite radius R, posterior sd", sd, "mm", "median over touches; no reference")
        return [
            "No indenter radius is stated for these touches, so nothing can be said of the error of the radius; the "
            f"posterior standard deviation of the composite radius R is {number(sd, 2)} mm at a typical touch."
        ]
    _key(
        key,
        "composite radius R error, rms",
        radius["rms"],
        "mm",
        f"bias {number(radius['bias'], 2)} mm, standard deviation {number(radius['sd'], 2)} mm",
    )
    rows = sorted(estimates["by_indenter"], key=lambda row: float(row["R"]["rms"]))
    span = ""
    if len(rows) > 1:
        ends = [f"{number(row['R']['rms'], 2)} mm ({row['indenter']})" for row in (rows[0], rows[-1])]
        span = f", by indenter from {ends[0]} to {ends[1]}"
    first = f"The composite radius R (1/R = 1/r_b + 1/r_c) is read to {number(radius['rms'], 2)} mm rms{span}."
    return [first, *_limits(estimates["radius_limits"], key)]


def _limits(limits: dict[str, Any], key: list[dict[str, Any]]) -> list[str]:
    share = percent(limits["distinguished_percent"])
    parts = []
    for end, name, direction in (
        ("told_from_edge", "knife edge", "and blunter"),
        ("told_from_flat", "flat", "and sharper"),
    ):
        if not limits[f"{end}_tried"]:
            continue
        radius = limits[f"{end}_r_c_mm"]
        if radius is None:
            parts.append(f"no tip that was tried is told from a {name}")
        else:
            parts.append(f"tips of r_c = {radius:.4g} mm {direction} are told from a {name}")
        _key(key, f"told from a {name}", radius, "mm", f"r_c {direction}, of the tips tried, at {share} % of touches")
    if not parts:
        return ["There are no knife edges or flats beside round tips, so limits of the radius cannot be given."]
    return [f"At {share} % of touches {listed(parts)}."]


def _pad(numbers: dict[str, Any], key: list[dict[str, Any]]) -> list[str]:
    estimates = numbers["estimates"]
    rows = {row["where"]: row for row in estimates["errors"]}
    if not rows:
        sd = estimates["posterior_sd_mm"]
        _key(key, "location, posterior sd", sd, "mm", "median over touches; no reference")
        return [
            "The touches have no reference location, so errors cannot be given; by its own account the sensor knows "
            f"the location of a typical touch to {number(sd, 2)} mm (posterior standard deviation)."
        ]
    where = "inside the array" if "inside the array" in rows else "all"
    best = rows[where]["distance"]
    spacing = estimates["spacing_mm"]
    share = f" ({_spacings(best['rms'], spacing)})" if spacing and best["rms"] else ""
    place = "Inside the array of elements, location" if where != "all" else "Location"
    text = [
        f"{place} is read to {number(best['rms'], 2)} mm rms{share}, with a median error of "
        f"{number(best['median_abs'], 2)} mm, over {plural(rows[where]['touches'], 'touch')} not calibrated with."
    ]
    _key(key, f"location error, rms, {where}", best["rms"], "mm", f"median {number(best['median_abs'], 2)} mm")
    outside = rows.get("outside the array")
    if outside and where != "all":
        error = outside["distance"]
        text.append(
            f"Outside it the error is {number(error['rms'], 2)} mm rms over {plural(outside['touches'], 'touch')}, "
            f"median {number(error['median_abs'], 2)} mm."
        )
        _key(key, "location error, rms, outside", error["rms"], "mm", f"median {number(error['median_abs'], 2)} mm")
    if best["rms"] and best["median_abs"] and best["rms"] > 3 * best["median_abs"]:
        text.append("Few touches carry most of that error: the readings are nearly the same at more than one place.")
    several = rows["all"]["several_modes_percent"]
    if several >= 0.05:
        text.append(f"At {percent(several)} % of touches the posterior itself names more than one separate place.")
    load = estimates["load"]
    if load["n"]:
        text += _load(load, key)
    return text


def _intervals(numbers: dict[str, Any]) -> list[str]:
    rows = numbers["trust"]["coverage"]
    if any(row["parameter"] == "region" for row in rows):
        rows = [row for row in rows if row["parameter"] not in ("x", "y")]
    if not rows:
        return []
    what = "regions and intervals" if len(rows) > 1 and rows[-1]["parameter"] == "region" else "intervals"
    parts = [f"{percent(row['percent_inside']['90'])} % of touches for {_SYMBOLS[row['parameter']]}" for row in rows]
    return [f"The stated 90 % {what} hold the reference in {listed(parts)}: {_verdict(rows)}."]


def _verdict(rows: list[dict[str, Any]]) -> str:
    """What coverage says of the stated uncertainties: the worst parameter decides."""
    grade, words = coverage_verdict(rows)
    if grade == "unknown":
        return words
    trust = {"bad": "are too small", "fair": "are somewhat too small", "good": "can be taken at their word"}[grade]
    if words.startswith("as often as they should or more"):
        trust = "can be relied on"
    return f"{words}, so the stated uncertainties {trust}"


def coverage_verdict(rows: list[dict[str, Any]]) -> tuple[str, str]:
    """How often 90 % intervals hold the reference: ``good``, ``fair``, ``bad`` or ``unknown``, and in words."""
    touches = min(row["touches"] for row in rows)
    if touches < _FEWEST:
        return "unknown", f"{plural(touches, 'touch')} cannot tell whether that is as often as it should be"
    off = [(row["percent_inside"]["90"] - 90, max(_AS_CLAIMED, 2 * row["se_90"])) for row in rows]
    below = min(difference + tolerance for difference, tolerance in off)
    if below < _AS_CLAIMED - _NEARLY:
        return "bad", "less often than they should"
    if below < 0:
        return "fair", "a little less often than they should"
    caution = f" (as far as {plural(touches, 'touch')} can tell)" if max(t for _, t in off) > _NEARLY else ""
    if any(difference > tolerance for difference, tolerance in off):
        return "good", f"as often as they should or more{caution}"
    return "good", f"as often as they should{caution}"


def has_lack_of_fit(calibration: dict[str, Any]) -> bool:
    """Whether the calibrated model misses its own touches by more than noise explains."""
    lack = calibration["lack_of_fit"]
    return lack is not None and bool(lack > _LACK_OF_FIT)


def _model(numbers: dict[str, Any]) -> list[str]:
    sentences = []
    lack = numbers["calibration"]["lack_of_fit"]
    if lack is not None and lack > _LACK_OF_FIT:
        sentences.append(
            f"The calibrated model misses its own touches by more than noise explains (lack of fit {number(lack, 2)}, "
            "1 for a model that is right): something systematic is missing from it."
        )
    elif lack is not None:
        sentences.append(
            f"The calibrated model fits its own touches to within noise (lack of fit {number(lack, 2)}, 1 for a model "
            "that is right)."
        )
    sentences += _linearity(numbers["calibration"]["linearity"])
    sampled = numbers["trust"]["calibration_convergence"]
    if sampled is not None and not sampled["met"]:
        sentences.append(
            "The sampler did not reach its targets for the calibration (effective sample size "
            f"{number(sampled['ess_bulk'], 2)}, R-hat {number(sampled['rhat'])}), so its posterior is rough."
        )
    grades = numbers["trust"]["convergence"]
    if grades["missed"]:
        sentences.append(
            f"The sampler did not reach its targets at {grades['missed']} of {plural(grades['touches'], 'touch')}: "
            "those posteriors are less certain than the others."
        )
    return sentences


def _linearity(found: dict[str, Any]) -> list[str]:
    exponent, linear, power = (
        found[name] for name in ("load_exponent", "error_percent_peak_linear", "error_percent_peak_power")
    )
    if exponent is None or linear is None or abs(exponent - 1) < _NOT_LINEAR or linear < 1.1 * power:
        return []
    return [
        f"Linearity does not hold: what readings have beyond an offset grows as {_power(exponent)}, and the linear "
        f"model misses readings left out of its calibration by {number(linear, 2)} % of the peak where that law misses "
        f"them by {number(power, 2)} %."
    ]


def _power(exponent: float) -> str:
    """A law of the load in words; a power near zero with an offset is the logarithm."""
    return "the logarithm of the load" if exponent < 0.05 else f"the load to the power {number(exponent, 2)}"
