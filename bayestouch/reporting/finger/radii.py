"""Estimates of touches on a finger compared with their references: Table 3, and which tips can be distinguished."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.checking.tables import indenter_name, known_indenters
from bayestouch.contact import CONTACT_MODELS, indenter_radius
from bayestouch.data.sensor import finger_of
from bayestouch.paper.published import TABLE_3
from bayestouch.reporting.differences import error_summary, estimate_errors, load_errors, reference_composite_radius
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.finger.paper_fits import PaperFits
from bayestouch.reporting.finger.point_fits import PointFits, fit_points, model_finger
from bayestouch.reporting.trust import reference_ranks

#: Two tips count as distinguished if the answer is right for this percentage of touches.
DISTINGUISHED = 95.0


def by_indenter(evidence: Evidence) -> list[dict[str, Any]]:
    """Posterior radius, location and load compared with the reference, one row an indenter."""
    posteriors = evidence.posteriors
    outer = _outer_radius(evidence)
    radius = posteriors.rows.radius_mm
    mean, sd = posteriors.mean("R"), posteriors.sd("R")
    theta = estimate_errors(posteriors, "theta_c")
    load = load_errors(evidence)
    ranks = {name: rank for name, _, rank in reference_ranks(evidence)}
    from_edge, from_flat = _told_from_ends(mean, radius)
    rows = []
    for value in known_indenters(radius):
        these = radius == value
        reference = float(reference_composite_radius(value, outer))
        rank = ranks.get("R", np.full(len(radius), np.nan))[these]
        rank = rank[np.isfinite(rank)]
        spread = float(np.sqrt(np.mean(sd[these] ** 2)))
        rows.append(
            {
                "indenter": indenter_name(float(value)),
                "r_c_mm": float(value),
                "R_mm": reference,
                "touches": int(these.sum()),
                "R": {"mean": float(mean[these].mean()), **error_summary(mean[these] - reference)},
                "r_c_of_mean_R_mm": float(indenter_radius(mean[these].mean(), outer)),
                "R_posterior_sd_mm": spread,
                "R_difference_distinguished_mm": 1.96 * np.sqrt(2) * spread,
                "R_inside_90_percent": float(100 * np.mean(np.abs(rank - 0.5) <= 0.45)) if rank.size else None,
                "theta_c": error_summary(theta[these]),
                "P": error_summary(load[these]),
                "told_from_edge_percent": from_edge.get(float(value)),
                "told_from_flat_percent": from_flat.get(float(value)),
            }
        )
    return rows


def _told_from_ends(mean: FloatArray, radius: FloatArray) -> tuple[dict[float, float], dict[float, float]]:
    """Percentage of each tip's touches whose R is beyond that of 95 % of the edges (or flats)."""
    edge, flat = mean[radius == 0], mean[np.isinf(radius)]
    tips = [float(value) for value in known_indenters(radius) if 0 < value < np.inf]
    from_edge_percent = {} if not edge.size else {r: _share(mean[radius == r] > np.quantile(edge, 0.95)) for r in tips}
    from_flat_percent = {} if not flat.size else {r: _share(mean[radius == r] < np.quantile(flat, 0.05)) for r in tips}
    return from_edge_percent, from_flat_percent


def _share(which: NDArray[np.bool_]) -> float:
    return float(100 * np.mean(which))


def radius_limits(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Limits between which tips are distinguished from a knife edge and from a flat, from the rows of `by_indenter`.

    Only tips that were tried count. A limit holds only if every tip beyond it is distinguished too.
    """
    tips = [row for row in rows if 0 < row["r_c_mm"] < np.inf]
    limits: dict[str, Any] = {"distinguished_percent": DISTINGUISHED, "tips": len(tips)}
    for key, ordered in (("told_from_edge", tips[::-1]), ("told_from_flat", tips)):
        tried = bool(tips) and all(row[f"{key}_percent"] is not None for row in tips)
        limit = None
        for row in ordered if tried else []:
            if row[f"{key}_percent"] < DISTINGUISHED:
                break
            limit = row["r_c_mm"]
        limits[f"{key}_r_c_mm"] = limit
        limits[f"{key}_tried"] = tried
        limits[f"{key}_some"] = tried and any(row[f"{key}_percent"] >= DISTINGUISHED for row in tips)
    return limits


def fits_by_contact_model(evidence: Evidence, paper: PaperFits) -> dict[tuple[str, str], PointFits]:
    """Fits of every touch without the force sensor, by contact model and calibration (``model``, ``empirical``)."""
    means, calibration = evidence.means(), evidence.calibration
    fits = {}
    for contact in CONTACT_MODELS:
        fits[contact, "model"] = fit_points(means, calibration, model_finger(calibration, contact))
        identified = paper.empirical_finger(evidence, contact)
        if identified is not None:
            fits[contact, "empirical"] = fit_points(means, calibration, identified)
    return fits


def contact_models(evidence: Evidence, fits: dict[tuple[str, str], PointFits]) -> list[dict[str, Any]]:
    """Table 3: radius estimates by contact model, one row an indenter, with the printed value if there is one.

    Each estimate is r_c of the mean R over the touches, because near a flat r_c itself has no finite mean.
    """
    outer = _outer_radius(evidence)
    radius = evidence.posteriors.rows.radius_mm
    mean = evidence.posteriors.mean("R")
    printed = {row.r_c: row for row in TABLE_3}
    rows = []
    for value in known_indenters(radius):
        these = radius == value
        estimates: dict[str, dict[str, Any]] = {name: {} for name in CONTACT_MODELS}
        for (contact, calibration), fit in fits.items():
            composite = float(fit.R[these].mean())
            estimates[contact][calibration] = {"R_mm": composite, "r_c_mm": _r_c(composite, outer)}
        composite = float(mean[these].mean())
        paper = printed.get(round(float(value), 2)) if np.isfinite(value) else None
        rows.append(
            {
                "indenter": indenter_name(float(value)),
                "r_c_mm": float(value),
                "R_mm": float(reference_composite_radius(value, outer)),
                "touches": int(these.sum()),
                "fits": estimates,
                "posterior": {"R_mm": composite, "r_c_mm": _r_c(composite, outer)},
                "paper": None
                if paper is None
                else {
                    "hertz": {"model": paper.hertz_model, "empirical": paper.hertz_empirical},
                    "approximate frictionless": {
                        "model": paper.frictionless_model,
                        "empirical": paper.frictionless_empirical,
                    },
                },
            }
        )
    return rows


def _r_c(composite_mm: float, outer_mm: float) -> float | None:
    """r_c of a composite radius; None if it is within a thousandth of the flat."""
    return float(indenter_radius(composite_mm, outer_mm)) if composite_mm < 0.999 * outer_mm else None


def _outer_radius(evidence: Evidence) -> float:
    return float(finger_of(evidence.sensor).outer_radius_mm)
