"""Error of the fit and noise in % of each element's peak."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.reporting.differences import three
from bayestouch.results.objects import Calibration


def element_peak(calibration: Calibration) -> FloatArray:
    """Largest absolute mean reading of each element in the calibration touches, (m,); NaN without readings.

    The fitted offset of a pad is no part of it: readings of a finger have none.
    """
    observed = np.abs(calibration.rows.observed - calibration.mode.get("offset", 0.0))
    peak = np.where(np.isnan(observed), -np.inf, observed).max(axis=0)
    return np.where(np.isfinite(peak) & (peak > 0), peak, np.nan)


def error_and_noise(calibration: Calibration, near: NDArray[np.bool_] | None = None) -> tuple[FloatArray, FloatArray]:
    """Rms error of the fit over the touches `near` (t, m), and noise of a reading, % of each element's peak, (m,)."""
    rows = calibration.rows
    residual = rows.observed - rows.predicted
    counted = np.isfinite(residual) & (True if near is None else near)
    square = np.where(counted, residual, 0.0) ** 2
    peak = element_peak(calibration)
    n = counted.sum(axis=0)
    rms = np.sqrt(np.divide(square.sum(axis=0), n, out=np.full(len(n), np.nan), where=n > 0))
    noise = np.where(calibration.noise.tactile_sd > 0, calibration.noise.tactile_sd, np.nan)
    return 100 * rms / peak, 100 * noise / peak


def peak_row(
    quantity: str,
    unit: str,
    *,
    joint: dict[str, Any] | None = None,
    single: dict[str, Any] | None = None,
    paper: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """Row of the table: minimum, mean and maximum over the elements, for the joint posterior, for fits element by
    element, and as printed in the paper; a part without data is empty."""
    empty = three([])
    return {
        "quantity": quantity,
        "unit": unit,
        "joint": joint or empty,
        "single": single or empty,
        "paper": paper or empty,
    }
