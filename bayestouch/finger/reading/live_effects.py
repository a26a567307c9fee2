"""Effects on the touches of a stream on a finger: their context is built sample by sample."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.missing import REMEMBERED, ends_before
from bayestouch.chain.recording import History, Recording
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.reading.drift import LOOSE, TouchEvidence
from bayestouch.finger.reading.effects import EffectContext, signal_behind, timed_rows
from bayestouch.finger.reading.live_density import Expansion, OneTouch
from bayestouch.finger.reading.live_drift import DriftFilter
from bayestouch.finger.reading.true_load import TrueLoads, changes_load, true_loads
from bayestouch.reading.live import HeldTouch, require_seconds


def blank_context(effects_chain: ChainWithEffects, n_touches: int, *, exact: bool) -> EffectContext:
    """Context of touches after the calibration, without the effects that differ between the samples of a touch."""
    m, q = effects_chain.model.n_elements, len(timed_rows(effects_chain))
    t = n_touches
    return EffectContext(
        effects_chain=effects_chain,
        scale=np.ones((t, m)),
        shift=np.zeros((t, m)),
        extra=np.zeros((t, m, m)),
        counts=np.ones((t, m)),
        slopes=np.zeros((q, 2, t, m)),
        exact=exact,
        time_s=np.full(t, np.inf),
    )


def bends(effects_chain: ChainWithEffects) -> bool:
    """Whether an effect that is equal in all samples keeps readings of the same κ from being in proportion to the load.

    A curvature of the surface does, too: κ then is not that of a round finger.
    """
    if effects_chain.model.chain(effects_chain.vector).surface is not None:
        return True
    context, model = blank_context(replace(effects_chain, correction_table=None), 1, exact=True), effects_chain.model

    def readings(size: float) -> FloatArray:
        radius, load = 0.2 * model.finger.outer_radius_mm / size, size * model.reference_load
        at = [np.array([each]) for each in (radius, 0.0, load)]
        return np.asarray(context.readings(size * model.peak[None], at[0], at[1], at[2], np.zeros(1, dtype=np.int64)))

    return not np.allclose(readings(1.0), 2 * readings(0.5), rtol=1e-6, atol=0)


@dataclass(frozen=True, eq=False)
class Found:
    """Last posterior of the present touch of a stream, for the estimate of drifts.

    Attributes
    ----------
    one, found
        Density of the touch, and the expansion at its mode.
    shift : (m,) array
        Drift that was assumed.
    covariance : (m, m) array
        Covariance of the readings without drifts and without each element's own noise.
    variance : (m,) array
        Each element's own noise; infinite where missing.
    columns : (m, s) array
        From `DriftFilter.columns`.
    """

    one: OneTouch
    found: Expansion
    shift: FloatArray
    covariance: FloatArray
    variance: FloatArray
    columns: FloatArray


class FingerStream:
    """Effects along a stream of touches on a finger. A `bayestouch.reading.live.LiveStream`.

    Parameters
    ----------
    effects_chain : ChainWithEffects
        The finger with its effects.
    exact : bool
        Whether the calibration counts as exact.
    """

    _weight: float
    _times: float
    _total: FloatArray
    _counts: FloatArray
    _sums: FloatArray
    _sums_read: FloatArray
    _history: History | None
    _missing_s: FloatArray = np.zeros(0)

    def __init__(self, effects_chain: ChainWithEffects, *, exact: bool) -> None:
        chain = effects_chain
        self.effects_chain, self.exact = chain, exact
        self.rows = timed_rows(chain)
        self._timed = replace(chain.model, effects=tuple(e for e in chain.model.effects if e.needs_samples))
        drifts = [(drift, chain.values[drift.name]) for drift in chain.listed.drifts]
        self.drifts = DriftFilter.of(drifts, chain.model.n_elements) if drifts else None
        self.needs_time = bool(len(self.rows) or drifts)
        if self.needs_time:
            require_seconds(chain.listed.setting.time_unit)
        self.corrects_load = changes_load(chain)
        self.found: Found | None = None
        self._earlier: list[tuple[float, FloatArray]] = []
        self._blank = blank_context(chain, 1, exact=exact)
        self._vectors = self._moved_vectors()
        self._start()
        self._in_time_bends = len(self.rows) > 0 and self._bends_in_time()

    def begin(self, time_s: float) -> None:
        """Begin a touch at this time, s."""
        self._start()
        self._began = time_s
        self._history = None
        if self._earlier:
            end, readings = (np.array(each) for each in zip(*self._earlier, strict=True))
            self._history = History(end, readings)
        if not len(self._earlier):
            # Before the first touch of a stream there may have been as many as in the calibration.
            setting, before = self.effects_chain.listed.setting, len(self.effects_chain.calibrated)
            self._missing_s = ends_before(time_s, before, setting.gap_s, setting.hold_s)

    def add(self, held: HeldTouch, values: FloatArray, load: float, time_s: float, reads: float) -> HeldTouch:
        """The touch with one more sample: mean `values` (m,) of `reads` raw readings, load (N/m) and time (s)."""
        self._weight += reads
        self._last, self._times = time_s, self._times + reads * time_s
        here = values == values
        self._total += reads * np.where(here, values, 0.0)
        self._counts += reads * here
        if len(self.rows):
            effects = reads * self._scale_and_shift(time_s, time_s - self._began, self._signal())
            self._sums += effects
            self._sums_read += effects * here
        return held.after(values, load, reads)

    def end(self) -> None:
        """End the touch; its mean readings and its information on the drifts are used for later touches."""
        if len(self.rows):
            mean = self._total / np.maximum(self._counts, 1e-300)
            self._earlier = [*self._earlier, (self._last, mean)][-REMEMBERED:]
            if len(self._earlier) == REMEMBERED:
                self._missing_s = np.zeros(0)
        if self.drifts is not None and self.found is not None:
            precision, information = _evidence(self.found, self.effects_chain).about_addition()
            now = self.drifts.at(self._times / self._weight)
            self.drifts = now.after(self.found.columns, precision[0], information[0])
        self.found = None

    def context(self) -> EffectContext:
        """Effects on the touch so far, without drifts and corrected loads."""
        if not len(self.rows):
            return self._blank if self._weight == 1 else self._with_reads()
        mean = self._mean_effects()
        read, when = (self._total / np.maximum(self._counts, 1e-300))[None], np.array([self._times / self._weight])
        known = np.array([end for end, _ in self._earlier])
        slopes = [(up - down) / width for up, down, width in zip(mean[1::2], mean[2::2], self._widths, strict=True)]
        m = self.effects_chain.model.n_elements
        return replace(
            self._with_reads(),
            scale=mean[0, :1],
            shift=mean[0, 1:],
            slopes=np.array(slopes).reshape(-1, 2, 1, m),
            extra=self.effects_chain.left_by_missing(read, when, self._missing_s, known),
        )

    def with_true_load(self, one: OneTouch, angle: float) -> OneTouch:
        """A touch at an angle (rad) with the corrected load, whose error counts as independent of the readings."""
        loads = self._true_load(one, angle)
        return one.with_(load=float(loads.load[0]), load_sd=float(loads.sd[0]))

    def acting(
        self, one: OneTouch, found: Expansion, context: EffectContext, columns: FloatArray | None, variance: FloatArray
    ) -> tuple[OneTouch, FloatArray]:
        """The touch with drifts and the corrected load, and the covariance (m, m) without each element's own noise.

        Parameters
        ----------
        one, found : OneTouch, Expansion
            The touch without drifts and corrected load, and the expansion at its mode (for the result of
            `with_true_load`, if the load is corrected).
        context : EffectContext
            From `context`.
        columns : (m + q, m) array or None
            From `EffectContext.columns`; None if the calibration counts as exact.
        variance : (m,) array
            Each element's own noise; infinite where missing.
        """
        signal = (found.rows[0] - context.shift[0]) / context.scale[0]
        if self.corrects_load and one.load == one.load:
            loads = self._true_load(one, float(one.in_row(found.x[1])))
            context = self._with_loads(context, loads, columns, signal)
            one = one.with_(load=float(loads.load[0]), load_sd=float(loads.sd[0]), context=context)
        covariance = self.covariance(columns, context, signal)
        if self.drifts is not None:
            now = self.drifts.at(self._times / self._weight)
            by_state = now.columns(self._recording(found.rows[:1].astype(np.float64), self._last, 0.0))
            drift = by_state @ now.mean
            self._pending = (drift, covariance, variance, by_state)
            one = one.with_(context=replace(context, shift=context.shift + drift))
            covariance = covariance + by_state @ now.covariance @ by_state.T
        return one, covariance

    def keep(self, one: OneTouch, found: Expansion) -> None:
        """Store the last posterior of the touch, for the estimate of drifts."""
        if self.drifts is not None:
            self.found = Found(one, found, *self._pending)

    def covariance(self, columns: FloatArray | None, context: EffectContext, signal: FloatArray) -> FloatArray:
        """Covariance (m, m) of the readings without each element's own noise and without drifts.

        Parameters
        ----------
        columns : (m + q, m) array or None
            From `EffectContext.columns`, for the finger without effects that depend on time.
        context : EffectContext
            From `context`, perhaps with corrected loads.
        signal : (m,) array
            Signals before the effects that depend on time.
        """
        chain, m = self.effects_chain, len(signal)
        total = context.extra[0] + chain.listed.noise.covariance(signal[None], chain.model.peak, context.counts)[0]
        if columns is None:
            return np.asarray(total)
        scale = context.scale[0]
        total = total + scale[:, None] * columns[:m] * scale
        # Covariance of the values of the effects with the readings, and the part by effects that depend on time.
        values = columns[m:] * scale
        timed = context.slopes[:, 0, 0] * signal + context.slopes[:, 1, 0]
        if len(timed):
            at = self.rows - chain.model.n_base
            crossed = values[at].T @ timed
            total += crossed + crossed.T + timed.T @ chain.covariance[np.ix_(self.rows, self.rows)] @ timed
            values = values + chain.covariance[chain.model.n_base :, self.rows] @ timed
        if context.loads is not None and np.isfinite(context.loads.load[0]):
            along = context.loads.slope[chain.model.n_base :, 0] @ values / context.loads.sd[0]
            total -= np.outer(along, along)
        return np.asarray(total)

    def _true_load(self, one: OneTouch, angle: float) -> TrueLoads:
        # A stream is later than the calibration.
        time_s, degrees, load, sd = (np.array([each]) for each in (np.inf, np.degrees(angle), one.load, one.load_sd))
        return true_loads(self.effects_chain, time_s, degrees, load, sd, exact=self.exact)

    def _with_loads(
        self, context: EffectContext, loads: TrueLoads, columns: FloatArray | None, signal: FloatArray
    ) -> EffectContext:
        """The context with a corrected load, whose error is correlated with the readings."""
        if columns is None or not np.isfinite(loads.load[0]):
            return replace(context, loads=loads)
        m, base = len(signal), self.effects_chain.model.n_base
        values = columns[m:] * context.scale[0]
        timed = context.slopes[:, 0, 0] * signal + context.slopes[:, 1, 0]
        if len(timed):
            values = values + self.effects_chain.covariance[base:, self.rows] @ timed
        along = (loads.slope[base:, 0] @ values / loads.sd[0])[None]
        return replace(context, loads=loads.with_gain(along))

    def _start(self) -> None:
        m = self.effects_chain.model.n_elements
        self._weight = self._times = 0.0
        self._began = self._last = 0.0
        self._history = None
        self._total, self._counts = np.zeros(m), np.zeros(m)
        self._sums = np.zeros((len(self._vectors), 2, m))
        self._sums_read = np.zeros_like(self._sums)

    def _mean_effects(self) -> FloatArray:
        """Mean of `_scale_and_shift`, (v, 2, m), over the samples in which the element has a reading.

        For an element without a reading it is the mean over all samples.
        """
        read = self._counts > 0
        return np.asarray(np.where(read, self._sums_read, self._sums) / np.where(read, self._counts, self._weight))

    def _with_reads(self) -> EffectContext:
        return replace(self._blank, counts=self._counts[None].copy())

    def _moved_vectors(self) -> list[FloatArray]:
        """Parameters of the timed effects: at the mode, then one step up and down in each value."""
        chain = self.effects_chain
        here = np.concatenate([chain.vector[: chain.model.n_base], chain.vector[self.rows]])
        out, self._widths = [here], []
        for k, row in enumerate(self.rows if not self.exact else ()):
            step = 0.01 * max(float(np.sqrt(chain.covariance[row, row])), 1e-9)
            for sign in (1, -1):
                moved = here.copy()
                moved[chain.model.n_base + k] += sign * step
                out.append(moved)
            self._widths.append(2 * step)
        return out

    def _signal(self) -> FloatArray:
        """Signal (m,) at which effects that depend on time are evaluated; see `bayestouch.finger.reading.effects`."""
        if not self._in_time_bends:
            return np.ones(self.effects_chain.model.n_elements)
        read, held = self._total / np.maximum(self._counts, 1e-300), self._last - self._began
        return signal_behind(read, self._timed.peak, lambda signal: self._scale_and_shift(self._last, held, signal)[0])

    def _bends_in_time(self) -> bool:
        """Whether an effect that depends on time is not in proportion to the signal."""
        one = np.ones(self.effects_chain.model.n_elements)
        once, twice = (self._scale_and_shift(1.0, 1.0, size * one)[0, 0] for size in (1.0, 2.0))
        return not np.allclose(once, twice, rtol=1e-9, atol=0)

    def _scale_and_shift(self, time_s: float, held_s: float, signal: FloatArray) -> FloatArray:
        """Factor and addition of the effects that depend on time in a sample, for each of v vectors, (v, 2, m)."""
        recording = self._recording(np.stack([signal, np.zeros(len(signal))]), time_s, held_s)
        rows = np.stack([self._timed.through(recording, vector) for vector in self._vectors])
        return np.stack([(rows[:, 0] - rows[:, 1]) / signal, rows[:, 1]], axis=1)

    def _recording(self, signal: FloatArray, time_s: float, held_s: float) -> Recording:
        n, model = len(signal), self._timed
        nothing = np.zeros(n)
        return Recording(
            indenter_radius_mm=nothing,
            place=(nothing,),
            load=nothing + 1.0,
            time_s=nothing + time_s,
            held_s=nothing + held_s,
            element_place=self._element_place,
            peak=model.peak,
            reference_load=model.reference_load,
            signal=signal,
            history=self._history,
        )

    @cached_property
    def _element_place(self) -> tuple[FloatArray, ...]:
        return (np.asarray(self._timed.finger.element_angles_deg),)


def _evidence(touch: Found, chain: ChainWithEffects) -> TouchEvidence:
    """Information of a touch on an addition to its readings; as in `touches_with_effects`."""
    one, found = touch.one, touch.found
    rows = found.rows.astype(np.float64)
    jacobian = (rows[1:4] - rows[4:]) / (2 * found.steps[:, None])
    wide = (100 * chain.model.peak) ** 2
    here = np.isfinite(touch.variance)
    residual = np.where(here, one.readings - (rows[0] - touch.shift), 0.0)
    loose = 1 / (LOOSE * np.array([1.0, 1.0, chain.model.reference_load])) ** 2
    shift = np.zeros(3)
    if one.load == one.load:
        loose[2], shift[2] = 1 / one.load_sd**2, one.load - found.x[2]
    variance = np.where(here, touch.variance, wide)
    covariance = touch.covariance + np.diag(variance)
    return TouchEvidence(residual[None], jacobian.T[None], covariance[None], shift[None], loose[None])
