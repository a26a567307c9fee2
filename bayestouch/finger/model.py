"""The chain of a finger with effects, as a function of one flat vector, for touches and samples."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.neighbours import calibration_jacobian
from bayestouch.chain.recording import Recording
from bayestouch.contact import composite_radius
from bayestouch.contact.layer import LayerContact
from bayestouch.data.sensor import Finger
from bayestouch.effects.effect import Effect
from bayestouch.finger.correction_basis import FingerCorrectionBasis
from bayestouch.finger.derivatives import through_effects
from bayestouch.finger.layout import FlatLayout, FlatPrior
from bayestouch.finger.possible_touches import possible_touches
from bayestouch.finger.series import TouchSeries
from bayestouch.model.base import FAR_FROM_PRIOR, LOAD_STEP, PossibleTouches, Rows, SensorModel
from bayestouch.model.observations import Observations

# How near to the surface a fit may take an element, as a share of the rubber; or half as near as it was built.
NEAREST = 0.05
# How near to the end of the table of contacts, which is further the higher Poisson's ratio is.
SHORT_OF_THE_END = 0.95


@dataclass(frozen=True, eq=False, kw_only=True)
class FingerModel(SensorModel):
    """A finger with effects.

    Base parameters are those of `bayestouch.finger.layout` that the chain depends on: for m elements log
    responses, depths r_s (mm) and angles θ_s (rad), then σ and log μ.

    Attributes
    ----------
    observed, peak, reference_load, effects
        As `SensorModel`; the reference load in N/m.
    finger : Finger
        As built.
    layout : FlatLayout
        What stands where among the base parameters.
    flat_prior : FlatPrior or None
        Their prior; None where nothing is fitted.
    sign : (m,) array
        1, or -1 for an element whose reading falls when it is squeezed.
    contact : str
        Base contact model.
    largest_load : float
        Up to which contacts are tabulated, N/m.
    pose : (3, t) array or None
        Composite radius R (mm), location (rad) and load (N/m) as they really are, in place of what the table says:
        for touches that are read, not known.
    evaluator : TouchSeries or None
        Signals of just these touches, quickly; None evaluates the chain.
    """

    finger: Finger
    layout: FlatLayout
    flat_prior: FlatPrior | None
    sign: FloatArray
    contact: str
    largest_load: float
    pose: FloatArray | None = None
    evaluator: TouchSeries | None = None

    @property
    def n_base(self) -> int:
        """Number of base parameters."""
        return self.layout.n_chain

    def prior(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Mean, standard deviation, lower and upper bound of the vector."""
        assert self.flat_prior is not None
        base = slice(0, self.n_base)
        mean, spread = self.flat_prior.mean[base], self.flat_prior.spread[base]
        low, high = (ends[base].copy() for ends in self.flat_prior.bounds)
        # Softer rubber, on which a flat would take a quarter of the circumference, has no linear contact.
        radii = (self.finger.core_radius_mm, self.finger.outer_radius_mm)
        softest = self.largest_load / 1000 * radii[1] / _widest_kappa(radii, float(low[self.layout.sigma]))
        low[self.layout.log_mu] = max(low[self.layout.log_mu], np.log(softest))
        # Under the very surface an element sees waves without end, and its table grows with them: gigabytes at the
        # prior's bound, where a step of a fit may try anything.
        depth, outer = self.layout.depth, self.finger.outer_radius_mm
        skin = np.minimum(NEAREST * (outer - self.finger.core_radius_mm), 0.5 * np.maximum(outer - mean[depth], 0.0))
        high[depth] = np.minimum(high[depth], outer - skin)
        more = self.value_priors.T
        return (
            np.concatenate([mean, more[0]]),
            np.concatenate([spread, more[1]]),
            np.concatenate([low, more[2]]),
            np.concatenate([high, more[3]]),
        )

    def peak_at(self, vector: FloatArray) -> FloatArray:
        """See `SensorModel.peak_at`; on a finger the response is a parameter."""
        if not self.effects:
            return self.peak
        return np.asarray(np.exp(vector[self.layout.response]) * self.reference_load)

    def reset_to_nominal(self, vector: FloatArray) -> FloatArray | None:
        """The vector with depths, angles, σ and μ as built; None where they are near that already.

        What a missing effect has driven far off is no place to start from once the effect is there.
        """
        assert self.flat_prior is not None
        mean, spread, _, _ = self.prior()
        far = np.abs(vector - mean) / spread
        far[self.layout.response] = 0.0
        far[self.n_base :] = 0.0
        if far.max() < FAR_FROM_PRIOR:
            return None
        home = vector.copy()
        rest = slice(self.n_elements, self.n_base)
        home[rest] = mean[rest]
        return home

    def chain(self, vector: FloatArray) -> FingerChain:
        """The finger at these base parameters, with the effects that change it."""
        changed = tuple((e.name, v) for e, v in zip(self.effects, self.values(vector), strict=True) if e.changes_finger)
        key = (vector[: self.n_base].tobytes(), changed)
        if self._last.get("key") != key:
            self._last.update(key=key, chain=self._chain(vector))
        chain: FingerChain = self._last["chain"]
        return chain

    @cached_property
    def _last(self) -> dict[str, Any]:
        """The chain that was asked for last, and the signals of the quick evaluator.

        They are dear, and most calls differ in effects of the readout.
        """
        return {}

    def _quick(self, vector: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Signals (t, m) of the touches and their derivative over the load, by the quick evaluator.

        None where there is none, where an effect changes the finger or the poses, and beyond the parameters that it
        is good for.
        """
        if self.evaluator is None or any(e.changes_finger or e.changes_pose for e in self.effects):
            return None
        base = vector[None, : self.n_base]
        key = base.tobytes()
        if self._last.get("quick_key") != key:
            found = None
            if self.evaluator.covers(base)[0]:
                signal, slope = self.evaluator(base)
                found = (signal[0], slope[0])
            self._last.update(quick_key=key, quick=found)
        quick: tuple[FloatArray, FloatArray] | None = self._last["quick"]
        return quick

    def _chain(self, vector: FloatArray) -> FingerChain:
        at = self.layout
        chain = FingerChain(
            core_radius_mm=self.finger.core_radius_mm,
            outer_radius_mm=self.finger.outer_radius_mm,
            response=self.sign * np.exp(vector[at.response]),
            sensing_radius_mm=vector[at.depth],
            angle=vector[at.angle],
            offset=np.zeros(self.n_elements),
            poisson_ratio=float(vector[at.sigma]),
            shear_modulus_MPa=float(np.exp(vector[at.log_mu])),
            largest_load=self.largest_load,
            contact=self.contact,
        )
        for effect, values in self.in_order(vector):
            chain = effect.finger(chain, values)
        return chain

    def poses(self, vector: FloatArray, load: FloatArray | None = None) -> Recording:
        """Touches as they really were."""
        observed = self.observed
        outer = self.finger.outer_radius_mm
        if self.pose is None:
            assert isinstance(observed, Observations) and observed.means.angle_deg is not None
            radius, angle = observed.means.indenter_radius_mm, observed.means.angle_deg
            load = self.load if load is None else load
        else:
            composite, angle = self.pose[0], np.degrees(self.pose[1])
            radius = composite * outer / np.maximum(outer - composite, 1e-9)
            load = self.pose[2] if load is None else load
        recording = Recording(
            indenter_radius_mm=radius,
            place=(angle,),
            load=load,
            time_s=observed.touch_time_s,
            held_s=observed.of_touches(observed.held_s),
            element_place=(np.asarray(self.finger.element_angles_deg),),
            peak=self.peak,
            reference_load=self.reference_load,
            signal=np.zeros((observed.n_touches, self.n_elements)),
            history=observed.history,
        )
        if self.pose is None:
            for effect, values in self.in_order(vector):
                recording = effect.pose(recording, values)
        return recording

    def signal(self, vector: FloatArray, load: FloatArray | None = None) -> Recording:
        """Touches with the signal that leaves the body."""
        recording = self.poses(vector, load)
        quick = self._quick(vector) if load is None else None
        if quick is not None:
            return replace(recording, signal=quick[0].copy())
        chain = self.chain(vector)
        radius = composite_radius(recording.indenter_radius_mm, self.finger.outer_radius_mm)
        return replace(recording, signal=chain.predict(radius, np.radians(recording.place[0]), recording.load))

    def derivatives(self, vector: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Derivative of the prediction, (d, t, m) and, where samples differ, (d, n, m)."""
        recording = self.signal(vector)
        of_signal = self._of_signal(vector, recording)
        out = through_effects(self, recording, vector, of_signal)
        out += [self.of_value(vector, i) for i in range(self.n_base, len(vector))]
        samples = None if out[0].samples is None else np.stack([np.asarray(each.samples) for each in out])
        return np.stack([each.touches for each in out]), samples

    def _of_signal(self, vector: FloatArray, recording: Recording) -> FloatArray:
        """Derivative of the signal, (5, t, m): over own log response, depth and angle, then σ and log μ."""
        if self.evaluator is not None and self._quick(vector) is not None:
            return self.evaluator.derivatives(vector[: self.n_base])
        chain = self.chain(vector)
        radius = composite_radius(recording.indenter_radius_mm, self.finger.outer_radius_mm)
        of_signal = calibration_jacobian(chain, radius, np.radians(recording.place[0]), recording.load)
        of_signal[0] *= chain.response
        return of_signal

    def by_load(self, vector: FloatArray) -> FloatArray:
        """Derivative of the readings of each touch over its load, (t, m)."""
        quick = self._quick(vector)
        if quick is not None and not self.effects:
            return quick[1]
        load = self.load if self.pose is None else self.pose[2]
        step = LOAD_STEP * load

        def at(sign: float) -> FloatArray:
            if quick is None:
                return self.predict(vector, load + sign * step).touches
            recording = self.signal(vector)
            signal = recording.signal + sign * step[:, None] * quick[1]
            moved = replace(recording, load=recording.load + sign * step, signal=signal)
            return self.readings(moved, vector).touches

        return np.asarray((at(1.0) - at(-1.0)) / (2 * step[:, None]))

    def observing(self, observed: Rows) -> FingerModel:
        """The same sensor and effects for other touches, which the quick evaluator does not know."""
        return self._sharing(replace(self, observed=observed, evaluator=None))

    def with_effects(self, effects: tuple[Effect, ...]) -> FingerModel:
        """The same sensor under other effects."""
        return self._sharing(replace(self, effects=effects))

    def correction_basis(self, vector: FloatArray) -> FingerCorrectionBasis:
        """Basis of a correction without a cause, over the angles that the touches cover."""
        element, outer = np.degrees(vector[self.layout.angle]), self.finger.outer_radius_mm
        return FingerCorrectionBasis.of(element, self.peak, self.reference_load, outer, self.poses(vector))

    def correction_inputs(self, vector: FloatArray) -> tuple[FloatArray, ...]:
        """Composite radius (mm), location (degree) and load (N/m) of the touches, all (t,)."""
        recording = self.poses(vector)
        radius = composite_radius(recording.indenter_radius_mm, self.finger.outer_radius_mm)
        return radius, recording.place[0], recording.load

    def possible_touches(self) -> PossibleTouches:
        """Touches that could decide between two models: the tips, locations and loads that were used."""
        return possible_touches(self.known, self.load)

    def at(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FingerModel:
        """The same for touches that really are of composite radius R (mm), location (rad) and load (N/m), all (t,)."""
        return self._sharing(replace(self, pose=np.stack([radius_mm, angle, load]), evaluator=None))

    def _sharing(self, other: FingerModel) -> FingerModel:
        """The other model, which need not solve again what was solved last."""
        other._last.update(self._last)
        return other


@lru_cache(maxsize=8)
def _widest_kappa(radii_mm: tuple[float, float], poisson_ratio: float) -> float:
    """κ (mm²) of the widest contact that a fit may try, on a body of this Poisson's ratio or any higher."""
    return SHORT_OF_THE_END * float(
        min(LayerContact.for_body(*radii_mm, poisson_ratio).kappas[-1], 10 * radii_mm[1] ** 2)
    )


def finger_model(model: SensorModel) -> FingerModel:
    """The same model, which must be that of a finger."""
    assert isinstance(model, FingerModel)
    return model
