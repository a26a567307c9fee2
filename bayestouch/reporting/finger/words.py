"""Text about a finger at the top of its report."""

from __future__ import annotations

from typing import Any

from bayestouch.output.text import fixed, listed, number, percent, plural
from bayestouch.reporting.phrases import add_key, in_spacings, load_error, verdict_row, with_load


def errors_and_limits(numbers: dict[str, Any]) -> tuple[list[str], list[dict[str, Any]]]:
    """Sentences on the errors of location, load and radius, and key numbers."""
    key: list[dict[str, Any]] = []
    estimates = numbers["estimates"]
    location, load, radius = (estimates["overall"][name] for name in ("theta_c", "P", "R"))
    sentences = []
    if location["n"]:
        share = f", {in_spacings(location['rms'], location['spacing'])}" if location["spacing"] else ""
        sentences.append(
            f"Location is read to {number(location['rms'], 2)}° rms ({number(location['rms_mm'], 2)} mm along the "
            f"surface{share}) over {plural(location['n'], 'touch')}."
        )
        add_key(
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
        add_key(key, "location, posterior sd", sd, "degree", "median over touches; no reference")
    sentences += load_error(load, key)
    sentences += _radius(estimates, radius, key)
    return sentences, key


def _radius(estimates: dict[str, Any], radius: dict[str, Any], key: list[dict[str, Any]]) -> list[str]:
    if not radius["n"]:
        sd = estimates["posterior_sd"]["R"]
        add_key(key, "composite radius R, posterior sd", sd, "mm", "median over touches; no reference")
        return [
            "No indenter radius is stated for these touches, so nothing can be said of the error of the radius; the "
            f"posterior standard deviation of the composite radius R is {number(sd, 2)} mm at a typical touch."
        ]
    add_key(
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
    for end, name, direction, last in (
        ("told_from_edge", "knife edge", "and blunter", "bluntest"),
        ("told_from_flat", "flat", "and sharper", "sharpest"),
    ):
        if not limits[f"{end}_tried"]:
            continue
        radius = limits[f"{end}_r_c_mm"]
        if radius is None and limits[f"{end}_some"]:
            parts.append(f"the {last} tip that was tried is not distinguished from a {name}, though others are")
        elif radius is None:
            parts.append(f"no tip that was tried is distinguished from a {name}")
        else:
            parts.append(f"tips of r_c = {radius:.4g} mm {direction} are distinguished from a {name}")
        add_key(
            key,
            f"distinguished from a {name}",
            radius,
            "mm",
            f"r_c {direction}, of the tips tried, at {share} % of touches",
        )
    if not parts:
        return ["There are no knife edges or flats beside round tips, so limits of the radius cannot be given."]
    return [f"At {share} % of touches {listed(parts)}."]


def own_answers(numbers: dict[str, Any]) -> list[dict[str, str]]:
    """Answers on where the errors are smallest, and on the smallest radius that is distinguished from an edge."""
    return [_where(numbers["places"]), _smallest(numbers)]


def _where(places: dict[str, Any]) -> dict[str, str]:
    best, worst = places["best"], places["worst"]
    short = f"Best at θ = {fixed(best['angle_deg'], 0)}°, worst at {fixed(worst['angle_deg'], 0)}°"
    reason = (
        f"Predicted from the calibration, for touches {with_load(places)}: the error of R is "
        f"{number(best['R_error_mm'], 2)} mm rms at the best location and "
        f"{number(worst['R_error_mm'], 2)} mm at the worst, within half a pitch of the elements."
    )
    return verdict_row("Where?", short, reason)


def _smallest(numbers: dict[str, Any]) -> dict[str, str]:
    span, nowhere = numbers["places"]["threshold_mm"], numbers["places"]["nowhere_percent"]
    question = "Down to which radius?"
    seen = _seen(numbers["estimates"]["radius_limits"])
    if span["lowest"] is None:
        return verdict_row(
            question,
            "None",
            "Nowhere does one touch distinguish even a flat from a knife edge with 95 % probability (predicted)."
            f"{seen}",
        )
    if number(span["lowest"], 2) == number(span["highest"], 2):
        short = f"r_c = {number(span['lowest'], 2)} mm"
    else:
        short = f"r_c = {number(span['lowest'], 2)} to {number(span['highest'], 2)} mm, depending on location"
    lost = f" At {percent(nowhere)} % of locations nothing is." if nowhere else ""
    return verdict_row(
        question,
        short,
        f"Blunter tips are distinguished from a knife edge with 95 % probability (predicted).{lost}{seen}",
    )


def _seen(limits: dict[str, Any]) -> str:
    radius = limits["told_from_edge_r_c_mm"]
    if not limits["told_from_edge_tried"] or radius is None:
        return ""
    return f" Of the tips tried, {radius:.4g} mm and blunter were."
