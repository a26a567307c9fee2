"""Parts of ``report.json`` for a finger."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from bayestouch.data.sensor import finger_of
from bayestouch.reporting.body_pages import BodyNumbers
from bayestouch.reporting.differences import (
    error_summary,
    estimate_errors,
    load_errors,
    load_summary,
    reference_composite_radius,
    three,
)
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.finger.error_split import error_split
from bayestouch.reporting.finger.paper import published_tables
from bayestouch.reporting.finger.paper_fits import PaperFits
from bayestouch.reporting.finger.peaks import element_peaks, same_finger_as_paper
from bayestouch.reporting.finger.places import about_places
from bayestouch.reporting.finger.radii import by_indenter, contact_models, fits_by_contact_model, radius_limits
from bayestouch.reporting.headline import HeadlineError
from bayestouch.reporting.peak_table import element_peak


def finger_numbers(evidence: Evidence) -> BodyNumbers:
    """Numbers of a finger; the fits of the paper's method are made once for all parts that use them."""
    paper = PaperFits.of(evidence)
    return BodyNumbers(
        peak=element_peaks(evidence, paper),
        estimates=_estimates(evidence, paper),
        places=about_places(evidence),
        prediction=_prediction(evidence),
        paper=published_tables() if evidence.embedded else None,
    )


def headline_quantities(evidence: Evidence) -> list[HeadlineError]:
    """Location, load read without the force sensor, and composite radius of a finger."""
    posteriors = evidence.posteriors
    unseen = posteriors if evidence.without_load is None else evidence.without_load
    unit = evidence.sensor.body.load_unit
    return [
        HeadlineError("location θ", "degree", estimate_errors(posteriors, "theta_c"), posteriors.sd("theta_c")),
        HeadlineError("load", unit, load_errors(evidence), unseen.sd("P")),
        HeadlineError("composite radius R", "mm", estimate_errors(posteriors, "R"), posteriors.sd("R")),
    ]


def _estimates(evidence: Evidence, paper: PaperFits) -> dict[str, Any]:
    posteriors, finger = evidence.posteriors, finger_of(evidence.sensor)
    rows = by_indenter(evidence)
    out: dict[str, Any] = {
        "overall": {
            "theta_c": _location(evidence),
            "P": load_summary(evidence),
            "R": error_summary(estimate_errors(posteriors, "R")),
        },
        "posterior_sd": {name: float(np.median(posteriors.sd(name))) for name in ("theta_c", "P", "R")},
        "by_indenter": rows,
        "radius_limits": radius_limits(rows),
        "contact_models": [],
        "same_finger_as_paper": same_finger_as_paper(finger),
        "error_split": error_split(evidence, paper),
        "outer_radius_mm": finger.outer_radius_mm,
    }
    if rows:
        out["contact_models"] = contact_models(evidence, fits_by_contact_model(evidence, paper))
    return out


def _location(evidence: Evidence) -> dict[str, Any]:
    summary = error_summary(estimate_errors(evidence.posteriors, "theta_c"))
    finger = finger_of(evidence.sensor)
    return {
        **summary,
        "rms_mm": None if summary["rms"] is None else math.radians(summary["rms"]) * finger.outer_radius_mm,
        "spacing": finger.pitch_deg,
    }


def _prediction(evidence: Evidence) -> dict[str, Any] | None:
    """Rms of reading minus prediction for the reference values of the touches, in % of each element's peak.

    None if no touch has a known radius, location and load.
    """
    from bayestouch.reliability import KnownFinger, TouchPlaces

    rows = evidence.posteriors.rows
    sensor = KnownFinger.of(evidence.calibration)
    radius = reference_composite_radius(rows.radius_mm, sensor.outer_radius_mm)
    angle = rows.location["theta_c"]
    known = np.isfinite(radius) & np.isfinite(angle) & np.isfinite(rows.load)
    if not known.any():
        return None
    predicted = sensor.predict(TouchPlaces(radius[known], np.radians(angle[known]), rows.load[known]))
    difference = rows.observed[known] - predicted
    present = np.isfinite(difference)
    n = np.maximum(present.sum(axis=0), 1)
    rms = np.sqrt((np.where(present, difference, 0.0) ** 2).sum(axis=0) / n)
    percent = np.where(present.any(axis=0), 100 * rms / element_peak(evidence.calibration), np.nan)
    return {"touches": int(known.sum()), "percent_peak": three(percent)}
