"""What the model leaves unexplained in the touches that were read."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.reporting.differences import reference_composite_radius, three
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.peak_table import element_peak
from bayestouch.results.data import TouchRows


def standardised(rows: TouchRows) -> FloatArray:
    """Reading minus prediction over its standard deviation, (t, m); NaN where missing."""
    with np.errstate(invalid="ignore", divide="ignore"):
        z = (rows.observed - rows.predicted) / rows.sd
    return np.where(np.isfinite(z), z, np.nan)


def about_residuals(evidence: Evidence) -> dict[str, Any]:
    """Standardised residuals by element at the posterior mean, and errors of prediction at the references."""
    z = standardised(evidence.posteriors.rows)
    present = np.isfinite(z)
    n = present.sum(axis=0)
    some = n > 0
    filled = np.where(present, z, 0.0)
    rms = np.sqrt(np.divide((filled**2).sum(axis=0), n, out=np.full(len(n), np.nan), where=some))
    mean = np.divide(filled.sum(axis=0), n, out=np.full(len(n), np.nan), where=some)
    total = int(present.sum())
    return {
        "readings": total,
        "rms": float(np.sqrt((filled**2).sum() / total)) if total else None,
        "beyond_3_percent": float(100 * (np.abs(filled) > 3).sum() / total) if total else None,
        "by_element": [
            {"element": f"e{e + 1:02d}", "rms": float(rms[e]), "mean": float(mean[e])} for e in range(len(n))
        ],
        "prediction": _prediction(evidence) if evidence.is_finger else None,
    }


def _prediction(evidence: Evidence) -> dict[str, Any] | None:
    """Rms of reading minus prediction, the touch taken at its reference, in % of each element's peak.

    None where no touch has a known radius, location and load.
    """
    from bayestouch.finger.calibration import finger_chain

    rows = evidence.posteriors.rows
    chain = finger_chain(evidence.calibration)
    radius = reference_composite_radius(rows.radius_mm, chain.outer_radius_mm)
    angle = rows.location["theta_c"]
    known = np.isfinite(radius) & np.isfinite(angle) & np.isfinite(rows.load)
    if not known.any():
        return None
    predicted = chain.predict(radius[known], np.radians(angle[known]), rows.load[known])
    difference = rows.observed[known] - predicted
    present = np.isfinite(difference)
    n = np.maximum(present.sum(axis=0), 1)
    rms = np.sqrt((np.where(present, difference, 0.0) ** 2).sum(axis=0) / n)
    percent = np.where(present.any(axis=0), 100 * rms / element_peak(evidence.calibration), np.nan)
    return {"touches": int(known.sum()), "percent_peak": three(percent)}
