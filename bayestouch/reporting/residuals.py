"""Residuals of the inferred touches."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.reporting.evidence import Evidence
from bayestouch.results.data import TouchRows


def standardised(rows: TouchRows) -> FloatArray:
    """Reading minus prediction divided by its standard deviation, (t, m); NaN where missing."""
    with np.errstate(invalid="ignore", divide="ignore"):
        z = (rows.observed - rows.predicted) / rows.sd
    return np.where(np.isfinite(z), z, np.nan)


def about_residuals(evidence: Evidence, prediction: dict[str, Any] | None) -> dict[str, Any]:
    """Standardised residuals by element at the posterior mean, and the errors `prediction` at the references."""
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
        "prediction": prediction,
    }
