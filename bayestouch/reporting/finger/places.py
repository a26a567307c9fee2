"""Expected errors of a finger at each location, predicted from its calibration."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.checking.tables import indenter_name, known_indenters
from bayestouch.data.sensor import Finger, finger_of
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.places import (
    load_is_read,
    place_at,
    rounded_columns,
    typical_load_reads,
    typical_reads,
    typical_samples,
)

#: Tips for the prediction if the touches do not state their tips, r_c in mm.
TIPS = (0.0, 1.0, 3.0, 10.0, np.inf)
# Number of steps along the finger.
_ALONG = 121
# Radius, location and load of a touch.
_UNKNOWNS = 3


def about_places(evidence: Evidence) -> dict[str, Any]:
    """Expected errors of R, θ_c and P along the finger, with the parts from noise and from the calibration.

    They are those of touches like the ones that were read: with a measured load if most of these have one.
    """
    from bayestouch.reliability import KnownFinger, distinguished, sweet_spots, threshold_radii

    known = replace(KnownFinger.of(evidence.calibration), load_reads=typical_load_reads(evidence))
    reads = typical_reads(evidence)
    elements = np.sort(np.degrees(known.chain.angle))
    pitch = float(np.median(np.diff(elements))) if len(elements) > 1 else 10.0
    angle = np.linspace(elements[0] - pitch / 2, elements[-1] + pitch / 2, _ALONG)
    tips = known_indenters(evidence.posteriors.rows.radius_mm)
    tips = np.array(TIPS) if len(tips) < 2 else tips
    # Two elements read no touch without a measured load.
    few_elements = int(known.read_elements.sum()) < _UNKNOWNS
    touches: Any = {"samples": reads, "use_load": few_elements or load_is_read(evidence)}
    spots = sweet_spots(known, tips, angle, **touches)
    threshold = threshold_radii(known, angle, **touches)
    right = distinguished(known, tips, angle, **touches)
    error = np.sqrt((spots.radius_error**2).mean(axis=0))
    columns = {
        "angle_deg": angle,
        "R_error_mm": error,
        "R_noise_mm": _rms(spots.noise_sd["R"]),
        "R_shared_mm": _rms(spots.bias_rms["R"]),
        "theta_c_error_deg": _rms(spots.sd("theta_c")),
        "P_error_N_per_m": _rms(spots.sd("P")),
        "told_from_edge_r_c_mm": threshold,
    }
    noise, shared = float(np.mean(columns["R_noise_mm"] ** 2)), float(np.mean(columns["R_shared_mm"] ** 2))
    # Noise of a load that is not read with each sample stays, too.
    of_load = spots.noise_sd["R"] ** 2 - spots.noise_by_element["R"].sum(axis=-1)
    stays = shared + (0.0 if evidence.posteriors.rows.usual_load_reads is None else float(np.mean(of_load)))
    by_calibration = float(np.mean(spots.calibration_rms["R"] ** 2))
    return {
        "body": "finger",
        **touches,
        "samples": typical_samples(evidence),
        "body_mm": _body(finger_of(evidence.sensor)),
        "elements_deg": np.degrees(known.chain.angle),
        "tips": [indenter_name(float(tip)) for tip in tips],
        "by_location": rounded_columns(columns),
        "best": place_at(columns, int(error.argmin())),
        "worst": place_at(columns, int(error.argmax())),
        "shared_percent": 100 * stays / (noise + shared),
        "calibration_percent": 100 * by_calibration / (noise + shared),
        "model_percent": 100 * (shared - by_calibration) / (noise + shared),
        "distinguished_percent": 100 * right.mean(axis=0),
        "distinguished_least_percent": 100 * right.min(axis=0),
        "threshold_mm": {"lowest": _least(threshold), "highest": _most(threshold)},
        "nowhere_percent": float(100 * np.isnan(threshold).mean()),
    }


def _body(finger: Finger) -> dict[str, float]:
    """Radii of the finger as designed, for drawings of its section."""
    return {
        "outer_radius": finger.outer_radius_mm,
        "core_radius": finger.core_radius_mm,
        "sensing_radius": finger.sensing_radius_mm,
    }


def _rms(values: FloatArray) -> FloatArray:
    """Root mean square over the indenters."""
    return np.asarray(np.sqrt((values**2).mean(axis=0)))


def _least(values: FloatArray) -> float | None:
    return float(np.nanmin(values)) if np.isfinite(values).any() else None


def _most(values: FloatArray) -> float | None:
    return float(np.nanmax(values)) if np.isfinite(values).any() else None
