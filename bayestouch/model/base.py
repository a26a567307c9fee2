"""What fingers and pads with effects have in common: where effects act, and how they pass derivatives on."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Protocol, Self

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.recording import Recording
from bayestouch.effects.effect import STAGES, Effect, Values
from bayestouch.model.observations import Observations, UntimedTouches

Rows = Observations | UntimedTouches

# Central differences through the effects: of an effect's value, as a share of its probe; of the load.
VALUE_STEP, LOAD_STEP = 1e-2, 1e-4
# Prior standard deviations beyond which a parameter counts as driven off.
FAR_FROM_PRIOR = 1.2


@dataclass(frozen=True, eq=False)
class Predicted:
    """Prediction of touches and of samples; t touches, n samples, m elements.

    Attributes
    ----------
    touches : (t, m) array
        Mean reading of each touch.
    samples : (n, m) array or None
        Sample minus mean of its touch; None where the samples of a touch are all the same.
    """

    touches: FloatArray
    samples: FloatArray | None


class CorrectionBasis(Protocol):
    """Smooth functions of where a touch is: what a cause that is not in the catalogue may do on this body."""

    def columns(self, *where: FloatArray) -> dict[str, FloatArray]:
        """Readings per unit weight of touches at `SensorModel.correction_inputs`; each part (k, t, m), at size one."""
        ...


@dataclass(frozen=True, eq=False)
class PossibleTouches:
    """Touches that could be made, from which a series is chosen that decides between two models.

    Attributes
    ----------
    observed : Observations
        All of them, without readings.
    series : tuple of (str, int array)
        What to measure in words, and which of the touches that is.
    """

    observed: Observations
    series: tuple[tuple[str, IntArray], ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class SensorModel(ABC):
    """A sensor with effects. Its vector holds the base parameters, then the values of the effects in order.

    Attributes
    ----------
    observed : Observations or UntimedTouches
        What is predicted.
    peak : (m,) array
        Size of each element's reading under the reference load: what shares refer to.
    reference_load : float
        N/m on a finger, N on a pad.
    effects : tuple of Effect
        Effects in the chain, in the order of their values; they act in the order of the stages.
    """

    observed: Rows
    peak: FloatArray
    reference_load: float
    effects: tuple[Effect, ...] = ()

    #: Whether touches that follow each other in time are neighbours in place, as in a scan: then a random function of
    #: time can follow all that goes with the place.
    time_is_place: ClassVar[bool] = False
    #: Whether the parameters are fitted anew beside a correction: not where they could follow all that it does.
    refitted_with_correction: ClassVar[bool] = True
    #: Stages whose effects on the pose say that a reference is not what the data set states.
    reference_stages: ClassVar[tuple[str, ...]] = STAGES

    @property
    @abstractmethod
    def n_base(self) -> int:
        """Number of base parameters."""

    def peak_at(self, vector: FloatArray) -> FloatArray:
        """Size of each element's signal, before effects on it, right under the reference load, (m,)."""
        if not self.effects:
            return self.peak
        recording = self.signal(vector)
        sensitivity = np.abs(recording.signal / recording.load[:, None]).max(axis=0)
        acting = float(np.median(recording.load / self.load))
        return np.asarray(np.maximum(sensitivity, 1e-300) * acting * self.reference_load)

    @abstractmethod
    def poses(self, vector: FloatArray, load: FloatArray | None = None) -> Recording:
        """Touches as they really were."""

    @abstractmethod
    def signal(self, vector: FloatArray, load: FloatArray | None = None) -> Recording:
        """Touches with the signal that leaves the body, for loads as read or `load` (t,)."""

    @abstractmethod
    def prior(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Mean, standard deviation, lower and upper bound of the vector."""

    @abstractmethod
    def reset_to_nominal(self, vector: FloatArray) -> FloatArray | None:
        """The vector with the body's parameters as built; None where they are near that already."""

    @abstractmethod
    def derivatives(self, vector: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Derivative of the prediction, (d, t, m) and, where samples differ, (d, n, m)."""

    @abstractmethod
    def correction_basis(self, vector: FloatArray) -> CorrectionBasis:
        """Basis of a correction without a cause, over the places that the touches cover."""

    @abstractmethod
    def correction_inputs(self, vector: FloatArray) -> tuple[FloatArray, ...]:
        """What the functions of `correction_basis` are functions of, for the touches."""

    def possible_touches(self) -> PossibleTouches | None:
        """Touches that could decide between two models; None where no advice can be given."""
        return None

    def zero(self, vector: FloatArray) -> FloatArray:
        """Readings without a signal, (m,): what gains do not multiply."""
        return np.zeros(self.n_elements)

    @property
    def n_elements(self) -> int:
        """Number of elements m."""
        return len(self.peak)

    @property
    def known(self) -> Observations:
        """What is observed, where there are readings to fit."""
        assert isinstance(self.observed, Observations)
        return self.observed

    @cached_property
    def load(self) -> FloatArray:
        """Load as read, (t,); the mean of the others where it was not."""
        load = self.observed.load
        return np.where(np.isfinite(load), load, np.nanmean(load))

    def values(self, vector: FloatArray) -> tuple[Values, ...]:
        """Values of each effect in a vector, which holds the logarithm of what has a log-normal prior."""
        out, place = [], self.n_base
        for effect in self.effects:
            count = len(effect.parameters)
            moved = zip(effect.parameters, vector[place : place + count], strict=True)
            out.append(tuple(parameter.from_unconstrained(float(v)) for parameter, v in moved))
            place += count
        return tuple(out)

    def extended(self, vector: FloatArray, values: Values) -> FloatArray:
        """A vector of the model without its last effect, with values for that."""
        pairs = zip(self.effects[-1].parameters, values, strict=True)
        return np.concatenate([vector, [parameter.to_unconstrained(value) for parameter, value in pairs]])

    def in_order(self, vector: FloatArray) -> list[tuple[Effect, Values]]:
        """Effects with their values in the order of the stages, those that differ from sample to sample last."""
        pairs = zip(self.effects, self.values(vector), strict=True)
        return sorted(pairs, key=lambda pair: (STAGES.index(pair[0].stage), pair[0].needs_samples))

    @cached_property
    def value_priors(self) -> FloatArray:
        """Mean, sd, lower and upper end of every value of the effects, (q, 4)."""
        ends = [each.normal_prior for effect in self.effects for each in effect.parameters]
        return np.array(ends, dtype=np.float64).reshape(-1, 4)

    @property
    def by_sample(self) -> bool:
        """Whether the samples of a touch differ."""
        return any(effect.needs_samples for effect in self.effects)

    def predict(self, vector: FloatArray, load: FloatArray | None = None) -> Predicted:
        """Prediction for the touches, with loads as read or `load` (t,)."""
        return self.readings(self.signal(vector, load), vector)

    def rows(self, recording: Recording) -> Recording:
        """Touches as samples, where the samples of a touch differ."""
        if not self.by_sample:
            return recording
        row, observed = self.observed.row_touch, self.observed
        return replace(
            recording,
            indenter_radius_mm=recording.indenter_radius_mm[row],
            place=tuple(axis[row] for axis in recording.place),
            load=recording.load[row],
            time_s=observed.time_s,
            held_s=observed.held_s,
            signal=recording.signal[row],
        )

    def through(self, recording: Recording, vector: FloatArray) -> FloatArray:
        """Readings of rows of which the signal that leaves the body is given."""
        for effect, values in self.in_order(vector):
            recording = replace(recording, signal=effect.signal(recording, values))
        return recording.signal

    def parted(self, rows: FloatArray) -> Predicted:
        """Readings of `rows` as means of touches and deviations from them."""
        if not self.by_sample:
            return Predicted(rows, None)
        touches = self.observed.of_touches(rows)
        return Predicted(touches, rows - touches[self.observed.row_touch])

    def readings(self, recording: Recording, vector: FloatArray) -> Predicted:
        """Readings of touches of which the signal that leaves the body is given."""
        return self.parted(self.through(self.rows(recording), vector))

    def about_value(self, vector: FloatArray, place: int) -> tuple[FloatArray, FloatArray, float]:
        """Vectors a step above and below in one value of an effect, and half of what is between."""
        _, spread, low, high = (float(each) for each in self.value_priors[place - self.n_base])
        step = VALUE_STEP * min(spread, max(abs(float(vector[place])), 0.1 * spread))
        # One-sided at a bound.
        up, down = vector.copy(), vector.copy()
        up[place], down[place] = min(vector[place] + step, high), max(vector[place] - step, low)
        return up, down, float(0.5 * (up[place] - down[place]))

    def of_value(self, vector: FloatArray, place: int) -> Predicted:
        """Derivative over one value of an effect."""
        up, down, step = self.about_value(vector, place)
        return difference(lambda sign: self.predict(up if sign > 0 else down), step)

    def by_load(self, vector: FloatArray) -> FloatArray:
        """Derivative of the readings of each touch over its load, (t, m)."""
        step = LOAD_STEP * self.load
        up, down = (self.predict(vector, self.load + sign * step).touches for sign in (1, -1))
        return np.asarray((up - down) / (2 * step[:, None]))

    def observing(self, observed: Rows) -> Self:
        """The same sensor and effects for other touches."""
        return replace(self, observed=observed)

    def with_effects(self, effects: tuple[Effect, ...]) -> Self:
        """The same sensor under other effects."""
        return replace(self, effects=effects)


def difference(at: Callable[[float], Predicted], step: float) -> Predicted:
    """Central difference of a prediction ``at`` plus and minus one step."""
    up, down = at(1.0), at(-1.0)
    samples = None
    if up.samples is not None and down.samples is not None:
        samples = (up.samples - down.samples) / (2 * step)
    return Predicted((up.touches - down.touches) / (2 * step), samples)
