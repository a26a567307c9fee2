"""Error of the fit and noise in % of each element's peak."""

from __future__ import annotations

from typing import Any

from bayestouch.reporting.differences import three
from bayestouch.reporting.peak_table import error_and_noise, peak_row
from bayestouch.results.objects import Calibration


def element_peaks(calibration: Calibration) -> dict[str, Any]:
    """Minimum, mean and maximum over the elements; each reading is predicted by a fit without it."""
    error, noise = error_and_noise(calibration)
    rows = [
        peak_row("error", "% of peak", joint=three(error)),
        peak_row("noise of one reading", "% of peak", joint=three(noise)),
    ]
    return {"rows": rows, "notes": []}
