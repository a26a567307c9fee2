"""Effects of the readout that are functions of the signal, of the time held, or of earlier touches."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.missing import MissingTouches
from bayestouch.chain.recording import Recording
from bayestouch.chain.smooth import SmoothBasis
from bayestouch.effects.effect import Effect, EffectParameter, Setting, Stage, Values, own_parameters
from bayestouch.effects.element import EXCESS, SPREAD, of_elements
from bayestouch.priors.parameters import LogNormal, Normal, Uniform

# Largest reading over the peak (or over the limit of a saturation): it prevents overflow.
FAR = 5.0
# Largest power of a gain curve; higher powers overflow. Least reading over the peak of which powers are taken.
STEEP, LEAST = 50.0, 1e-3
# Least gain over that at zero: where the gain vanishes, a fit has no slope and does not find its way back.
LEAST_GAIN = 0.05
# Gain curve over the reading by the peak: correlated over a third of the peak, so that it follows a bend that is wider
# than that; and the sd of its weights, which is that of the gain at any reading. Beyond the peak it returns to zero.
GAIN_CURVE = SmoothBasis.of(0.0, 1.0, 0.3)
WEIGHTS, BEND = GAIN_CURVE.root.shape[1], 0.1
# Least power of the strain in the share of a slow change. At -1 the change would be the same for any strain, and with
# still lower powers a small strain would leave more than a large one.
LEAST_STRAIN_POWER = -0.9
# Sd of the reading without touch over the peak: the zero of a bridge or a pressure sensor may be that far away.
OFFSET = 0.3


@dataclass(frozen=True)
class GainNonlinearity(Effect):
    """The gain changes with the reading: y (1 + share |y/peak|^power).

    The curve is expansive for `share` > 0, compressive for `share` < 0. Power 1 is the first term of a rational curve,
    power 2 that of a hyperbolic tangent or a sine. Data rarely determine the power well. In the looser form the
    share of element e is 1 + `own_e` times this. On a finger the gain of all elements also follows a smooth random
    function of |y/peak| with independent weights `curve_1` and on: any curve that is smooth over a third of the peak,
    whatever its formula. On a pad such a curve would imitate a kernel whose width changes with the load. There
    `second` is the share of half the power: with both powers the curve may have an inflection.

    Reference: J. Fraden, Handbook of Modern Sensors (2016), on transfer functions.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter("share", "", "change of gain at the peak", Normal(0.0, 0.3), (0.001,), 0.0),
        EffectParameter("power", "", "power of the reading", LogNormal(1.4, 0.4), (1.0, 2.0)),
    )
    on_finger: bool = True

    name: ClassVar[str] = "gain_nonlinearity"
    stage: ClassVar[Stage] = "readout"
    summary: ClassVar[str] = "gain that changes with the reading"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls(on_finger=setting.finger)

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        own = own_parameters(n_elements, EXCESS, SPREAD)
        if not self.on_finger:
            what = "change of gain at the peak with half the power"
            return (*own, EffectParameter("second", "", what, Normal(0.0, 0.3), (0.0,)))
        curve = (
            EffectParameter(f"curve_{k}", "", f"weight {k} of the gain curve", Normal(0.0, BEND), (0.1 * BEND,), 0.0)
            for k in range(1, WEIGHTS + 1)
        )
        return (*own, *curve)

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        share, power, *more = values
        m = recording.signal.shape[1]
        own, bends = more[:m], more[m:]
        # A step of a fit may lead to extreme values of the signal and the power.
        size = np.minimum(np.abs(recording.signal) / recording.peak, FAR)
        power = min(power, STEEP)
        change = share * of_elements(own) * size**power
        if any(bends) and self.on_finger:
            change = change + GAIN_CURVE.summed(size, bends)
        elif any(bends):
            change = change + bends[0] * size ** (0.5 * power)
        return np.asarray(recording.signal * np.maximum(1 + change, LEAST_GAIN))


@dataclass(frozen=True)
class Saturation(Effect):
    """Readings are limited: y/(1 + |y/limit|^knee)^(1/knee).

    `level` is the limit over the peak reading: over each element's own peak for `shared` = 0 (a limit in the element),
    over the mean peak of all elements for `shared` = 1 (a limit of the amplifier). The larger `knee`, the sharper the
    limit. In the looser form the limit of element e is exp(`own_e`) times this. On a finger it also decreases by the
    share `fall` over the recording, and stays there. A curve that bends over its whole range is `gain_nonlinearity`.

    Reference: P. Horowitz and W. Hill, The Art of Electronics (2015), on the output swing of amplifiers.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter(
            "level",
            "",
            "limit over the peak reading",
            LogNormal(1.0, 0.5),
            (1.15, 1.05, 0.95, 0.85, 0.75, 0.6),
            np.inf,
        ),
        EffectParameter("knee", "", "sharpness of the limit", Uniform(5.0, 40.0), (8.0, 25.0)),
        EffectParameter("shared", "", "0: of each element's own peak, 1: of the mean peak", Uniform(0, 1), (0.0, 1.0)),
    )
    span_s: float = 0.0
    on_finger: bool = True

    name: ClassVar[str] = "saturation"
    stage: ClassVar[Stage] = "readout"
    summary: ClassVar[str] = "readings cut off at a level"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls(span_s=setting.span_s, on_finger=setting.finger)

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        own = own_parameters(n_elements, "logarithm of the relative limit", SPREAD)
        what = "share by which the limit falls over the recording"
        fall = EffectParameter("fall", "", what, Normal(0.0, 0.3, high=0.9), (0.0,))
        return (*own, fall) if self.on_finger and self.span_s > 0 else own

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        level, knee, shared, *own = values
        fall = own.pop() if len(own) > recording.signal.shape[1] else 0.0
        if np.isinf(level):
            return recording.signal
        limit = level * recording.peak ** (1 - shared) * float(recording.peak.mean()) ** shared
        if own:
            passed = np.clip(recording.time_s / max(self.span_s, 1e-9), 0.0, 1.0)
            limit = limit * np.exp(own) * (1 - fall * passed)[:, None]
        # Beyond the limit the formula is that with |y| and limit exchanged: no power of a large number.
        size = np.abs(recording.signal)
        less, more = np.minimum(size, limit), np.maximum(size, limit)
        return np.asarray(np.sign(recording.signal) * less / (1 + (less / more) ** knee) ** (1 / knee))


@dataclass(frozen=True)
class RestOffset(Effect):
    """Each element reads a constant without touch, which nobody subtracted: y + offset peak.

    The offset of element e is `own_e` times the peak of its reading. Where the tables have rows without touch, their
    mean is subtracted and the effect is not looked for; nor is it beside `baseline_drift`, which has a mean of its own.
    On a pad, offsets are parameters of the base model.

    Reference: J. Fraden, Handbook of Modern Sensors (2016), on transfer functions (zero offset).
    """

    parameters: tuple[EffectParameter, ...]

    name: ClassVar[str] = "rest_offset"
    stage: ClassVar[Stage] = "readout"
    summary: ClassVar[str] = "readings that are not zero without touch"
    mixes: ClassVar[bool] = False
    contained_in: ClassVar[str] = "baseline_drift"

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        if not setting.finger or setting.any_rest:
            return None
        own = own_parameters(setting.n_elements, "reading without touch, as a share of the peak,", OFFSET)
        return cls(tuple(replace(each, null=0.0, probes=(0.01,)) for each in own))

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        return np.asarray(recording.signal + np.array(values) * recording.peak)


@dataclass(frozen=True)
class Creep(Effect):
    """Readings change while the touch is held: y (1 + share (1 - exp(-t/time))).

    Rubber creeps under a constant load; adhesives and charge amplifiers also do. `share` is the change for t → ∞. In
    the looser form that of element e is 1 + `own_e` times this, and grows with the power `strain_power` of the reading.

    Reference: J. D. Ferry, Viscoelastic Properties of Polymers (1980), chapter 1, the standard linear solid.
    """

    parameters: tuple[EffectParameter, ...]

    name: ClassVar[str] = "creep"
    stage: ClassVar[Stage] = "readout"
    summary: ClassVar[str] = "readings that change while the touch is held"
    mixes: ClassVar[bool] = False
    needs_samples: ClassVar[bool] = True

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        if setting.hold_s <= 0:
            return None
        times = tuple(setting.hold_s * share for share in (0.25, 1.0))
        return cls(
            (
                EffectParameter("share", "", "change after a long time, as a share", Normal(0.0, 0.2), (0.001,), 0.0),
                EffectParameter("time", setting.time_unit, "time constant", LogNormal(times[1], 1.0), times),
            )
        )

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        return _of_strain(n_elements)

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        share, time, *looser = values
        gained = (share * -np.expm1(-recording.held_s / time))[:, None]
        return np.asarray(recording.signal * (1 + gained * _growth(recording.signal, recording.peak, looser)))


#: Gauss-Hermite nodes of a standard normal variable, and weights; exact for polynomials up to the fifth degree.
SPECTRUM_NODES = np.sqrt(3.0) * np.array([-1.0, 0.0, 1.0])
SPECTRUM_WEIGHTS = np.array([1.0, 4.0, 1.0]) / 6


@dataclass(frozen=True)
class Memory(Effect):
    """Rubber recovers slowly: a share of the reading of each touch remains when the next touch begins.

    `share` is the part that remains after the median pause between touches; it decays further with time. Rubber has
    more than one relaxation time: the logarithms of the times are normal with median `time` and sd `breadth`
    (three exponentials, by Gauss-Hermite quadrature). In the looser form the share of element e is 1 + `own_e` times
    this, and grows with the power `strain_power` of the earlier reading. On a finger, earlier touches may also change
    the gain, since they break up the network of a filler. The change is `gain` times the sum of what remains of their
    readings, weighted with `own_e` and `strain_power`, over the peak. Where every touch has a rest reading of its own,
    the remainder is subtracted with it, and memory is not looked for.

    A touch is read with the touches before it, and so best in its whole table. Touches that may be missing make its
    standard deviations larger: those before the first touch of a table, and those whose numbers are missing between two
    touches, if there was time for them. They count as touches like those of the calibration, at its pace. A long pause
    without missing numbers is taken as a pause: where the sensor was touched and nothing was recorded, leave out a
    number.

    Reference: J. D. Ferry, Viscoelastic Properties of Polymers (1980), chapters 1 (recovery) and 3 (spectra); A. R.
    Payne (1962), doi:10.1002/app.1962.070061906 (recovery of filled rubber).
    """

    parameters: tuple[EffectParameter, ...]
    pause_s: float
    on_finger: bool = True

    name: ClassVar[str] = "memory"
    stage: ClassVar[Stage] = "readout"
    summary: ClassVar[str] = "remainder of the readings of earlier touches"
    remembers: ClassVar[bool] = True
    mixes: ClassVar[bool] = False
    needs_samples: ClassVar[bool] = True

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        pause = setting.gap_s
        if pause <= 0 or setting.own_rest:
            return None
        times = tuple(pause * factor for factor in (0.4, 1.5, 5.0))
        return cls(
            (
                EffectParameter("share", "", "share left after a pause", Normal(0.0, 0.1), (0.001,), 0.0),
                EffectParameter("time", setting.time_unit, "median relaxation time", LogNormal(times[1], 0.8), times),
                EffectParameter("breadth", "", "sd of the logarithm of the relaxation time", Uniform(0.0, 2.0), (0.5,)),
            ),
            pause,
            setting.finger,
        )

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        gain = EffectParameter("gain", "", "change of gain after a pause", Normal(0.0, 0.1), (0.001,), 0.0)
        return (*_of_strain(n_elements), gain) if self.on_finger else _of_strain(n_elements)

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        share, time, breadth, *looser = values
        history, of_gain = recording.history, looser.pop() if looser and self.on_finger else 0.0
        if history is None:
            return recording.signal
        if looser:
            history = replace(history, readings=history.readings * _growth(history.readings, recording.peak, looser))
        times = time * np.exp(breadth * SPECTRUM_NODES)
        left = history.leftover(recording.time_s - recording.held_s, times)
        # If the relaxation time is far below the pause, nothing remains, whatever the share.
        after_pause = max(float(SPECTRUM_WEIGHTS @ np.exp(-self.pause_s / times)), 1e-22)
        fade = SPECTRUM_WEIGHTS[:, None] * np.exp(-recording.held_s / times[:, None])
        kept = np.einsum("fn,fnm->nm", fade, left) / after_pause
        # a reader asks with every touch: without a change of the gain its product is left out
        signal = recording.signal * (1 + of_gain * kept / recording.peak) if of_gain else recording.signal
        return np.asarray(signal + share * kept)

    def left_by_missing(
        self, values: Values, read: FloatArray, when_s: FloatArray, missing: MissingTouches, peak: FloatArray
    ) -> FloatArray:
        """See `Effect.left_by_missing`."""
        share, time, breadth, *looser = values
        of_gain = looser.pop() if looser and self.on_finger else 0.0
        read = np.nan_to_num(read)
        factor = share + of_gain * read / peak if of_gain else np.full(read.shape, share)
        times = time * np.exp(breadth * SPECTRUM_NODES)
        after_pause = max(float(SPECTRUM_WEIGHTS @ np.exp(-self.pause_s / times)), 1e-22)

        def kept(passed_s: FloatArray) -> FloatArray:
            return np.asarray(SPECTRUM_WEIGHTS @ np.exp(-passed_s / times[:, None]) / after_pause)

        calibrated = missing.calibrated * _growth(missing.calibrated, peak, looser)
        left = replace(missing, calibrated=calibrated).left(read, when_s, peak, kept)
        return np.asarray(factor[:, :, None] * left * factor[:, None])


def _of_strain(n_elements: int) -> tuple[EffectParameter, ...]:
    """Parameters of a share of each element's own that depends on the strain."""
    power = EffectParameter("strain_power", "", "power of the reading", Normal(0.0, 1.0, LEAST_STRAIN_POWER), (0.0,))
    return (*own_parameters(n_elements, EXCESS, SPREAD), power)


def _growth(readings: FloatArray, peak: FloatArray, looser: list[float]) -> FloatArray:
    """Factor of the share, (n, m) or (1,), for readings (n, m) and the values of `_of_strain`, if there are any."""
    if not looser:
        return np.ones(1)
    *own, power = looser
    size = np.clip(np.abs(readings) / peak, LEAST, FAR)
    return np.asarray(of_elements(own) * size ** min(power, STEEP))
