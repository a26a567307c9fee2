"""Effects of time whose course is not known in advance: smooth random functions of time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bayestouch.effects.effect import Effect, EffectParameter, Setting, Stage, Values
from bayestouch.parameters import LogNormal, Normal
from bayestouch.recording import Recording
from bayestouch.smooth import SmoothBasis

FloatArray = NDArray[np.float64]


class RandomEffect(Effect):
    """An effect that is a smooth random function of time; its values are the function's sd and correlation time.

    Attributes
    ----------
    own : bool
        Whether each element has a function of its own, or all share one.
    """

    own: ClassVar[bool]

    def basis(self, time_s: FloatArray, values: Values, low: float, high: float) -> FloatArray:
        """Basis (n, k) of functions of sd `values[0]` between the times `low` and `high`."""
        sd, time = values
        return sd * SmoothBasis.of(low, high, time)(time_s)

    def scale(self, recording: Recording) -> FloatArray:
        """What the function is multiplied by in each reading, (n, m)."""
        raise NotImplementedError


def _parameters(setting: Setting, what: str, sd: float) -> tuple[EffectParameter, ...]:
    times = tuple(setting.span_s * share for share in (1 / 4, 1 / 12, 1 / 36))
    return (
        EffectParameter("sd", "", f"standard deviation of {what}", Normal(0.0, sd, 0.0), (0.01,), 0.0),
        EffectParameter("time", setting.time_unit, "correlation time", LogNormal(times[1], 1.2), times),
    )


@dataclass(frozen=True)
class BaselineDrift(RandomEffect):
    """The zero of each element wanders: a smooth random function of time for each, in shares of its peak reading.

    Temperature and charge leakage move zeros whether anything touches or not, so that elements far from the touch
    show it best.

    Reference: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes (2006), section 4.2 (Matérn).
    """

    parameters: tuple[EffectParameter, ...]

    name: ClassVar[str] = "baseline_drift"
    stage: ClassVar[Stage] = "readout"
    summary: ClassVar[str] = "zeros that wander with time"
    mixes: ClassVar[bool] = False
    own: ClassVar[bool] = True

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls(_parameters(setting, "the zero, over the peak reading", 0.05)) if setting.span_s > 0 else None

    def scale(self, recording: Recording) -> FloatArray:
        return np.broadcast_to(recording.peak, recording.signal.shape)


@dataclass(frozen=True)
class GainDrift(RandomEffect):
    """The gain of all elements wanders together: one smooth random function of time that multiplies the signal.

    Supply voltage and temperature move gains; elements far from the touch show nothing.

    Reference: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes (2006), section 4.2 (Matérn).
    """

    parameters: tuple[EffectParameter, ...]

    name: ClassVar[str] = "gain_drift"
    stage: ClassVar[Stage] = "readout"
    summary: ClassVar[str] = "gain that wanders with time"
    mixes: ClassVar[bool] = False
    own: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls(_parameters(setting, "the gain, as a share", 0.05)) if setting.span_s > 0 else None

    def scale(self, recording: Recording) -> FloatArray:
        return recording.signal
