"""Errors divided into a part of the location and a part of the noise: Table 4 of the paper."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import turned
from bayestouch.data.averages import TouchMeans
from bayestouch.data.grouping import index_among
from bayestouch.data.sensor import finger_of
from bayestouch.paper.published import TABLE_4
from bayestouch.paper.simplex import TouchPredictor
from bayestouch.reporting.differences import reference_composite_radius
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.finger.paper_fits import PaperFits
from bayestouch.reporting.finger.point_fits import PointFits, fit_points, model_finger

NAMES = ("theta_c", "P", "R")
PARTS = ("total", "location", "noise")


def error_split(evidence: Evidence, paper: PaperFits) -> dict[str, Any] | None:
    """Standard deviations of the errors of θ_c (degree), P (N/m) and R (mm), in up to three blocks.

    The blocks use the fitted model, the identified map, and the fitted model with the force sensor. Total: fits to
    single samples minus the reference. Location: fits to the mean of each touch's samples minus the reference. Noise:
    fits to single samples minus the fit to their mean. None if no touch has two samples.
    """
    means, samples = evidence.means(), evidence.means(each_sample=True)
    of_sample = index_among(means.touch, evidence.touch_of_samples)
    if not np.any(np.bincount(of_sample) > 1):
        return None
    measured = bool(np.isfinite(means.load).any())
    contact = str(evidence.calibration.settings["contact"])
    model = model_finger(evidence.calibration, contact)
    identified = paper.empirical_finger(evidence, contact)
    ways: list[tuple[str, bool, TouchPredictor]] = [("model", False, model)]
    ways += [("empirical", False, identified)] if identified is not None else []
    ways += [("model", True, model)] if measured else []
    blocks = []
    for calibration, use_load, finger in ways:
        averaged = fit_points(means, evidence.calibration, finger, use_load=use_load)
        single = fit_points(samples, evidence.calibration, finger, use_load=use_load)
        rows = _rows(evidence, means, samples, averaged, single, of_sample, use_load=use_load)
        blocks.append({"calibration": calibration, "with_force_sensor": use_load, "rows": rows})
    return {
        "touches": means.n_touches,
        "samples": samples.n_touches,
        "blocks": blocks,
        "paper": [
            {"calibration": row.calibration, "part": row.part, "theta_c": row.theta_c, "P": row.P, "R": row.R}
            for row in TABLE_4
        ],
    }


def _rows(
    evidence: Evidence,
    means: TouchMeans,
    samples: TouchMeans,
    averaged: PointFits,
    single: PointFits,
    of_sample: NDArray[np.int64],
    *,
    use_load: bool,
) -> list[dict[str, Any]]:
    outer = float(finger_of(evidence.sensor).outer_radius_mm)
    unknown = np.full(means.n_touches, np.nan)
    angle = unknown if means.angle_deg is None else means.angle_deg
    radius = reference_composite_radius(means.indenter_radius_mm, outer)
    # A load that was used in the fit cannot be a reference for it.
    of_touch, of_each = (np.full(len(a), np.nan) if use_load else a for a in (means.load, samples.load))
    errors = {
        "total": {
            "theta_c": turned(single.theta_c - angle[of_sample]),
            "P": single.P - of_each,
            "R": single.R - radius[of_sample],
        },
        "location": {
            "theta_c": turned(averaged.theta_c - angle),
            "P": averaged.P - of_touch,
            "R": averaged.R - radius,
        },
        "noise": {
            "theta_c": turned(single.theta_c - averaged.theta_c[of_sample]),
            "P": single.P - averaged.P[of_sample],
            "R": single.R - averaged.R[of_sample],
        },
    }
    return [{"part": part, **{name: _sd(errors[part][name]) for name in NAMES}} for part in PARTS]


def _sd(values: FloatArray) -> float | None:
    some = values[np.isfinite(values)]
    return float(some.std()) if some.size > 1 else None
