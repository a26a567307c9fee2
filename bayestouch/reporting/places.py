"""Common parts of the maps of expected errors, which are predicted from a calibration before any touch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.reporting.evidence import Evidence

#: Beginning of the captions of these figures.
PREDICTED = "Predicted from the calibration alone, before any touch is read: small values are sweet spots. "


def typical_samples(evidence: Evidence) -> int:
    """Median number of raw reads in a touch."""
    return _median(evidence.posteriors.rows.samples)


def typical_reads(evidence: Evidence) -> int:
    """Median number of raw reads with the noise of a mean reading, with that of a rest reading of the touch's own."""
    return _median(evidence.posteriors.rows.counts)


def typical_load_reads(evidence: Evidence) -> int:
    """Median number of reads of the force sensor in a touch with a measured load."""
    rows = evidence.posteriors.rows
    return _median(rows.load_reads[np.isfinite(rows.load)])


def load_is_read(evidence: Evidence) -> bool:
    """Whether a typical touch has a measured load."""
    measured = np.isfinite(evidence.posteriors.rows.load)
    return bool(len(measured) and measured.mean() >= 0.5)


def _median(reads: FloatArray) -> int:
    """Median of the numbers above zero as a whole number, at least 1."""
    return int(max(np.median(reads[reads > 0]), 1)) if (reads > 0).any() else 1


def rounded_columns(
    columns: Mapping[str, FloatArray], steps: Mapping[str, float] | None = None
) -> dict[str, list[float | None]]:
    """Columns rounded to five digits, enough for a map; coordinates to a hundredth of their steps, by name."""
    return {name: rounded(values, step=(steps or {}).get(name, np.nan)) for name, values in columns.items()}


def rounded(values: FloatArray, digits: int = 5, *, step: ArrayLike = np.nan) -> list[Any]:
    """Nested lists of numbers with this many significant digits; None for numbers that are not finite.

    A number has more digits where its rounding would be above a hundredth of `step`, the difference that matters, of
    all numbers or of each: coordinates may be far from their zero.
    """
    array, steps = np.broadcast_arrays(np.asarray(values, dtype=float), np.asarray(step, dtype=float))
    if array.ndim > 1:
        return [rounded(row, digits, step=of_row) for row, of_row in zip(array, steps, strict=True)]
    with np.errstate(divide="ignore", invalid="ignore"):
        needed = np.nan_to_num(np.ceil(np.log10(500 * np.abs(array) / steps)), nan=digits)
    # 17 digits are those of a float
    counts = np.clip(needed, digits, 17).astype(int)
    return [
        float(f"{value:.{count}g}") if np.isfinite(value) else None for value, count in zip(array, counts, strict=True)
    ]


def place_at(columns: dict[str, FloatArray], index: int) -> dict[str, float]:
    """Values of all columns at one place."""
    return {name: float(values[index]) for name, values in columns.items()}
