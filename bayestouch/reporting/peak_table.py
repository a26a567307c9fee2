"""Fit and noise in % of each element's peak: Tables 1 and 2 of the paper."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.data.sensor import Finger
from bayestouch.paper.published import TABLE_1, TABLE_2, number
from bayestouch.reporting.differences import three
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.paper_fits import PaperFits
from bayestouch.results.objects import Calibration

#: The paper's range of touches about an element, degree.
WINDOW_DEG = 50.0


def element_peak(calibration: Calibration) -> FloatArray:
    """Largest mean reading of each element among the calibration touches, (m,); NaN without readings."""
    observed = np.abs(calibration.rows.observed)
    peak = np.where(np.isnan(observed), -np.inf, observed).max(axis=0)
    return np.where(np.isfinite(peak) & (peak > 0), peak, np.nan)


def error_and_noise(calibration: Calibration, near: NDArray[np.bool_] | None = None) -> tuple[FloatArray, FloatArray]:
    """Rms error of the fit over the touches `near` (t, m), and noise of one reading: % of each element's peak, (m,)."""
    rows = calibration.rows
    residual = rows.observed - rows.predicted
    counted = np.isfinite(residual) & (True if near is None else near)
    square = np.where(counted, residual, 0.0) ** 2
    peak = element_peak(calibration)
    n = counted.sum(axis=0)
    rms = np.sqrt(np.divide(square.sum(axis=0), n, out=np.full(len(n), np.nan), where=n > 0))
    noise = np.where(calibration.noise.tactile_sd > 0, calibration.noise.tactile_sd, np.nan)
    return 100 * rms / peak, 100 * noise / peak


def pad_peaks(calibration: Calibration) -> dict[str, Any]:
    error, noise = error_and_noise(calibration)
    rows = [
        _row("error", "% of peak", joint=three(error)),
        _row("noise of one reading", "% of peak", joint=three(noise)),
    ]
    return {"rows": rows, "notes": []}


def _row(
    quantity: str,
    unit: str,
    *,
    joint: dict[str, Any] | None = None,
    single: dict[str, Any] | None = None,
    paper: dict[str, Any] | None = None,
) -> dict[str, Any]:
    empty = three([])
    return {
        "quantity": quantity,
        "unit": unit,
        "joint": joint or empty,
        "single": single or empty,
        "paper": paper or empty,
    }


def finger_peaks(evidence: Evidence, paper: PaperFits) -> dict[str, Any]:
    """The paper's Tables 1 and 2: this calibration, the paper's method on these data, and the paper's print."""
    calibration = evidence.calibration
    design = np.asarray(calibration.sensor.finger.element_angles_deg)
    off = (calibration.rows.location["theta_c"][:, None] - design + 180) % 360 - 180
    error_near, noise = error_and_noise(calibration, np.abs(off) <= WINDOW_DEG / 2)
    error_all, _ = error_and_noise(calibration)
    single = paper.element_summary()
    sigma, depth, error, level = (
        {"minimum": row.minimum, "average": row.average, "maximum": row.maximum} for row in TABLE_1
    )
    printed = TABLE_2[0]
    return {
        "rows": [
            _row(
                "Poisson's ratio σ",
                "",
                joint=three(calibration.posterior["sigma"].mean()),
                single=single["poisson_ratio"],
                paper=sigma,
            ),
            _row(
                "sensing radius r_s",
                "mm",
                joint=three(calibration.posterior["r_s"].mean(axis=(0, 1))),
                single=single["sensing_radius_mm"],
                paper=depth,
            ),
            _row(
                "error, touches within 25° of the element",
                "% of peak",
                joint=three(error_near),
                single=single["error_percent_peak"],
                paper=error,
            ),
            _row("error, all touches", "% of peak", joint=three(error_all)),
            _row(
                "noise of one reading",
                "% of peak",
                joint=three(noise),
                single=single["noise_percent_peak"],
                paper=level,
            ),
        ],
        "empirical": {
            **paper.empirical_summary(),
            "paper": {"minimum": printed.minimum, "average": printed.average, "maximum": printed.maximum},
        },
        "same_finger_as_paper": same_finger_as_paper(evidence),
        "notes": list(paper.notes),
    }


def same_finger_as_paper(evidence: Evidence) -> bool:
    """Whether core and outer radius are those of the paper's finger (Figure 7)."""
    body = evidence.sensor.body
    if not isinstance(body, Finger):
        return False
    built = (body.core_radius_mm, body.outer_radius_mm)
    return bool(np.allclose(built, (number("core_radius").value, number("outer_radius").value), rtol=1e-6))
