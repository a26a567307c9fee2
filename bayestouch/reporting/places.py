"""Where a sensor reads well and where not, predicted from its calibration before any touch is read."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.checking.tables import indenter_name, known_indenters
from bayestouch.data.sensor import Finger
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.locations import element_places

#: Tips that are asked for where no touch says with which it was made, r_c in mm.
TIPS = (0.0, 1.0, 3.0, 10.0, np.inf)
# Steps along a finger or a line, and along each side of a plane.
_ALONG, _ACROSS = 121, 41


def about_places(evidence: Evidence) -> dict[str, Any]:
    """Maps of the errors to expect, with the parts that noise and calibration have in them."""
    return _finger(evidence) if evidence.is_finger else _pad(evidence)


def typical_samples(evidence: Evidence) -> int:
    """Raw readings behind a typical touch."""
    counts = evidence.posteriors.rows.counts
    return int(max(np.median(counts[counts > 0]), 1)) if (counts > 0).any() else 1


def _finger(evidence: Evidence) -> dict[str, Any]:
    from bayestouch.reliability import KnownFinger, distinguished, sweet_spots, threshold_radii

    known = KnownFinger.of(evidence.calibration)
    body = evidence.sensor.body
    assert isinstance(body, Finger)
    samples = typical_samples(evidence)
    elements = np.sort(np.degrees(known.chain.angle))
    pitch = float(np.median(np.diff(elements))) if len(elements) > 1 else 10.0
    angle = np.linspace(elements[0] - pitch / 2, elements[-1] + pitch / 2, _ALONG)
    tips = known_indenters(evidence.posteriors.rows.radius_mm)
    tips = np.array(TIPS) if len(tips) < 2 else tips
    spots = sweet_spots(known, tips, angle, samples=samples)
    threshold = threshold_radii(known, angle, samples=samples)
    right = distinguished(known, tips, angle, samples=samples)
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
    return {
        "body": "finger",
        "samples": samples,
        "elements_deg": np.degrees(known.chain.angle),
        "tips": [indenter_name(float(tip)) for tip in tips],
        "by_location": _rows(columns),
        "best": _place(columns, int(error.argmin())),
        "worst": _place(columns, int(error.argmax())),
        "shared_percent": 100 * shared / (noise + shared),
        "distinguished_percent": 100 * right.mean(axis=0),
        "distinguished_least_percent": 100 * right.min(axis=0),
        "threshold_mm": {"lowest": _least(threshold), "highest": _most(threshold)},
        "nowhere_percent": float(100 * np.isnan(threshold).mean()),
    }


def _pad(evidence: Evidence) -> dict[str, Any]:
    from bayestouch.pad.reading.reader import PadReader
    from bayestouch.reliability import pad_spots

    reader = PadReader.from_calibration(evidence.calibration)
    samples = typical_samples(evidence)
    low, high = np.asarray(reader.map.low), np.asarray(reader.map.high)
    axes = [np.linspace(a, b, _ALONG if len(low) == 1 else _ACROSS) for a, b in zip(low, high, strict=True)]
    where = np.stack([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")], axis=1)
    spots = pad_spots(reader, where, reads=samples)
    places = element_places(evidence)
    inside = ((where >= places.min(axis=0)) & (where <= places.max(axis=0))).all(axis=1)
    inside = inside if inside.any() else np.ones(len(where), dtype=bool)
    columns = {name: where[:, i] for i, name in enumerate(("x_mm", "y_mm")[: where.shape[1]])}
    columns |= {
        "error_mm": spots.sd,
        "noise_mm": np.sqrt((spots.noise_sd**2).sum(axis=1)),
        "shared_mm": np.sqrt((spots.bias_rms**2).sum(axis=1)),
    }
    noise, shared = (float(np.mean(columns[name][inside] ** 2)) for name in ("noise_mm", "shared_mm"))
    within = np.flatnonzero(inside)
    return {
        "body": "pad",
        "samples": samples,
        "by_location": _rows(columns),
        "elements_mm": places,
        "best": _place(columns, int(within[spots.sd[within].argmin()])),
        "worst": _place(columns, int(within[spots.sd[within].argmax()])),
        "inside_rms_mm": float(np.sqrt(np.mean(spots.sd[inside] ** 2))),
        "shared_percent": 100 * shared / (noise + shared),
    }


def _rms(values: FloatArray) -> FloatArray:
    """Over the indenters."""
    return np.asarray(np.sqrt((values**2).mean(axis=0)))


def _rows(columns: dict[str, FloatArray]) -> dict[str, list[float | None]]:
    """By column, to five digits: a map needs no more."""
    return {name: rounded(values) for name, values in columns.items()}


def rounded(values: FloatArray, digits: int = 5) -> list[Any]:
    """Nested lists of numbers with so many significant digits; None where not finite."""
    array = np.asarray(values, dtype=float)
    if array.ndim > 1:
        return [rounded(row, digits) for row in array]
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in array]


def _place(columns: dict[str, FloatArray], index: int) -> dict[str, float]:
    return {name: float(values[index]) for name, values in columns.items()}


def _least(values: FloatArray) -> float | None:
    return float(np.nanmin(values)) if np.isfinite(values).any() else None


def _most(values: FloatArray) -> float | None:
    return float(np.nanmax(values)) if np.isfinite(values).any() else None
