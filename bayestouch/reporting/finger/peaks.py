"""Error of the fit and noise in % of each element's peak: Tables 1 and 2 of the paper."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.data.arrays import turned
from bayestouch.data.sensor import Finger, finger_of
from bayestouch.paper.published import TABLE_1, TABLE_2, number
from bayestouch.reporting.differences import three
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.finger.paper_fits import PaperFits
from bayestouch.reporting.peak_table import error_and_noise, peak_row

#: Range of touches about an element that the paper uses, degree.
WINDOW_DEG = 50.0


def element_peaks(evidence: Evidence, paper: PaperFits) -> dict[str, Any]:
    """Tables 1 and 2 of the paper: from this calibration, by the paper's method on these data, and as printed."""
    calibration = evidence.calibration
    finger = finger_of(calibration.sensor)
    design = np.asarray(finger.element_angles_deg)
    off = turned(calibration.rows.location["theta_c"][:, None] - design)
    error_near, noise = error_and_noise(calibration, np.abs(off) <= WINDOW_DEG / 2)
    error_all, _ = error_and_noise(calibration)
    single = paper.element_summary()
    sigma, depth, error, level = (
        {"minimum": row.minimum, "average": row.average, "maximum": row.maximum} for row in TABLE_1
    )
    printed = TABLE_2[0]
    return {
        "rows": [
            peak_row(
                "Poisson's ratio σ",
                "",
                joint=three(calibration.posterior["sigma"].mean()),
                single=single["poisson_ratio"],
                paper=sigma,
            ),
            peak_row(
                "sensing radius r_s",
                "mm",
                joint=three(calibration.posterior["r_s"].mean(axis=(0, 1))),
                single=single["sensing_radius_mm"],
                paper=depth,
            ),
            peak_row(
                "error, touches within 25° of the element",
                "% of peak",
                joint=three(error_near),
                single=single["error_percent_peak"],
                paper=error,
            ),
            peak_row("error, all touches", "% of peak", joint=three(error_all)),
            peak_row(
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
        "same_finger_as_paper": same_finger_as_paper(finger),
        "notes": list(paper.notes),
    }


def same_finger_as_paper(finger: Finger) -> bool:
    """True if core and outer radius are those of the paper's finger (Figure 7)."""
    built = (finger.core_radius_mm, finger.outer_radius_mm)
    return bool(np.allclose(built, (number("core_radius").value, number("outer_radius").value), rtol=1e-6))
