"""Text about a pad at the top of its report."""

from __future__ import annotations

from typing import Any

from bayestouch.output.text import fixed, number, percent, plural
from bayestouch.reporting.phrases import (
    MOSTLY_SEVERAL,
    add_key,
    calibrated_with,
    in_spacings,
    load_error,
    verdict_row,
    with_load,
)


def errors_and_limits(numbers: dict[str, Any]) -> tuple[list[str], list[dict[str, Any]]]:
    """Sentences on the errors of location and load, and key numbers."""
    key: list[dict[str, Any]] = []
    estimates = numbers["estimates"]
    rows = {row["where"]: row for row in estimates["errors"]}
    if not rows:
        sd = estimates["posterior_sd_mm"]
        add_key(key, "location, posterior sd", sd, "mm", "median over touches; no reference")
        text = [
            "The touches have no reference location, so errors cannot be given; by its own account the sensor knows "
            f"the location of a typical touch to {number(sd, 2)} mm (posterior standard deviation)."
        ]
        return [*text, *_load(estimates, key)], key
    where = "inside the array" if "inside the array" in rows else "all"
    best = rows[where]["distance"]
    spacing = estimates["spacing_mm"]
    share = f" ({in_spacings(best['rms'], spacing)})" if spacing and best["rms"] else ""
    place = "Inside the array of elements, location" if where != "all" else "Location"
    text = [
        f"{place} is read to {number(best['rms'], 2)} mm rms{share}, with a median error of "
        f"{number(best['median_abs'], 2)} mm, over {plural(rows[where]['touches'], 'touch')} "
        f"{calibrated_with(numbers['data']['copied_percent'])}."
    ]
    add_key(key, f"location error, rms, {where}", best["rms"], "mm", f"median {number(best['median_abs'], 2)} mm")
    outside = rows.get("outside the array")
    if outside and where != "all":
        error = outside["distance"]
        text.append(
            f"Outside it the error is {number(error['rms'], 2)} mm rms over {plural(outside['touches'], 'touch')}, "
            f"median {number(error['median_abs'], 2)} mm."
        )
        add_key(key, "location error, rms, outside", error["rms"], "mm", f"median {number(error['median_abs'], 2)} mm")
    if best["rms"] and best["median_abs"] and best["rms"] > 3 * best["median_abs"]:
        text.append("Few touches carry most of that error: the readings are nearly the same at more than one place.")
    several = rows["all"]["several_modes_percent"]
    if several >= 0.05:
        text.append(f"At {percent(several)} % of touches the posterior itself names more than one separate place.")
    return [*text, *_load(estimates, key)], key


def _load(estimates: dict[str, Any], key: list[dict[str, Any]]) -> list[str]:
    """Sentence on the error of the load, if loads were measured, and its key number."""
    return load_error(estimates["load"], key) if estimates["load"]["n"] else []


def own_answers(numbers: dict[str, Any]) -> list[dict[str, str]]:
    """Answer on where the errors of a pad are smallest."""
    places, several = numbers["places"], numbers["estimates"]["several_modes_percent"]
    best, worst = places["best"], places["worst"]
    reason = (
        f"Predicted from the calibration, for touches {with_load(places)}: location to "
        f"{number(best['error_mm'], 2)} mm at the best place and "
        f"{number(worst['error_mm'], 2)} mm at the worst, within {places['within']}."
    )
    if several >= MOSTLY_SEVERAL:
        reason += (
            f" At {percent(several)} % of touches more than one separate place fits the readings: this is the error "
            "about one of them."
        )
    return [verdict_row("Where?", f"Best at {_place(best)}, worst at {_place(worst)}", reason)]


def _place(place: dict[str, Any]) -> str:
    axes = (("x", "x_mm"), ("y", "y_mm"))
    return ", ".join(f"{axis} = {fixed(place[key], 1)}" for axis, key in axes if key in place) + " mm"
