"""Readings of calibration touches of a finger with effects, for many parameter vectors at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.effects.effect import Effect
from bayestouch.finger.local_series import local_series
from bayestouch.finger.local_signals import local_signals
from bayestouch.finger.model import FingerModel
from bayestouch.finger.strain_series import StrainSeries
from bayestouch.model.base import LOAD_STEP


@dataclass(frozen=True, eq=False)
class EffectReadings:
    """Readings with effects; n vectors, t touches, N samples, m elements.

    Attributes
    ----------
    touches : (n, t, m) array
        Mean reading of each touch.
    by_load : (n, t, m) array
        Its derivative over the load as read.
    samples : (n, N, m) array or None
        Sample minus mean of its touch; None if no effect acts within touches.
    """

    touches: FloatArray
    by_load: FloatArray
    samples: FloatArray | None


@dataclass(frozen=True, eq=False)
class EffectPrediction:
    """Readings of many vectors: signals by polynomials near the fit, then the exact effects on the signals.

    Attributes
    ----------
    model : FingerModel
        The finger with its effects.
    signals : callable
        From vectors (n, d) to signals (n, t, m) that leave the body, and their derivative over the load as read.
    within : callable
        From vectors to a mask (n,) of those for which `signals` is valid.
    """

    model: FingerModel
    signals: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    within: Callable[[FloatArray], NDArray[np.bool_]]

    @classmethod
    def of(cls, model: FingerModel, centre: FloatArray, sd: FloatArray, noise_sd: FloatArray) -> EffectPrediction:
        """Prediction near a vector (d,) with standard deviations (d,).

        `noise_sd` (t, m) is the standard deviation of the mean readings; inf where missing.
        """
        base = slice(0, model.n_base)
        series = model.evaluator
        moving = [e for e in model.effects if e.changes_finger or e.changes_pose]
        if series is not None and all(e.changes_strain for e in moving) and series.covers(centre[None])[0]:
            near = StrainSeries(model, series) if moving else local_series(series, centre[base], sd[base], noise_sd)
            return cls(model, near, series.covers)
        signals = local_signals(model, centre, sd, noise_sd)
        _, _, low, high = model.prior()

        def within(vectors: FloatArray) -> NDArray[np.bool_]:
            inside = (vectors[:, base] > low[base]) & (vectors[:, base] < high[base])
            return np.asarray(inside.all(axis=1))

        return cls(model, signals, within)

    def __call__(self, vectors: FloatArray) -> EffectReadings:
        """Readings at vectors (n, d)."""
        signal, slope = self.signals(vectors)
        if not any(type(effect).signal is not Effect.signal for effect in self.model.effects):
            return EffectReadings(signal, slope, None)
        touches, by_load = np.empty_like(signal), np.empty_like(slope)
        samples: list[FloatArray] = []
        for i, vector in enumerate(vectors):
            touches[i], by_load[i], within = self._through(vector, signal[i], slope[i])
            samples += [] if within is None else [within]
        return EffectReadings(touches, by_load, np.stack(samples) if samples else None)

    def _through(
        self, vector: FloatArray, signal: FloatArray, slope: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray | None]:
        """Readings of one vector from its signals, and their derivative over the load."""
        model, step = self.model, LOAD_STEP * self.model.load
        here = replace(model.poses(vector), signal=signal)
        up = replace(model.poses(vector, model.load + step), signal=signal + step[:, None] * slope)
        readings = model.readings(here, vector)
        more = model.readings(up, vector).touches
        return readings.touches, (more - readings.touches) / step[:, None], readings.samples
