"""Differences between estimates and references, and their summaries."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.contact import composite_radius
from bayestouch.data.arrays import turned
from bayestouch.reporting.evidence import Evidence
from bayestouch.results.objects import TouchPosteriors
from bayestouch.results.units import load_unit


def estimate_errors(posteriors: TouchPosteriors, name: str) -> FloatArray:
    """Posterior mean minus reference of each touch, (t,); NaN without a reference."""
    error = posteriors.mean(name) - posteriors.reference[name]
    return turned(error) if name == "theta_c" else np.asarray(error)


def load_errors(evidence: Evidence) -> FloatArray:
    """Load inferred without the force sensor minus its reading, (t,); NaN if there is no reading."""
    measured = evidence.posteriors.rows.load
    if evidence.without_load is None:
        return np.full(len(measured), np.nan)
    return np.asarray(evidence.without_load.mean("P") - measured)


def error_summary(error: ArrayLike) -> dict[str, Any]:
    """Number, mean, standard deviation, rms, and median and 90 % quantile of absolute errors; NaN are left out."""
    values = np.asarray(error, dtype=float)
    values = values[np.isfinite(values)]
    if not values.size:
        return {"n": 0, **dict.fromkeys(("bias", "sd", "rms", "median_abs", "abs_90"))}
    return {
        "n": int(values.size),
        "bias": float(values.mean()),
        "sd": float(values.std(ddof=1)) if values.size > 1 else None,
        "rms": float(np.sqrt(np.mean(values**2))),
        "median_abs": float(np.median(np.abs(values))),
        "abs_90": float(np.quantile(np.abs(values), 0.9)),
    }


def reference_composite_radius(radius_mm: ArrayLike, outer_radius_mm: float) -> FloatArray:
    """Composite radius R (mm) of reference radii r_c; NaN stays NaN."""
    radius = np.asarray(radius_mm, dtype=float)
    known = ~np.isnan(radius)
    return np.where(known, composite_radius(np.where(known, radius, 0.0), outer_radius_mm), np.nan)


def three(values: ArrayLike) -> dict[str, Any]:
    """Minimum, mean and maximum without NaN: the paper's summary over elements."""
    some = np.asarray(values, dtype=float)
    some = some[np.isfinite(some)]
    if not some.size:
        return {"minimum": None, "average": None, "maximum": None}
    return {"minimum": float(some.min()), "average": float(some.mean()), "maximum": float(some.max())}


def load_summary(evidence: Evidence) -> dict[str, Any]:
    """Summary of the load inferred without the force sensor, compared with its readings."""
    unit = load_unit(evidence.posteriors)
    if evidence.without_load is None:
        return {**error_summary([]), "unit": unit, "rms_percent": None}
    summary = error_summary(load_errors(evidence))
    mean = float(np.nanmean(evidence.posteriors.rows.load))
    return {**summary, "unit": unit, "rms_percent": None if not summary["n"] else 100 * summary["rms"] / mean}
