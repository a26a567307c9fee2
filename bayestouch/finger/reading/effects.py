"""Effects on the readings of touches that are inferred: readings, and their covariance due to the effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.recording import Recording
from bayestouch.contact.hertz import indenter_radius
from bayestouch.effects.effect import Effect, Values
from bayestouch.effects.readout import LEAST
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.empirical.spread import map_derivatives, own_covariance
from bayestouch.finger.model import FingerModel
from bayestouch.finger.reading.covariance import root_of, spread_of
from bayestouch.finger.reading.reader import TouchContext
from bayestouch.finger.reading.signal_noise import SignalNoise
from bayestouch.finger.reading.true_load import TrueLoads, recorded_touches
from bayestouch.model.observations import Observations, UntimedTouches

# Number of steps from readings to signals: an effect changes a reading by some ten percent, and each step is ten times
# as near.
SIGNAL_STEPS = 4


@dataclass(frozen=True, eq=False)
class EffectContext:
    """Effects on the readings of t touches. A `TouchContext`.

    Readings are ``scale * static + shift``: *static* effects are equal in all samples and act on the signal; effects
    that depend on time (creep, memory, drifts) multiply and add. An empirical correction is added after all effects, as
    in its fit.

    Attributes
    ----------
    effects_chain : ChainWithEffects
        The finger with its effects.
    scale, shift : (t, m) arrays
        Factor and addition of the effects that depend on time.
    extra : (t, m, m) array
        Covariance of the readings due to the uncertainty of drifts, and due to touches that may be missing.
    counts : (t, m) array
        Number of raw readings in each mean; 0 where missing.
    slopes : (q, 2, t, m) array
        Derivative of `scale` and `shift` over the values of the effects that depend on time.
    exact : bool
        Whether the calibration counts as exact.
    time_s : (t,) array
        Time of each touch on the clock of the calibration; infinite after its end.
    loads : TrueLoads or None
        Measured loads corrected for effects of the rig; None if there is no such effect.
    """

    effects_chain: ChainWithEffects
    scale: FloatArray
    shift: FloatArray
    extra: FloatArray
    counts: FloatArray
    slopes: FloatArray
    exact: bool
    time_s: FloatArray
    loads: TrueLoads | None = None

    def select(self, index: IntArray) -> EffectContext:
        """Some of the touches."""
        return replace(
            self,
            scale=self.scale[index],
            shift=self.shift[index],
            extra=self.extra[index],
            counts=self.counts[index],
            slopes=self.slopes[:, :, index],
            time_s=self.time_s[index],
            loads=None if self.loads is None else self.loads.select(index),
        )

    def joined(self, parts: Sequence[TouchContext]) -> EffectContext:
        """The effects on the touches of several contexts together; this context is one of `parts`."""
        contexts = [part for part in parts if isinstance(part, EffectContext)]
        return replace(
            self,
            scale=np.concatenate([part.scale for part in contexts]),
            shift=np.concatenate([part.shift for part in contexts]),
            extra=np.concatenate([part.extra for part in contexts]),
            counts=np.concatenate([part.counts for part in contexts]),
            slopes=np.concatenate([part.slopes for part in contexts], axis=2),
            time_s=np.concatenate([part.time_s for part in contexts]),
            loads=None if self.loads is None else self.loads.joined([p.loads for p in contexts if p.loads is not None]),
        )

    def with_loads(self, loads: TrueLoads, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> EffectContext:
        """The context with corrected loads, whose errors are correlated with readings at R (mm), θ_c (rad), P (N/m)."""
        if self.exact:
            return replace(self, loads=loads)
        along = loads.along(self._root, self._spread(self._signal(radius_mm, angle, load), radius_mm, angle, load))
        return replace(self, loads=loads.with_gain(along))

    def without_loads(self) -> EffectContext:
        """The context with errors of corrected loads that are independent of the predicted readings."""
        return replace(self, loads=None)

    def inexact(self) -> EffectContext:
        """The context with the uncertainty of the calibration, also where the calibration counts as exact."""
        return replace(self, exact=False)

    def readings(
        self, signal: NDArray[np.floating], radius_mm: FloatArray, angle: FloatArray, load: FloatArray, touch: IntArray
    ) -> NDArray[np.floating]:
        """Readings (n, m) from signals (n, m) before the effects, for R (mm), θ_c (rad) and P (N/m), all (n,)."""
        out = signal
        if self._pointwise:
            model = self.effects_chain.model
            tip = indenter_radius(radius_mm, model.finger.outer_radius_mm)
            recording = recorded_touches(model, self.time_s[touch], np.degrees(angle), load, signal, tip)
            out = recording.signal
            for effect, values in self._pointwise:
                if out is not recording.signal:
                    recording = replace(recording, signal=out)
                out = effect.signal(recording, values)
        scaled = out * self.scale[touch] + self.shift[touch]
        if self.effects_chain.correction_table is not None:
            scaled = scaled + self.effects_chain.correction_table.readings(radius_mm, angle, load)
        if self.loads is not None:
            scaled = scaled + self.loads.readings(load, touch)
        return np.asarray(scaled, dtype=signal.dtype)

    def covariance(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Covariance (t, m, m) of the mean readings without each element's own noise, at R (mm), θ_c (rad), P (N/m).

        It is to first order in the joint posterior of the parameters of chain, effects and correction; if effects
        correct the measured load, it is conditional on this load.
        """
        signal = self._signal(radius_mm, angle, load)
        total = self.extra + self.effects_chain.listed.noise.covariance(
            signal, self.effects_chain.model.peak, self.counts
        )
        if self.exact:
            return total
        spread = self._spread(signal, radius_mm, angle, load)
        total = total + np.einsum("ktm,ktn->tmn", spread, spread, optimize=True)
        identified, model = self.effects_chain.identified, self._at(radius_mm, angle, load)
        if identified is not None:
            total += own_covariance(identified, model, self._leaving(model), self._static_vector, self.scale)
        if self.effects_chain.correction_table is not None:
            total = total + self.effects_chain.correction_table.covariance_at(radius_mm, angle, load)
        if self.loads is not None:
            along = self.loads.along(self._root, spread)
            total = total - along[:, :, None] * along[:, None]
        return np.asarray(total)

    def noise_of_signal(self, signal: FloatArray, covariance: FloatArray) -> SignalNoise | None:
        """Noise that depends on the signal; None without an effect that adds it. See `TouchContext`."""
        added = self.effects_chain.listed.noise
        if not added.share:
            return None
        return SignalNoise.of(added, self.effects_chain.model.peak, self.counts, signal, covariance)

    def added_variance(self, signal: FloatArray) -> FloatArray:
        """Variance (t, m) that noise effects add to the mean readings, for predicted readings (t, m)."""
        return self.effects_chain.listed.noise.mean_variance(signal, self.effects_chain.model.peak, self.counts)

    def columns(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Covariance of the readings with the parameters of the calibration, for a table over touches.

        Returns
        -------
        (t, m + q, m) array
            Covariance (m, m) of the readings due to the calibration alone, then the covariance of each of the q values
            of the effects with the readings.
        """
        model = self._at(radius_mm, angle, load)
        signal = model.readings(self._leaving(model), self._static_vector).touches
        spread = self._spread(signal, radius_mm, angle, load)
        own = np.einsum("ktm,ktn->tmn", spread, spread, optimize=True)
        if self.effects_chain.identified is not None:
            own += own_covariance(
                self.effects_chain.identified, model, self._leaving(model), self._static_vector, self.scale
            )
        if self.effects_chain.correction_table is not None:
            own += self.effects_chain.correction_table.covariance_at(radius_mm, angle, load)
        values = np.einsum("qk,ktm->tqm", self._root[self.effects_chain.model.n_base :], spread)
        return np.concatenate([own, values], axis=1)

    def _signal(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Signals (t, m) after the effects that are equal in all samples."""
        model = self._at(radius_mm, angle, load)
        return model.readings(self._leaving(model), self._static_vector).touches

    def _leaving(self, model: FingerModel) -> Recording:
        """Touches with the signals before the effects on the signal."""
        identified = self.effects_chain.identified
        if identified is None:
            return model.signal(self._static_vector)
        assert model.pose is not None
        return replace(model.poses(self._static_vector), signal=identified.chain.series(*model.pose))

    def _spread(self, signal: FloatArray, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Change of the readings for each column of `_root`, (d, t, m)."""
        identified, model = self.effects_chain.identified, self._at(radius_mm, angle, load)
        vector, rows = self._static_vector, self._static_rows
        if identified is None:
            jacobian = np.zeros((len(self.effects_chain.vector), *signal.shape))
            jacobian[rows] = model.derivatives(vector)[0] * self.scale
        else:
            jacobian = map_derivatives(identified, model, self._leaving(model), vector, rows) * self.scale
        for row, (factor, addition) in zip(self._timed_rows, self.slopes, strict=True):
            jacobian[row] += factor * signal + addition
        if self.effects_chain.correction_table is not None:
            jacobian += self.effects_chain.correction_table.by_parameter(radius_mm, angle, load)
        return spread_of(jacobian, self._root)

    def _at(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FingerModel:
        return self._static.observing(UntimedTouches(len(load), self.time_s)).at(radius_mm, angle, load)

    @cached_property
    def _root(self) -> FloatArray:
        return root_of(self.effects_chain.covariance)

    @cached_property
    def _static_vector(self) -> FloatArray:
        return self.effects_chain.vector[self._static_rows]

    @cached_property
    def _pointwise(self) -> list[tuple[Effect, Values]]:
        return static_signal_effects(self.effects_chain)

    @cached_property
    def _static(self) -> FingerModel:
        return self.effects_chain.static()

    @cached_property
    def _static_rows(self) -> IntArray:
        return np.setdiff1d(np.arange(len(self.effects_chain.vector)), self._timed_rows)

    @cached_property
    def _timed_rows(self) -> IntArray:
        return timed_rows(self.effects_chain)


def static_signal_effects(effects_chain: ChainWithEffects) -> list[tuple[Effect, Values]]:
    """Effects on the signal that are equal in all samples, with their values, in the order in which they act."""
    pairs = [
        (effect, effects_chain.values[effect.name])
        for effect in effects_chain.model.effects
        if not effect.needs_samples and type(effect).signal is not Effect.signal
    ]
    return sorted(pairs, key=lambda pair: pair[0].order)


def timed_rows(effects_chain: ChainWithEffects) -> IntArray:
    """Indices in the vector of the values of effects that depend on time."""
    model = effects_chain.model
    timed = [np.r_[at] for effect, at in zip(model.effects, model.value_places, strict=True) if effect.needs_samples]
    return np.concatenate([np.zeros(0, dtype=np.int64), *timed])


def timed_samples(
    effects_chain: ChainWithEffects, observed: Observations, vector: FloatArray, signal: FloatArray
) -> FloatArray:
    """Factor and addition of the effects that depend on time, in each sample of touches with these signals (t, m).

    Returns
    -------
    (2, n, m) array
        The factor is that at `signal`: not all effects are in proportion to the signal.
    """
    timed = tuple(each for each in effects_chain.model.effects if each.needs_samples)
    model = replace(effects_chain.model, observed=observed, effects=timed)
    t, rows = observed.n_touches, timed_rows(effects_chain)
    own = np.concatenate([vector[: model.n_base], vector[rows]])
    model = model.at(np.zeros(t), np.zeros(t), np.ones(t))
    blank = model.poses(own)
    at, zero = (
        model.through(model.rows(replace(blank, signal=each)), own) for each in (signal, np.zeros(signal.shape))
    )
    return np.stack([(at - zero) / model.rows(replace(blank, signal=signal)).signal, zero])


def timed_scale_and_shift(
    effects_chain: ChainWithEffects, observed: Observations, vector: FloatArray, signal: FloatArray
) -> FloatArray:
    """Mean factor and addition of the effects that depend on time, (2, t, m), at signals (t, m)."""
    if not len(timed_rows(effects_chain)):
        return np.stack([np.ones(signal.shape), np.zeros(signal.shape)])
    return np.stack([observed.of_touches(each) for each in timed_samples(effects_chain, observed, vector, signal)])


def timed_signal(effects_chain: ChainWithEffects, observed: Observations) -> FloatArray:
    """Signals (t, m) at which the effects that depend on time are evaluated: ones, if they are in proportion to it.

    Else those that the readings show, without the effects; an element without a reading has a small signal.
    """
    vector, one = effects_chain.vector, np.ones((observed.n_touches, effects_chain.model.n_elements))
    if not len(timed_rows(effects_chain)):
        return one
    once, twice = (timed_scale_and_shift(effects_chain, observed, vector, size * one)[0] for size in (1.0, 2.0))
    if np.allclose(once, twice, rtol=1e-9, atol=0):
        return one
    read = np.nan_to_num(observed.means.readings)
    scale_and_shift = partial(timed_scale_and_shift, effects_chain, observed, vector)
    return signal_behind(read, effects_chain.model.peak, scale_and_shift)


def signal_behind(
    read: FloatArray, peak: FloatArray, scale_and_shift: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Signals of at least `LEAST` peaks (m,) behind readings of any shape (..., m), by their factor and addition."""

    def of_some_size(signal: FloatArray) -> FloatArray:
        return np.copysign(np.maximum(np.abs(signal), LEAST * peak), signal)

    signal = of_some_size(read)
    for _ in range(SIGNAL_STEPS):
        scale, shift = scale_and_shift(signal)
        signal = of_some_size((read - shift) / scale)
    return signal


def timed_slopes(effects_chain: ChainWithEffects, observed: Observations, signal: FloatArray) -> FloatArray:
    """Derivative of `timed_scale_and_shift` over the values of these effects, (q, 2, t, m)."""
    out = []
    for row in timed_rows(effects_chain):
        step = 0.01 * max(float(np.sqrt(effects_chain.covariance[row, row])), 1e-9)
        up, down = effects_chain.vector.copy(), effects_chain.vector.copy()
        up[row] += step
        down[row] -= step
        high, low = (timed_scale_and_shift(effects_chain, observed, v, signal) for v in (up, down))
        out.append((high - low) / (2 * step))
    return np.array(out).reshape(-1, 2, observed.n_touches, effects_chain.model.n_elements)
