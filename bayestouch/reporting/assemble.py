"""Every number of a report, as one dictionary."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from bayestouch.data.json_values import strict
from bayestouch.reporting.about import about_data
from bayestouch.reporting.answer import answer
from bayestouch.reporting.calibration_tables import about_calibration
from bayestouch.reporting.differences import error_summary, estimate_errors, load_errors
from bayestouch.reporting.error_split import error_split
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.locations import axes_of, pad_errors
from bayestouch.reporting.made import command, versions
from bayestouch.reporting.next_steps import next_steps
from bayestouch.reporting.paper import published_tables
from bayestouch.reporting.paper_fits import PaperFits
from bayestouch.reporting.peak_table import same_finger_as_paper
from bayestouch.reporting.places import about_places
from bayestouch.reporting.radii import by_indenter, contact_models, fits_by_contact_model, radius_limits
from bayestouch.reporting.residuals import about_residuals
from bayestouch.reporting.touch_list import about_touches
from bayestouch.reporting.trust import (
    calibration_convergence,
    calibration_uncertainty,
    convergence,
    coverage,
    element_spacing,
)
from bayestouch.reporting.verdict import short_answers
from bayestouch.version import __version__


def report_numbers(evidence: Evidence) -> dict[str, Any]:
    """Everything that the page shows, in public units: mm, degree, MPa, N/m on a finger, N on a pad."""
    paper = PaperFits.of(evidence) if evidence.is_finger else None
    numbers: dict[str, Any] = {
        "bayestouch": {
            "version": __version__,
            "seed": evidence.seed,
            "draws_per_touch": evidence.draws,
            "plug_in": evidence.plug_in,
            "versions": versions(),
            "command": command(evidence),
        },
        "data": about_data(evidence),
        "calibration": about_calibration(evidence, paper),
        "estimates": _pad_estimates(evidence) if paper is None else _finger_estimates(evidence, paper),
        "residuals": about_residuals(evidence),
        "trust": {
            "coverage": coverage(evidence),
            "calibration_uncertainty": calibration_uncertainty(evidence),
            "convergence": convergence(evidence.posteriors),
            "calibration_convergence": calibration_convergence(evidence.calibration),
        },
        "paper": published_tables() if evidence.embedded else None,
    }
    numbers["places"] = about_places(evidence)
    numbers["diagnosis"] = None if evidence.diagnosed is None else evidence.diagnosed.numbers
    numbers["touches"] = about_touches(evidence)
    numbers = strict(numbers)
    numbers["next"] = next_steps(evidence, numbers)
    said = {**answer(numbers), "verdict": short_answers(numbers)}
    return {"answer": strict(said), **numbers}


def _finger_estimates(evidence: Evidence, paper: PaperFits) -> dict[str, Any]:
    posteriors = evidence.posteriors
    rows = by_indenter(evidence)
    out: dict[str, Any] = {
        "overall": {
            "theta_c": _location(evidence),
            "P": _load(evidence),
            "R": error_summary(estimate_errors(posteriors, "R")),
        },
        "posterior_sd": {name: float(np.median(posteriors.sd(name))) for name in ("theta_c", "P", "R")},
        "by_indenter": rows,
        "radius_limits": radius_limits(rows),
        "contact_models": [],
        "same_finger_as_paper": same_finger_as_paper(evidence),
        "error_split": error_split(evidence, paper),
        "outer_radius_mm": evidence.sensor.finger.outer_radius_mm,
    }
    if rows:
        out["contact_models"] = contact_models(evidence, fits_by_contact_model(evidence, paper))
    return out


def _location(evidence: Evidence) -> dict[str, Any]:
    summary = error_summary(estimate_errors(evidence.posteriors, "theta_c"))
    outer = evidence.sensor.finger.outer_radius_mm
    spacing = element_spacing(evidence)
    return {
        **summary,
        "rms_mm": None if summary["rms"] is None else math.radians(summary["rms"]) * outer,
        "spacing": None if spacing is None else spacing[0],
    }


def _load(evidence: Evidence) -> dict[str, Any]:
    """Load read without the force sensor, against the force sensor."""
    unit = evidence.sensor.body.load_unit
    if evidence.without_load is None:
        return {**error_summary([]), "unit": unit, "rms_percent": None}
    summary = error_summary(load_errors(evidence))
    mean = float(np.nanmean(evidence.posteriors.rows.load))
    return {**summary, "unit": unit, "rms_percent": None if not summary["n"] else 100 * summary["rms"] / mean}


def _pad_estimates(evidence: Evidence) -> dict[str, Any]:
    spacing = element_spacing(evidence)
    posteriors = evidence.posteriors
    sd = np.sqrt(sum(posteriors.sd(axis) ** 2 for axis in axes_of(posteriors)))
    return {
        "axes": list(axes_of(posteriors)),
        "errors": pad_errors(evidence),
        "spacing_mm": None if spacing is None else spacing[0],
        "posterior_sd_mm": float(np.median(sd)),
        "load": _load(evidence),
    }
