"""Where a sensor reads well and where not, predicted from its calibration before any touch is read."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.reporting.evidence import Evidence

#: Beginning of the caption of such a figure.
PREDICTED = "Predicted from the calibration alone, before any touch is read: small values are sweet spots. "


def typical_samples(evidence: Evidence) -> int:
    """Raw readings behind a typical touch."""
    counts = evidence.posteriors.rows.counts
    return int(max(np.median(counts[counts > 0]), 1)) if (counts > 0).any() else 1


def rounded_columns(columns: dict[str, FloatArray]) -> dict[str, list[float | None]]:
    """By column, to five digits: a map needs no more."""
    return {name: rounded(values) for name, values in columns.items()}


def rounded(values: FloatArray, digits: int = 5) -> list[Any]:
    """Nested lists of numbers with so many significant digits; None where not finite."""
    array = np.asarray(values, dtype=float)
    if array.ndim > 1:
        return [rounded(row, digits) for row in array]
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in array]


def place_at(columns: dict[str, FloatArray], index: int) -> dict[str, float]:
    """Every column at one place."""
    return {name: float(values[index]) for name, values in columns.items()}
