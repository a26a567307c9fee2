"""Removal of readings that are wrong with more than 50 % probability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.grouping import groups
from bayestouch.data.touches import Touches
from bayestouch.effects.effect import Values
from bayestouch.effects.noise import NoiseEffect
from bayestouch.model.noise import AddedNoise

# Smallest number of samples whose median identifies a wrong one.
LEAST_SAMPLES = 3


@dataclass(frozen=True, eq=False)
class RightReadings:
    """Noise of readings that are not wrong; m elements.

    Attributes
    ----------
    sd : (m,) array
        Sd of each element's own noise in one reading.
    peak : (m,) array
        Peak readings.
    added : AddedNoise
        What effects of the noise add.
    """

    sd: FloatArray
    peak: FloatArray
    added: AddedNoise

    def added_variance(self, signal: FloatArray, element: IntArray | slice = slice(None)) -> FloatArray:
        """Variance that effects add to the scatter of readings with a signal within a touch, shape of `signal`.

        The last axis of `signal` is that of the elements, or of groups whose elements are `element` (g,). An error that
        is the same in all samples of a touch does not scatter.
        """
        shared = (self.added.common * self.added.together(self.peak)) ** 2
        return np.asarray(self.added.variance(signal, self.peak[element]) + shared[element])

    def sd_at(self, signal: FloatArray) -> FloatArray:
        """Sd of readings with a signal (n, m): the same shape, or (m,) if effects add nothing."""
        return np.sqrt(self.sd**2 + self.added_variance(signal)) if self.added.adds else self.sd


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
    right: RightReadings,
    growth: FloatArray | float = 1.0,
) -> Touches:
    """The table without the readings that are probably wrong by a noise effect, see `NoiseEffect.wrong`.

    `growth` (n, m) is the factor by which readings change within a touch by other effects. The noise is that at the
    median of the touch, which hardly goes with wrong readings: a large deviation where noise is large is not wrong.
    """
    readings = touches.readings / growth
    deviation = from_median(touches.with_(readings=readings))
    wrong = effect.wrong(deviation, right.sd_at(readings - deviation), right.peak, values)
    return touches if wrong is None else touches.with_(readings=np.where(wrong, np.nan, touches.readings))
