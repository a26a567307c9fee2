"""Removal of readings that are wrong with more than 50 % probability."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.grouping import groups
from bayestouch.data.touches import Touches
from bayestouch.effects.effect import Values
from bayestouch.effects.noise import NoiseEffect

# Smallest number of samples whose median identifies a wrong one.
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


def from_prediction(touches: Touches, samples: FloatArray | None) -> FloatArray:
    """As `from_median`, of readings minus what a model predicts of each sample minus the mean of its touch, (n, m).

    A creep is no outlier. `samples` is `Predicted.samples`, None if a model predicts no change within a touch.
    """
    return from_median(touches if samples is None else touches.with_(readings=touches.readings - samples))


def without_wrong(
    touches: Touches,
    effect: NoiseEffect,
    values: Values,
    sd: FloatArray,
    peak: FloatArray,
    growth: FloatArray | float = 1.0,
) -> Touches:
    """The table without the readings that are probably wrong by a noise effect, see `NoiseEffect.wrong`.

    `growth` (n, m) is the factor by which readings change within a touch by other effects.
    """
    wrong = effect.wrong(from_median(touches.with_(readings=touches.readings / growth)), sd, peak, values)
    return touches if wrong is None else touches.with_(readings=np.where(wrong, np.nan, touches.readings))
