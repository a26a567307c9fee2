"""Effects that are unknown smooth functions of time: Gaussian processes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import ClassVar, Self

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import Recording
from bayestouch.chain.smooth import DENSE, KNOTS_A_LENGTH, SmoothBasis
from bayestouch.effects.effect import Effect, EffectParameter, Setting, Stage, Values
from bayestouch.priors.parameters import LogNormal, Normal, Uniform


@dataclass(frozen=True)
class RandomEffect(Effect):
    """An effect that is a smooth random function of time: a Gaussian process with Matérn 3/2 correlation.

    Its first two values are the sd and the correlation time of the function. Each further value selects a kind of
    drift; only the probes of its parameter are tried. Sd and correlation time are estimated with the exact process. A
    fit interpolates the function between `knots` per correlation time: few in the search for effects, more in the
    final model. A simulation draws the weights of the `basis`, which are standard normal.
    """

    parameters: tuple[EffectParameter, ...]
    knots: float = KNOTS_A_LENGTH

    random: ClassVar[bool] = True

    def with_dense_knots(self) -> Self:
        """The same effect with more knots per correlation time."""
        return replace(self, knots=DENSE)

    def own(self, values: Values) -> bool:
        """Whether each element has its own function (True), or all elements share one (False)."""
        raise NotImplementedError

    def basis(self, time_s: FloatArray, values: Values, low: float, high: float) -> FloatArray:
        """Basis (n, k) at `time_s` of a function of sd `values[0]` between the times `low` and `high`."""
        sd, time = values[:2]
        return sd * SmoothBasis.of(low, high, time, knots=self.knots)(time_s)

    def as_stated(self, start: Mapping[str, float]) -> Self:
        """The drift only of the kind that is stated: no fit changes it, while sd and time are always searched."""
        kinds = (
            replace(each, probes=(min(each.probes, key=lambda probe: abs(probe - start[each.name])),))
            if each.name in start
            else each
            for each in self.parameters[2:]
        )
        return replace(self, parameters=(*self.parameters[:2], *kinds))

    @property
    def kinds(self) -> tuple[Values, ...]:
        """All combinations of the values after sd and correlation time."""
        return tuple(product(*(each.probes for each in self.parameters[2:])))

    def scale(self, recording: Recording) -> FloatArray:
        """Factor of the function in each reading, (n, m)."""
        raise NotImplementedError

    def drawn(self, which: int, value: float, sd: float, normal: FloatArray) -> FloatArray:
        """See `Effect.drawn`: the posterior of size and time is near normal in their logarithms."""
        if which < 2:
            return np.asarray(value * np.exp(sd / value * normal))
        return super().drawn(which, value, sd, normal)

    def simulate(self, recording: Recording, values: Values, rng: np.random.Generator) -> FloatArray:
        time, m = recording.time_s, recording.signal.shape[1]
        basis = self.basis(time, values, float(time.min()), float(time.max()))
        course = basis @ rng.standard_normal((basis.shape[1], m if self.own(values) else 1))
        return np.asarray(recording.signal + self.scale(recording) * course)


def _parameters(setting: Setting, what: str, sd: float) -> tuple[EffectParameter, ...]:
    times = tuple(setting.span_s * share for share in (1 / 4, 1 / 12, 1 / 36))
    return (
        EffectParameter("sd", "", f"standard deviation of {what}", Normal(0.0, sd, 0.0), (0.01,), 0.0),
        EffectParameter("time", setting.time_unit, "correlation time", LogNormal(times[1], 1.2), times),
    )


@dataclass(frozen=True)
class BaselineDrift(RandomEffect):
    """The zero of each element drifts: a smooth random function of time per element, in units of its peak reading.

    Temperature and charge leakage change the zero whether or not the sensor is touched, so that elements far from the
    touch show the drift best. Where every touch has a rest reading of its own, the drift is subtracted with it, and is
    not looked for.

    Reference: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes (2006), section 4.2 (Matérn).
    """

    name: ClassVar[str] = "baseline_drift"
    stage: ClassVar[Stage] = "readout"
    summary: ClassVar[str] = "zeros that drift with time"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        if setting.span_s <= 0 or setting.own_rest:
            return None
        return cls(_parameters(setting, "the zero, over the peak reading", 0.05))

    def own(self, values: Values) -> bool:
        return True

    def scale(self, recording: Recording) -> FloatArray:
        return np.broadcast_to(recording.peak, recording.signal.shape)


@dataclass(frozen=True)
class GainDrift(RandomEffect):
    """The gain drifts: the signal is multiplied by 1 plus a smooth random function of time.

    Supply voltage and temperature change all gains together; ageing and loose leads change the gain of each element
    separately. Elements far from the touch have no signal and do not show this drift.

    Reference: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes (2006), section 4.2 (Matérn).
    """

    name: ClassVar[str] = "gain_drift"
    stage: ClassVar[Stage] = "readout"
    summary: ClassVar[str] = "gain that drifts with time"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        if setting.span_s <= 0:
            return None
        what = "0: one function for all elements, 1: one for each element"
        own = EffectParameter("own", "", what, Uniform(0.0, 1.0), (0.0, 1.0))
        return cls((*_parameters(setting, "the gain, as a share", 0.05), own))

    def own(self, values: Values) -> bool:
        return values[2] > 0.5

    def scale(self, recording: Recording) -> FloatArray:
        return recording.signal
