"""Checks of the posteriors: convergence of the chains, coverage of the intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import turned
from bayestouch.output.text import exact, fixed, number
from bayestouch.reporting.evidence import Evidence
from bayestouch.results.data import BEYOND
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.results.targets import kept_draws, targets_met
from bayestouch.sampling import Demands
from bayestouch.sampling.attempts import demands_of

LEVELS = (50, 80, 90, 95)
# Grades of a touch: +1 if large values are good, -1 if small ones are, and a label.
_GRADES = {
    "ess_bulk": (1, "bulk effective sample size"),
    "rhat": (-1, "R-hat over independent chains"),
    "acceptance": (1, "acceptance of the sampler's proposals"),
    "pareto_k": (-1, "Pareto k of posterior over proposal"),
}


def convergence(posteriors: TouchPosteriors) -> dict[str, Any]:
    """Quality of the draws: worst value and median of every grade, and number of touches that miss its target.

    ``beyond`` counts touches beyond the loads or places of the calibration; ``missed`` is the number of the others that
    miss a target.
    """
    usual, settings = Demands(), posteriors.settings
    demands = replace(
        usual,
        ess_bulk=float(settings.get("least_ess", usual.ess_bulk)),
        rhat=float(settings.get("largest_rhat", usual.rhat)),
    )
    n = len(posteriors.rows.touch)
    rows, missed = [], np.zeros(n, dtype=bool)
    for name, (sign, label) in _GRADES.items():
        if name not in posteriors.sample_stats:
            continue
        values = np.asarray(posteriors.sample_stats[name], dtype=float)
        given = np.isfinite(values)
        target = float(getattr(demands, name))
        # Ensembles have no grade of a proposal. Any other missing grade counts as missed.
        misses = np.where(given, sign * values < sign * target, name != "pareto_k")
        if name in ("ess_bulk", "rhat"):
            missed |= misses
        rows.append(
            {
                "name": name,
                "label": label,
                "target": target,
                "demand": f"at {'least' if sign > 0 else 'most'} {grade_text(name, target, exact)}",
                "worst": float(sign * np.min(sign * values[given])) if given.any() else None,
                "median": float(np.median(values[given])) if given.any() else None,
                "missed": int(misses.sum()),
            }
        )
    beyond = np.asarray(posteriors.sample_stats.get(BEYOND, np.zeros(n))) > 0
    return {
        "touches": n,
        "beyond": int(beyond.sum()),
        "missed": int((missed & ~beyond).sum()),
        "second_round": _second_rounds(posteriors),
        "grades": rows,
    }


def grade_text(name: str, value: float | None, form: Callable[[Any], str] = number) -> str:
    """A grade or its target as text, in a form. R-hat, which is near 1, has three decimals."""
    return fixed(value, 3) if name == "rhat" else form(value)


def grade_rows(grades: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows of `convergence` with the worst value and the median as text."""
    return [{**row, **{key: grade_text(row["name"], row[key]) for key in ("worst", "median")}} for row in grades]


def calibration_convergence(calibration: Calibration) -> dict[str, Any] | None:
    """Grades of the calibration's draws (worst parameter), and whether they meet the targets; None if not sampled."""
    found = {name: calibration.statistics.get(name) for name in ("ess_bulk", "rhat", "acceptance")}
    if found["ess_bulk"] is None or found["rhat"] is None:
        return None
    kept = kept_draws(calibration.posterior)
    draws = None if kept is None else math.prod(kept)
    demands = demands_of(draws)
    targets = {"draws": draws, "least_ess": demands.ess_bulk, "largest_rhat": demands.rhat}
    return {**found, **targets, "met": targets_met(calibration.statistics, kept)}


def _second_rounds(posteriors: TouchPosteriors) -> int | None:
    """Number of touches for which the first proposal was not sufficient."""
    stats = posteriors.sample_stats
    if "round" in stats:
        return int(np.sum(np.asarray(stats["round"]) > 1))
    return int(np.sum(stats["second_round"])) if "second_round" in stats else None


def reference_ranks(evidence: Evidence) -> Iterator[tuple[str, str, FloatArray]]:
    """Name, unit and ranks of each parameter: share of draws below the reference, (t,), NaN without a reference.

    Ranks are uniform if the posteriors are calibrated. R is ranked for round tips only, because edge and flat are the
    limits of the prior, and no central interval contains a limit. The load is ranked among draws of the reading of the
    force sensor, from posteriors that did not use that reading.
    """
    posteriors = evidence.posteriors
    units = {parameter.name: parameter.unit for parameter in posteriors.parameters}
    for name in ("theta_c", "x", "y", "R"):
        if name not in posteriors.posterior or name not in posteriors.reference:
            continue
        draws, reference = posteriors.posterior[name], posteriors.reference[name]
        difference = turned(draws - reference) if name == "theta_c" else draws - reference
        rank = _ranks(difference, reference)
        if name == "R":
            radius = posteriors.rows.radius_mm
            rank = np.where((radius > 0) & np.isfinite(radius), rank, np.nan)
        yield name, units[name], rank
    unseen = evidence.without_load
    if unseen is not None and "P" in unseen.posterior:
        measured = posteriors.rows.load
        sd = evidence.calibration.noise.mean_load_sd(posteriors.rows.load_reads)
        noise = np.random.default_rng(evidence.seed).standard_normal(unseen.posterior["P"].shape)
        draws = unseen.posterior["P"] + np.where(np.isfinite(sd), sd, 0.0) * noise
        yield "P", units["P"], _ranks(draws - measured, measured)


def _ranks(difference: FloatArray, reference: FloatArray) -> FloatArray:
    return np.where(np.isfinite(reference), (difference < 0).mean(axis=(0, 1)), np.nan)


def coverage(evidence: Evidence) -> list[dict[str, Any]]:
    """Percentage of references inside central intervals, by parameter and nominal level.

    On a pad also for highest-density regions of the location, which suit a posterior with several modes.
    """
    rows = []
    for name, unit, rank in reference_ranks(evidence):
        known = rank[np.isfinite(rank)]
        if known.size:
            inside = {str(level): float(100 * np.mean(np.abs(known - 0.5) <= level / 200)) for level in LEVELS}
            rows.append(_coverage_row(name, unit, known.size, inside))
    level = evidence.posteriors.sample_stats.get("reference_level")
    if level is not None and np.isfinite(level).any():
        known = np.asarray(level)[np.isfinite(level)]
        inside = {str(step): float(100 * np.mean(known <= step / 100)) for step in LEVELS}
        rows.append(_coverage_row("region", "mm", known.size, inside))
    return rows


def calibration_uncertainty(evidence: Evidence, names: Sequence[str]) -> list[dict[str, Any]] | None:
    """Effect of the calibration's uncertainty on the posteriors of `names`: plugged-in and propagated calibration.

    Median posterior standard deviation, and percentage of references inside intervals. For the load, posteriors without
    the force sensor are used if there are any. None if the touches were inferred in one way only.
    """
    other = evidence.counterpart
    if other is None:
        return None
    ways = (
        {"plug_in": evidence, "propagated": other} if evidence.plug_in else {"plug_in": other, "propagated": evidence}
    )
    covered = {way: {row["parameter"]: row for row in coverage(each)} for way, each in ways.items()}
    units = {parameter.name: parameter.unit for parameter in evidence.posteriors.parameters}
    rows = []
    for name in names:
        row: dict[str, Any] = {"parameter": name, "unit": units[name]}
        for way, each in ways.items():
            read = each.without_load if name == "P" and each.without_load is not None else each.posteriors
            inside = covered[way].get(name)
            row["touches"] = 0 if inside is None else inside["touches"]
            row["se_90"] = None if inside is None else inside["se_90"]
            row[way] = {
                "posterior_sd": float(np.median(read.sd(name))),
                "percent_inside": None if inside is None else inside["percent_inside"],
            }
        rows.append(row)
    return rows


def _coverage_row(name: str, unit: str, n: int, inside: dict[str, float]) -> dict[str, Any]:
    standard_error = 100 * float(np.sqrt(0.9 * 0.1 / n))
    return {"parameter": name, "unit": unit, "touches": int(n), "percent_inside": inside, "se_90": standard_error}
