"""`SensorModel`, the base class of fingers and pads with effects: predictions and their derivatives."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import ClassVar, Protocol, Self

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.recording import Recording
from bayestouch.effects.effect import STAGES, Effect, Shift, Values, places_of_values
from bayestouch.model.noise import LoadNoise
from bayestouch.model.observations import Observations, UntimedTouches

Rows = Observations | UntimedTouches

# Relative steps of central differences: of an effect's value, over its probe; of the load.
VALUE_STEP, LOAD_STEP = 1e-2, 1e-4
# A base parameter is unusual if it is more than so many prior standard deviations from its nominal value.
FAR_FROM_PRIOR = 1.2


@dataclass(frozen=True, eq=False)
class Predicted:
    """Prediction of touches and of samples; t touches, n samples, m elements.

    Attributes
    ----------
    touches : (t, m) array
        Mean reading of each touch.
    samples : (n, m) array or None
        Sample minus mean of its touch; None if all samples of a touch are equal.
    """

    touches: FloatArray
    samples: FloatArray | None


# A prediction as a function of the vector of parameters.
PredictedAt = Callable[[FloatArray], Predicted]


class CorrectionBasis(Protocol):
    """Smooth functions of the location of a touch, for errors with a cause that is not in the catalogue."""

    def columns(self, *where: FloatArray) -> dict[str, FloatArray]:
        """Readings per unit weight for touches at `SensorModel.correction_inputs`, by part; (k, t, m) for size 1."""
        ...


@dataclass(frozen=True, eq=False)
class PossibleTouches:
    """Possible further touches, from which the series that best distinguishes two models is chosen.

    Attributes
    ----------
    observed : Observations
        All possible touches, without readings.
    series : tuple of (str, int array)
        For each series: what to measure, in words, and the indices of its touches.
    """

    observed: Observations
    series: tuple[tuple[str, IntArray], ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class SensorModel(ABC):
    """A sensor with effects. Its parameter vector holds the base parameters, then the values of the effects.

    Attributes
    ----------
    observed : Observations or UntimedTouches
        The touches that are predicted.
    peak : (m,) array
        Absolute reading of each element directly under the reference load, the unit of shares.
    reference_load : float
        N/m on a finger, N on a pad.
    effects : tuple of Effect
        Effects in the chain, in the order of their values; they act in the order of the stages.
    load_noise : LoadNoise or None
        What is known of the noise of the force sensor beside the readings, if a fit estimates it; None if it is fixed.
    """

    observed: Rows
    peak: FloatArray
    reference_load: float
    effects: tuple[Effect, ...] = ()
    load_noise: LoadNoise | None = None

    #: Whether consecutive touches are neighbours in location, as in a scan: then a random function of time can fit
    #: any error that depends on location.
    time_is_place: ClassVar[bool] = False
    #: Whether the parameters are fitted again with a correction. False if they can represent the whole correction.
    refitted_with_correction: ClassVar[bool] = True
    #: Stages in which an effect that changes the pose changes a reference stated in the data set.
    reference_stages: ClassVar[tuple[str, ...]] = STAGES

    @property
    @abstractmethod
    def n_base(self) -> int:
        """Number of base parameters."""

    def peak_at(self, vector: FloatArray) -> FloatArray:
        """Absolute signal of each element directly under the reference load, before effects on the signal, (m,)."""
        if not self.effects:
            return self.peak
        recording = self.signal(vector)
        sensitivity = np.abs(recording.signal / recording.load[:, None]).max(axis=0)
        acting = float(np.median(recording.load / self.load))
        return np.asarray(np.maximum(sensitivity, 1e-300) * acting * self.reference_load)

    @abstractmethod
    def poses(self, vector: FloatArray, load: FloatArray | None = None, *, before: Effect | None = None) -> Recording:
        """Touches after the effects on their pose, or those that act `before` one; for loads as read or `load` (t,)."""

    @abstractmethod
    def signal(self, vector: FloatArray, load: FloatArray | None = None) -> Recording:
        """Touches with the signal before element and readout effects, for loads as read or `load` (t,)."""

    @abstractmethod
    def prior(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Prior mean, standard deviation, lower and upper bound of the vector, each (d,)."""

    @abstractmethod
    def reset_to_nominal(self, vector: FloatArray) -> FloatArray | None:
        """The vector with the parameters of the body at nominal values; None if they are near these values already."""

    def derivatives(self, vector: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Derivative of the prediction, (d, t, m) and, where samples differ, (d, n, m)."""
        return self.with_derivatives(vector)[1:]

    @abstractmethod
    def with_derivatives(self, vector: FloatArray) -> tuple[Predicted, FloatArray, FloatArray | None]:
        """The prediction, and its `derivatives`."""

    @abstractmethod
    def correction_basis(self, vector: FloatArray) -> CorrectionBasis:
        """Basis of an empirical correction, over the region that the touches cover."""

    @abstractmethod
    def correction_inputs(self, vector: FloatArray) -> tuple[FloatArray, ...]:
        """Arguments of `CorrectionBasis.columns` for the touches, each (t,)."""

    def possible_touches(self) -> PossibleTouches | None:
        """Possible touches that could distinguish two models; None if no advice can be given."""
        return None

    def zero(self, vector: FloatArray) -> FloatArray:
        """Readings at zero signal, (m,); gains do not multiply them."""
        return np.zeros(self.n_elements)

    @property
    def n_elements(self) -> int:
        """Number of elements m."""
        return len(self.peak)

    @property
    def known(self) -> Observations:
        """`observed` as `Observations`, which have readings; for a model that is fitted."""
        assert isinstance(self.observed, Observations)
        return self.observed

    @cached_property
    def load(self) -> FloatArray:
        """Load as read, (t,), N/m or N.

        Where it was not measured it is the mean of the measured loads, or the reference load if none was measured.
        """
        load = self.observed.load
        there = np.isfinite(load)
        return np.where(there, load, np.nanmean(load) if there.any() else self.reference_load)

    def values(self, vector: FloatArray) -> tuple[Values, ...]:
        """Values of each effect in a vector, which holds the logarithm of values with a log-normal prior."""
        out = []
        for effect, place in zip(self.effects, self.value_places, strict=True):
            moved = zip(effect.parameters, vector[place], strict=True)
            out.append(tuple(parameter.from_unconstrained(float(v)) for parameter, v in moved))
        return tuple(out)

    @cached_property
    def value_places(self) -> tuple[slice, ...]:
        """Where the values of each effect are in the vector."""
        return places_of_values(self.effects, self.n_base)

    def extended(self, vector: FloatArray, values: Values) -> FloatArray:
        """The vector of a model without its last effect, extended by values for that effect."""
        pairs = zip(self.effects[-1].parameters, values, strict=True)
        return np.concatenate([vector, [parameter.to_unconstrained(value) for parameter, value in pairs]])

    def in_order(self, vector: FloatArray) -> list[tuple[Effect, Values]]:
        """Effects with their values, in the order in which they act."""
        pairs = zip(self.effects, self.values(vector), strict=True)
        return sorted(pairs, key=lambda pair: pair[0].order)

    @cached_property
    def value_priors(self) -> FloatArray:
        """Prior mean, sd, lower and upper bound of every value of the effects, (q, 4)."""
        ends = [each.normal_prior for effect in self.effects for each in effect.parameters]
        return np.array(ends, dtype=np.float64).reshape(-1, 4)

    @property
    def by_sample(self) -> bool:
        """Whether predictions differ between the samples of a touch."""
        return any(effect.needs_samples for effect in self.effects)

    def predict(self, vector: FloatArray, load: FloatArray | None = None) -> Predicted:
        """Prediction for the touches, with loads as read or `load` (t,)."""
        return self.readings(self.signal(vector, load), vector)

    def rows(self, recording: Recording) -> Recording:
        """One row per sample if predictions differ between the samples of a touch, else one row per touch."""
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

    def through(self, recording: Recording, vector: FloatArray, first: int = 0) -> FloatArray:
        """Readings of rows after the effects on the signal, (n, m), from `recording.signal` before them.

        `first` is the number of the first effect that acts, in their order.
        """
        for effect, values in self.in_order(vector)[first:]:
            recording = replace(recording, signal=effect.signal(recording, values))
        return recording.signal

    def parted(self, rows: FloatArray) -> Predicted:
        """Readings of `rows` as means of touches and deviations of samples from them."""
        if not self.by_sample:
            return Predicted(rows, None)
        touches = self.observed.of_touches(rows)
        return Predicted(touches, rows - touches[self.observed.row_touch])

    def readings(self, recording: Recording, vector: FloatArray) -> Predicted:
        """Prediction for touches, from their signal before element and readout effects."""
        return self.parted(self.through(self.rows(recording), vector))

    def about_value(self, vector: FloatArray, place: int) -> tuple[FloatArray, FloatArray, float]:
        """Vectors with component `place`, a value of an effect, one step higher and lower; half their difference."""
        _, spread, low, high = (float(each) for each in self.value_priors[place - self.n_base])
        step = VALUE_STEP * min(spread, max(abs(float(vector[place])), 0.1 * spread))
        # The difference is one-sided at a bound.
        up, down = vector.copy(), vector.copy()
        up[place], down[place] = min(vector[place] + step, high), max(vector[place] - step, low)
        return up, down, float(0.5 * (up[place] - down[place]))

    def of_value(self, vector: FloatArray, place: int, at: PredictedAt | None = None) -> Predicted:
        """Derivative of the prediction over the component `place` of the vector, a value of an effect.

        `at` is the prediction as a function of the vector, by default `predict`.
        """
        up, down, step = self.about_value(vector, place)
        at = at or self.predict
        return difference(lambda sign: at(up if sign > 0 else down), step)

    def of_values(self, vector: FloatArray, recording: Recording, at: PredictedAt | None = None) -> list[Predicted]:
        """Derivative of the prediction over each value of the effects.

        Parameters
        ----------
        vector : (d,) array
            Parameters of the model.
        recording : Recording
            The touches with the signal before the effects on the signal.
        at : callable, optional
            The prediction as a function of the vector, by default `predict`. It is needed for effects that change more
            than the signal. For the others, what acts before them is computed once.
        """
        begun = self._before_each(vector, recording)
        out = list[Predicted]()
        for effect, place in zip(self.effects, self.value_places, strict=True):
            ours = range(place.start, place.stop)
            changes_more = effect.changes_pose or effect.changes_finger
            from_here = at or self.predict if changes_more else partial(self._beginning, *begun[effect.name])
            slopes = self.of_basis(effect, vector) if at is None else None
            out += self._of_effect(effect, vector, ours, from_here) if slopes is None else slopes
        return out

    def _before_each(self, vector: FloatArray, recording: Recording) -> dict[str, tuple[int, Recording]]:
        """Number of each effect in the order in which they act, and the rows with the signal before it, by its name."""
        out, recording = dict[str, tuple[int, Recording]](), self.rows(recording)
        for number, (effect, values) in enumerate(self.in_order(vector)):
            out[effect.name] = number, recording
            recording = replace(recording, signal=effect.signal(recording, values))
        return out

    def _beginning(self, first: int, rows: Recording, vector: FloatArray) -> Predicted:
        """Readings from the signal before the effect with the number `first`, which is the first that acts."""
        return self.parted(self.through(rows, vector, first))

    def _of_effect(self, effect: Effect, vector: FloatArray, places: range, at: PredictedAt) -> list[Predicted]:
        """Derivative over the values of one effect.

        If no effect mixes elements from this one on, one difference gives the derivatives over the values of all
        elements.
        """
        own = [i for i, each in zip(places, effect.parameters, strict=True) if each.of_element]
        together: dict[int, Predicted] = {}
        if own and not any(each.mixes for each in self.effects if each.order >= effect.order):
            up, down, steps = vector.copy(), vector.copy(), np.empty(len(own))
            for e, i in enumerate(own):
                higher, lower, steps[e] = self.about_value(vector, i)
                up[i], down[i] = higher[i], lower[i]
            whole = difference(lambda sign: at(up if sign > 0 else down), steps)
            together = {i: of_element(whole, e) for e, i in enumerate(own)}
        return [together[i] if i in together else self.of_value(vector, i, at) for i in places]

    def basis_of(self, effect: Effect, vector: FloatArray) -> FloatArray | None:
        """`Effect.by_place` of an effect at the touches before it; None if it has none or cannot be shifted."""
        if type(effect).shifted is Effect.shifted:
            return None
        return effect.by_place(self.poses(vector, before=effect))

    def shifted(self, effect: Effect, by: FloatArray) -> Self:
        """The model with a shift (t,) of the product of basis and values of an effect; its vector is the same."""
        place = self.effects.index(effect) + 1
        return self.with_effects((*self.effects[:place], Shift(effect, by), *self.effects[place:]))

    def of_basis(self, effect: Effect, vector: FloatArray) -> list[Predicted] | None:
        """Derivative over the values of an effect that act through a basis; None if it has none, see `basis_of`.

        Only one derivative is computed: over the product of basis and values. Those over the values follow from it.
        """
        basis = self.basis_of(effect, vector)
        if basis is None:
            return None
        prior_sd = np.array([each.normal_prior[1] for each in effect.parameters])
        step = VALUE_STEP * np.sqrt(basis**2 @ prior_sd**2)
        step = np.maximum(step, 1e-3 * step.max())
        together = difference(lambda sign: self.shifted(effect, sign * step).predict(vector), 1.0)
        rows = None if together.samples is None else self.observed.row_touch
        return [
            Predicted(
                share[:, None] * together.touches,
                None if together.samples is None else share[rows, None] * together.samples,
            )
            for share in basis.T / step
        ]

    def by_load(self, vector: FloatArray) -> FloatArray:
        """Derivative of the mean readings of each touch over its load, (t, m)."""
        step = LOAD_STEP * self.load
        up, down = (self.predict(vector, self.load + sign * step).touches for sign in (1, -1))
        return np.asarray((up - down) / (2 * step[:, None]))

    def observing(self, observed: Rows) -> Self:
        """The same sensor and effects for other touches."""
        return replace(self, observed=observed)

    def with_readings(self, observed: Rows) -> Self:
        """The same sensor, effects and touches with other readings; what is tabulated for the touches is kept."""
        return replace(self, observed=observed)

    def with_effects(self, effects: tuple[Effect, ...]) -> Self:
        """The same sensor with other effects."""
        return replace(self, effects=effects)


def without_effects(model: SensorModel, vector: FloatArray, names: Collection[str]) -> tuple[SensorModel, FloatArray]:
    """The model without the effects with these names, and its vector without their values."""
    kept = np.ones(len(vector), dtype=bool)
    for effect, place in zip(model.effects, model.value_places, strict=True):
        kept[place] = effect.name not in names
    return model.with_effects(tuple(each for each in model.effects if each.name not in names)), vector[kept]


def deviation_left(deviation: FloatArray, samples: FloatArray | None) -> FloatArray:
    """Deviations of samples from the means of their touches, (n, m), less what is predicted of them, if anything is."""
    return deviation if samples is None else deviation - samples


def difference(at: Callable[[float], Predicted], step: float | FloatArray) -> Predicted:
    """Central difference of a prediction: ``(at(1) - at(-1)) / (2 step)``; the step may differ by element, (m,)."""
    up, down = at(1.0), at(-1.0)
    samples = None
    if up.samples is not None and down.samples is not None:
        samples = (up.samples - down.samples) / (2 * step)
    return Predicted((up.touches - down.touches) / (2 * step), samples)


def of_element(whole: Predicted, element: int) -> Predicted:
    """A derivative for one element; zero for all others."""
    only = np.arange(whole.touches.shape[1]) == element
    samples = None if whole.samples is None else np.where(only, whole.samples, 0.0)
    return Predicted(np.where(only, whole.touches, 0.0), samples)
