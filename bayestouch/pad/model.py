"""The model of a pad with effects, as a function of one parameter vector, for touches and samples.

The base parameters are those of `bayestouch.chain.pad.PadChain.flat` (logarithms where the prior is log-normal), then
the weights of the empirical map, if the pad has one:

    signal_e = P [gain_e K(|x - x_e|) + map_e(x)],    reading = offset + (signal after the effects)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import PadChain
from bayestouch.chain.places import Places
from bayestouch.chain.recording import Recording
from bayestouch.effects.effect import Effect
from bayestouch.model.base import Predicted, SensorModel
from bayestouch.model.observations import Observations
from bayestouch.pad.correction_basis import PadCorrectionBasis
from bayestouch.pad.map_basis import HeldMap, MapBasis
from bayestouch.priors.parameters import LogNormal, Normal, Prior

# Step of the central difference of a reading over the signal, over the peak.
SIGNAL_STEP = 1e-4
# Bound of a log-normal parameter, in sd of its logarithm.
FARTHEST = 8.0


@dataclass(frozen=True, eq=False, kw_only=True)
class PadModel(SensorModel):
    """A pad with effects.

    Attributes
    ----------
    observed, peak, reference_load, effects
        As in `SensorModel`; loads in N, or relative to those of the calibration if they were not measured.
    pad : PadChain
        Chain with the kernel and the number of parameters; its values are not used.
    priors : tuple of Prior
        Prior of each entry of `PadChain.flat`.
    element_place : tuple of (m,) arrays
        Nominal locations of the elements, mm.
    map : MapBasis, HeldMap or None
        Empirical map, `HeldMap` if its weights are not parameters; None for a kernel without a map.
    """

    pad: PadChain
    priors: tuple[Prior, ...]
    element_place: tuple[FloatArray, ...]
    map: MapBasis | HeldMap | None = None

    # Pads are scanned.
    time_is_place: ClassVar[bool] = True
    # The map can represent any correction: the touches do not determine both together.
    refitted_with_correction: ClassVar[bool] = False
    # The response to a stated load includes everything between force sensor and elements (e.g. the threshold of
    # `load_nonlinearity`): only effects of the rig change references.
    reference_stages: ClassVar[tuple[str, ...]] = ("rig",)

    @property
    def n_chain(self) -> int:
        """Number of parameters of the chain: gains, offsets, positions, kernel."""
        return len(self.priors)

    @property
    def n_base(self) -> int:
        """Number of base parameters: chain and map."""
        return self.n_chain + (0 if self.map is None else self.map.n_weights)

    @cached_property
    def _logarithmic(self) -> NDArray[np.bool_]:
        return np.array([isinstance(prior, LogNormal) for prior in self.priors])

    def start(self, chain: PadChain) -> FloatArray:
        """Vector (d,) of a pad without effects, with a map of zero."""
        flat = np.where(self._logarithmic, np.log(np.where(self._logarithmic, chain.flat, 1.0)), chain.flat)
        return np.concatenate([flat, np.zeros(self.n_base - self.n_chain)])

    def chain(self, vector: FloatArray) -> PadChain:
        """The chain with these base parameters, without the map."""
        return self.pad.with_flat(self._flat(vector))

    def _flat(self, vectors: FloatArray) -> FloatArray:
        """Values of the chain, (..., n_chain), in vectors (..., d)."""
        flat = vectors[..., : self.n_chain]
        return np.where(self._logarithmic, np.exp(np.where(self._logarithmic, flat, 0.0)), flat)

    def prior(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Prior mean, standard deviation, lower and upper bound of the vector, each (d,)."""
        weights = np.tile([0.0, 1.0, -np.inf, np.inf], (self.n_base - self.n_chain, 1))
        own = np.array([_normal(prior) for prior in self.priors])
        mean, spread, low, high = np.concatenate([own, weights, self.value_priors]).T
        return mean, spread, low, high

    def reset_to_nominal(self, vector: FloatArray) -> FloatArray | None:
        """None: the touches determine gains and positions of a pad with any effects."""
        return None

    def correction_basis(self, vector: FloatArray) -> PadCorrectionBasis:
        """Basis of an empirical correction, over the region that the touches cover."""
        return PadCorrectionBasis.of(self.chain(vector), self.peak, self.reference_load, self.poses(vector))

    def correction_inputs(self, vector: FloatArray) -> tuple[FloatArray, ...]:
        """Location (t, D), mm, and load (t,), N, of the touches."""
        recording = self.poses(vector)
        return np.stack(recording.place, axis=1), recording.load

    def poses(self, vector: FloatArray, load: FloatArray | None = None, *, before: Effect | None = None) -> Recording:
        """See `SensorModel.poses`."""
        observed = self.observed
        assert isinstance(observed, Observations)
        recording = Recording(
            indenter_radius_mm=observed.means.indenter_radius_mm,
            place=self._stated_axes,
            load=self.load if load is None else load,
            time_s=observed.touch_time_s,
            held_s=observed.touch_held_s,
            element_place=self.element_place,
            peak=self.peak,
            reference_load=self.reference_load,
            signal=np.zeros((observed.n_touches, self.n_elements)),
            history=observed.history.above(self.zero(vector)),
        )
        for effect, values in self.in_order(vector):
            if effect is before:
                break
            recording = effect.pose(recording, values)
        return recording

    def signal(self, vector: FloatArray, load: FloatArray | None = None) -> Recording:
        """Touches with the signal before the effects on the signal, for loads as read or `load` (t,)."""
        recording = self.poses(vector, load)
        places = self._places(recording)
        return self._pressed(recording, places, places.values(self.chain(vector).sensitivity), vector)

    def _pressed(self, recording: Recording, places: Places, response: FloatArray, vector: FloatArray) -> Recording:
        """Touches with the signal, from the response of the chain per unit load, (t, m)."""
        weights = vector[self.n_chain : self.n_base]
        if isinstance(self.map, MapBasis) and places is self._stated_places:
            response = response + self.map.summed(self._stated_functions, weights)
        elif self.map is not None:
            response = response + self.map.sensitivity(places.location, weights)
        return replace(recording, signal=recording.load[:, None] * response)

    @cached_property
    def _stated_places(self) -> Places:
        return Places.of(np.stack(self._stated_axes, axis=1))

    @cached_property
    def _stated_functions(self) -> list[FloatArray]:
        """Functions of the map at the stated locations."""
        assert isinstance(self.map, MapBasis)
        return self.map.functions(self._stated_places.location)

    @property
    def _stated_axes(self) -> tuple[FloatArray, ...]:
        means = self.known.means
        axes = [axis for axis in (means.x_mm, means.y_mm) if axis is not None]
        return tuple(axes[: len(self.element_place)])

    def _places(self, recording: Recording) -> Places:
        """Locations of the touches: those that are stated, unless an effect moves a touch."""
        if all(one is two for one, two in zip(recording.place, self._stated_axes, strict=True)):
            return self._stated_places
        return Places.of(np.stack(recording.place, axis=1))

    def predict(self, vector: FloatArray, load: FloatArray | None = None) -> Predicted:
        """Prediction for the touches: effects act on the signal; then the offsets of the elements are added."""
        return self._with_zero(self.signal(vector, load), vector)

    def predictions(self, vectors: FloatArray) -> Iterator[Predicted]:
        """`predict` at each of vectors (n, d); the response of the chain is computed for all of them together."""
        places = self._stated_places
        for vector, response in zip(vectors, self.pad.sensitivities(self._flat(vectors), places.distinct), strict=True):
            yield self._predicted(vector, places, places.copied(response))

    def _predicted(self, vector: FloatArray, places: Places, response: FloatArray) -> Predicted:
        """`predict`, from the response (t, m) of the chain at places, if no effect moves the touches elsewhere."""
        recording = self.poses(vector)
        if self._places(recording) is not places:
            return self.predict(vector)
        return self._with_zero(self._pressed(recording, places, response, vector), vector)

    def _with_zero(self, signal: Recording, vector: FloatArray) -> Predicted:
        from_signal = self.readings(signal, vector)
        return Predicted(from_signal.touches + self.zero(vector), from_signal.samples)

    def zero(self, vector: FloatArray) -> FloatArray:
        """Readings at zero signal, (m,): the offsets of the elements."""
        m = self.n_elements
        return self._flat(vector)[m : 2 * m]

    def with_derivatives(self, vector: FloatArray) -> tuple[Predicted, FloatArray, FloatArray | None]:
        """The prediction, and its `derivatives`; the response of the chain is computed once for both."""
        recording = self.poses(vector)
        places = self._places(recording)
        response = places.values(self.chain(vector).sensitivity)
        recording = self._pressed(recording, places, response, vector)
        rows = self.rows(recording)
        of_signal = self._of_base(vector, recording)
        if self.by_sample:
            of_signal = of_signal[:, self.observed.row_touch]
        slope = self._slope(rows, vector)
        mixed = slope.ndim == 3
        by_row = np.einsum("dni,nij->dnj", of_signal, slope, optimize=True) if mixed else of_signal * slope
        m = self.n_elements
        # Of the offsets, or of their logarithms.
        by_offset = np.where(self._logarithmic[m : 2 * m], self.zero(vector), 1.0)
        by_row[m : 2 * m] = np.eye(m)[:, None, :] * (by_offset * self._by_zero(rows, vector))
        parts = [self.parted(each) for each in by_row]
        # The values of effects do not change the response of the chain.
        parts += self.of_values(vector, recording, lambda moved: self._predicted(moved, places, response))
        samples = None if not self.by_sample else np.stack([np.asarray(each.samples) for each in parts])
        return self._with_zero(recording, vector), np.stack([each.touches for each in parts]), samples

    def _of_base(self, vector: FloatArray, recording: Recording) -> FloatArray:
        """Derivative of the signal over the base parameters, (d, t, m); zero for the offsets."""
        places, load = self._places(recording), recording.load[:, None]
        chain = self.chain(vector)
        own = np.moveaxis(places.values(chain.sensitivity_derivatives), -1, 0) * load
        own[self._logarithmic] *= chain.flat[self._logarithmic][:, None, None]
        if self.map is None:
            return np.asarray(own)
        return np.concatenate([own, self.map.columns(places.location) * load])

    def _by_zero(self, rows: Recording, vector: FloatArray) -> FloatArray:
        """Derivative of the readings of rows over the zero of their element, (n, m): less if earlier touches remain."""
        history = rows.history
        if history is None or not any(effect.remembers for effect in self.effects):
            return np.ones_like(rows.signal)
        step = SIGNAL_STEP * self.peak

        def at(zero: FloatArray) -> FloatArray:
            return self.through(replace(rows, history=history.above(zero)), vector)

        return np.asarray(1 + (at(step) - at(-step)) / (2 * step))

    def _slope(self, rows: Recording, vector: FloatArray) -> FloatArray:
        """Derivative of the readings over the signals: (n, m), or (n, signal, reading) if an effect mixes elements."""
        step = SIGNAL_STEP * float(self.peak.mean())

        def at(moved: FloatArray) -> FloatArray:
            up, down = (self.through(replace(rows, signal=rows.signal + s * moved), vector) for s in (1, -1))
            return np.asarray((up - down) / (2 * step))

        if not self.effects:
            return np.ones_like(rows.signal)
        if not any(effect.mixes for effect in self.effects):
            return at(np.full_like(rows.signal, step))
        one = np.eye(self.n_elements) * step
        return np.stack([at(np.broadcast_to(row, rows.signal.shape)) for row in one], axis=1)


def _normal(prior: Prior) -> tuple[float, float, float, float]:
    """Mean, sd, lower and upper bound of the coordinate used in fits; the sd of a flat prior is its width."""
    low, high = prior.support
    if isinstance(prior, LogNormal):
        middle = float(np.log(prior.median))
        # Without these bounds, a step of a fit could make the length of a kernel zero in double precision.
        return middle, prior.spread, middle - FARTHEST * prior.spread, middle + FARTHEST * prior.spread
    if isinstance(prior, Normal):
        return prior.mean, prior.sd, low, high
    return 0.5 * (low + high), high - low, low, high
