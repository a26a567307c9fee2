"""Readings that are more likely wrong than not."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.data.grouping import groups
from bayestouch.data.touches import Touches
from bayestouch.effects.effect import Values

# A median needs so many samples to tell the one that is off.
LEAST_SAMPLES = 3


def from_median(touches: Touches) -> FloatArray:
    """Reading minus median of its touch, (n, m); NaN where it is missing or the touch has too few samples."""
    rows = np.flatnonzero(touches.in_contact)
    _, group = groups(touches.touch[rows])
    out = np.full(touches.readings.shape, np.nan)
    order = np.argsort(group, kind="stable")
    ends = np.flatnonzero(np.diff(group[order])) + 1
    for part in np.split(rows[order], ends):
        values = touches.readings[part]
        enough = (~np.isnan(values)).sum(axis=0) >= LEAST_SAMPLES
        if enough.any():
            out[np.ix_(part, enough)] = values[:, enough] - np.nanmedian(values[:, enough], axis=0)
    return out


def wrong_readings(deviation: FloatArray, sd: FloatArray, peak: FloatArray, values: Values) -> BoolArray:
    """Which deviations from the median (n, m) are more likely wrong readings than noise.

    Parameters
    ----------
    deviation : (n, m) array
        From the median of the touch; NaN tells nothing.
    sd : (m,) array
        Noise of a reading that is not wrong.
    peak : (m,) array
        Size of the peak reading.
    values : (float, float)
        Share of wrong readings, and the sd of their errors over the peak.
    """
    probability, size = values
    wide = sd**2 + (size * peak) ** 2
    with np.errstate(invalid="ignore"):
        usual = np.log1p(-probability) - 0.5 * (deviation**2 / sd**2 + np.log(sd**2))
        wrong = np.log(max(probability, 1e-300)) - 0.5 * (deviation**2 / wide + np.log(wide))
        return np.asarray(~np.isnan(deviation) & (wrong > usual))


def without_wrong(touches: Touches, sd: FloatArray, peak: FloatArray, values: Values) -> Touches:
    """The table without readings that are more likely wrong than not."""
    wrong = wrong_readings(from_median(touches), sd, peak, values)
    return touches.with_(readings=np.where(wrong, np.nan, touches.readings))
