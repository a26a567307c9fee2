"""Estimated locations of touches on a pad, compared with their references."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.data.sensor import pad_of
from bayestouch.reporting.differences import error_summary
from bayestouch.reporting.evidence import Evidence
from bayestouch.results.objects import TouchPosteriors


def axes_of(posteriors: TouchPosteriors) -> tuple[str, ...]:
    """Coordinates of a pad's touches: ``x`` and, in the plane, ``y``."""
    return tuple(axis for axis in ("x", "y") if axis in posteriors.posterior)


def location_errors(evidence: Evidence) -> FloatArray:
    """Posterior mean minus reference on a pad, mm, shape (t, D)."""
    posteriors = evidence.posteriors
    return np.stack([posteriors.mean(a) - posteriors.reference[a] for a in axes_of(posteriors)], axis=1)


def reference_locations(evidence: Evidence) -> FloatArray:
    """Reference locations on a pad, mm, shape (t, D)."""
    posteriors = evidence.posteriors
    return np.stack([posteriors.reference[a] for a in axes_of(posteriors)], axis=1)


def element_places(evidence: Evidence) -> FloatArray:
    """Places of the elements of a pad, mm, (m, D); the calibrated ones if places are part of the calibration."""
    nominal, mode = pad_of(evidence.sensor).places_mm, evidence.calibration.mode
    columns = []
    for axis in axes_of(evidence.posteriors):
        name = next((key for key in (f"{axis}_s", axis) if key in mode), None)
        columns.append(np.asarray(nominal[axis] if name is None else mode[name], dtype=float))
    return np.stack(columns, axis=1)


def inside_array(evidence: Evidence) -> BoolArray:
    """True for touches inside the smallest rectangle around the elements, (t,)."""
    places, reference = element_places(evidence), reference_locations(evidence)
    with np.errstate(invalid="ignore"):
        inside = (reference >= places.min(axis=0)) & (reference <= places.max(axis=0))
    return np.asarray(inside.all(axis=1))


def pad_errors(evidence: Evidence) -> list[dict[str, Any]]:
    """Location errors of all touches on a pad, and of those inside and outside the array of elements."""
    error = location_errors(evidence)
    known = np.isfinite(error).all(axis=1)
    inside = inside_array(evidence)
    distance = np.sqrt((error**2).sum(axis=1))
    posteriors = evidence.posteriors
    spread = np.sqrt(sum(posteriors.sd(axis) ** 2 for axis in axes_of(posteriors)))
    several = several_modes(posteriors)
    rows = []
    for where, these in (("all", known), ("inside the array", known & inside), ("outside the array", known & ~inside)):
        if not these.any():
            continue
        rows.append(
            {
                "where": where,
                "touches": int(these.sum()),
                "distance": error_summary(distance[these]),
                "axes": {axis: error_summary(error[these, i]) for i, axis in enumerate(axes_of(posteriors))},
                "posterior_sd_median_mm": float(np.median(spread[these])),
                "several_modes_percent": float(100 * np.mean(several[these])),
            }
        )
    return rows


def several_modes(posteriors: TouchPosteriors) -> BoolArray:
    """True for touches whose posterior has more than one mode, (t,), as counted when it was drawn."""
    modes = posteriors.sample_stats.get("modes")
    return np.zeros(len(posteriors.rows.touch), dtype=bool) if modes is None else np.asarray(modes) > 1
