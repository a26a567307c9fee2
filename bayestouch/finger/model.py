"""The model of a finger with effects, as a function of one parameter vector, for touches and samples."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.neighbours import calibration_jacobian
from bayestouch.chain.recording import Recording
from bayestouch.contact import composite_radius
from bayestouch.data.sensor import Finger
from bayestouch.effects.effect import Effect
from bayestouch.finger.correction_basis import FingerCorrectionBasis
from bayestouch.finger.derivatives import through_effects
from bayestouch.finger.layout import FlatLayout, FlatPrior
from bayestouch.finger.possible_touches import possible_touches
from bayestouch.finger.series import TouchSeries
from bayestouch.finger.softest_rubber import softest
from bayestouch.model.base import FAR_FROM_PRIOR, LOAD_STEP, PossibleTouches, Predicted, Rows, SensorModel
from bayestouch.model.observations import Observations

# Smallest distance of an element from the surface in a fit, over the thickness of the rubber; at most half the nominal.
NEAREST = 0.05


@dataclass(frozen=True, eq=False, kw_only=True)
class FingerModel(SensorModel):
    """A finger with effects.

    The base parameters are those coordinates of `bayestouch.finger.layout` on which the chain depends: for m elements
    log responses, depths r_s (mm) and angles θ_s (rad), then σ and log μ.

    Attributes
    ----------
    observed, peak, reference_load, effects
        As in `SensorModel`; the reference load in N/m.
    finger : Finger
        Nominal geometry.
    layout : FlatLayout
        Positions of the base parameters.
    flat_prior : FlatPrior or None
        Prior of the base parameters; None if nothing is fitted.
    sign : (m,) array
        1, or -1 for an element whose reading decreases under compression.
    contact : str
        Base contact model.
    largest_load : float
        Largest load for which contacts are tabulated, N/m.
    pose : (3, t) array or None
        Actual composite radius R (mm), location (rad) and load (N/m) of the touches, instead of those in the touch
        table: for touches that are inferred.
    evaluator : TouchSeries or None
        Fast evaluation of the signals of these touches; None evaluates the chain.
    assumed_load : (t,) array or None
        Loads (N/m) of these touches where they were not measured; None for those of `SensorModel.load`.
    """

    finger: Finger
    layout: FlatLayout
    flat_prior: FlatPrior | None
    sign: FloatArray
    contact: str
    largest_load: float
    pose: FloatArray | None = None
    evaluator: TouchSeries | None = None
    assumed_load: FloatArray | None = None

    @property
    def n_base(self) -> int:
        """Number of base parameters."""
        return self.layout.n_chain

    @cached_property
    def load(self) -> FloatArray:
        """Load as read, (t,), N/m; where it was not measured `assumed_load`, or as in `SensorModel`."""
        if self.assumed_load is None:
            return super().load
        return np.where(np.isfinite(self.observed.load), self.observed.load, self.assumed_load)

    def prior(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Prior mean, standard deviation, lower and upper bound of the vector, each (d,)."""
        assert self.flat_prior is not None
        base = slice(0, self.n_base)
        mean, spread = self.flat_prior.mean[base], self.flat_prior.spread[base]
        low, high = (ends[base].copy() for ends in self.flat_prior.bounds)
        log_mu, sigma = self.layout.log_mu, self.layout.sigma
        low[log_mu] = max(low[log_mu], softest(self.finger, self.largest_load, float(low[sigma])))
        # Close to the surface the number of Fourier modes diverges, and with it the size of the table (gigabytes at the
        # bound of the prior, which a step of a fit may try).
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
        """The vector with nominal depths, angles, σ and μ; None if they are near these already.

        Without an effect, a fit can shift parameters far from their nominal values: a bad start for a fit with it.
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
        """The finger with these base parameters, and with the effects that change the finger."""
        changed = tuple((e.name, v) for e, v in zip(self.effects, self.values(vector), strict=True) if e.changes_finger)
        key = (vector[: self.n_base].tobytes(), changed)
        if self._last.get("key") != key:
            self._last.update(key=key, chain=self._chain(vector))
        chain: FingerChain = self._last["chain"]
        return chain

    @cached_property
    def _last(self) -> dict[str, Any]:
        """Cache of the last chain and of the last signals of the fast evaluator.

        They take time to compute, and most calls differ only in effects of the readout.
        """
        return {}

    def _quick(self, vector: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Signals (t, m) of the touches and their derivative over the load, by the fast evaluator.

        None if there is no evaluator, if an effect changes the finger or the poses, or if the vector is outside the
        range of the evaluator.
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
        key = vector[: self.n_base].tobytes()
        if self._last.get("plain_key") != key:
            self._last.update(plain_key=key, plain=self._plain_chain(vector))
        chain: FingerChain = self._last["plain"]
        for effect, values in self.in_order(vector):
            chain = effect.finger(chain, values)
        return chain

    def _plain_chain(self, vector: FloatArray) -> FingerChain:
        at = self.layout
        return FingerChain(
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

    def poses(self, vector: FloatArray, load: FloatArray | None = None, *, before: Effect | None = None) -> Recording:
        """See `SensorModel.poses`."""
        observed = self.observed
        outer = self.finger.outer_radius_mm
        if self.pose is None:
            assert isinstance(observed, Observations) and observed.means.angle_deg is not None
            radius, angle = observed.means.indenter_radius_mm, self.finger.near(observed.means.angle_deg)
            load = self.load if load is None else load
        else:
            composite, angle = self.pose[0], np.degrees(self.pose[1])
            with np.errstate(divide="ignore"):  # a flat is inf, a hollow is negative
                radius = composite * outer / (outer - composite)
            load = self.pose[2] if load is None else load
        recording = Recording(
            indenter_radius_mm=radius,
            place=(angle,),
            load=load,
            time_s=observed.touch_time_s,
            held_s=observed.touch_held_s,
            element_place=(np.asarray(self.finger.element_angles_deg),),
            peak=self.peak_at(vector),
            reference_load=self.reference_load,
            signal=np.zeros((observed.n_touches, self.n_elements)),
            history=observed.history,
        )
        for effect, values in self.in_order(vector):
            if effect is before:
                break
            # Where actual poses are given, effects of the pose have acted. A shift of what the finger is has not.
            if self.pose is None or effect.changes_finger:
                recording = effect.pose(recording, values)
        return recording

    def _radius(self, recording: Recording) -> FloatArray:
        """Composite radius R of each touch, (t,), mm."""
        radius = composite_radius(recording.indenter_radius_mm, self.finger.outer_radius_mm)
        if recording.curvature_per_mm is None:
            return radius
        return np.asarray(radius / (1 + radius * recording.curvature_per_mm))

    def signal(self, vector: FloatArray, load: FloatArray | None = None) -> Recording:
        """Touches with the signal before the effects on the signal, for loads as read or `load` (t,)."""
        return self._evaluated(vector, load)[0]

    def _evaluated(self, vector: FloatArray, load: FloatArray | None = None) -> tuple[Recording, TouchSeries | None]:
        """`signal`, and the fast evaluator at these touches that gave it; None if the chain did."""
        recording = self.poses(vector, load)
        quick = self._quick(vector) if load is None else None
        if quick is not None:
            return replace(recording, signal=quick[0].copy()), self.evaluator
        series = self._series(recording, vector)
        if series is not None:
            return replace(recording, signal=series.signals(vector)), series
        radius, angle = self._radius(recording), np.radians(recording.place[0])
        return replace(recording, signal=self.chain(vector).predict(radius, angle, recording.load)), None

    def _series(self, recording: Recording, vector: FloatArray) -> TouchSeries | None:
        """The fast evaluator at the poses of a recording.

        None if there is no evaluator, if an effect changes the contact or the finger in more than the strain of its
        elements, or if the vector or a touch is outside the range of the evaluator.
        """
        # The evaluator has no knots for the contact of a round edge. It would be used at radius 0, and the chain at any
        # other: a difference between the two is mostly that of their errors.
        beyond = any(
            (e.changes_finger and not (e.changes_strain or e.adds_strain)) or (e.changes_pose and e.stage != "rig")
            for e in self.effects
        )
        if self.evaluator is None or beyond:
            return None
        if not self.evaluator.covers(vector[None, : self.n_base])[0]:
            return None
        mu = float(np.exp(vector[self.layout.log_mu]))
        series = self.evaluator.moved(np.radians(recording.place[0]), recording.load, mu)
        return series and series.with_strain_of([self.chain(vector)])

    def with_derivatives(self, vector: FloatArray) -> tuple[Predicted, FloatArray, FloatArray | None]:
        """See `SensorModel.with_derivatives`; the signal is computed once for both."""
        recording, series = self._evaluated(vector)
        of_signal = self._of_signal(vector, recording, series)
        out = through_effects(self, recording, vector, of_signal)
        out += self.of_values(vector, recording)
        samples = None if out[0].samples is None else np.stack([np.asarray(each.samples) for each in out])
        return self.readings(recording, vector), np.stack([each.touches for each in out]), samples

    def _of_signal(self, vector: FloatArray, recording: Recording, series: TouchSeries | None) -> FloatArray:
        """Derivative of the signal, (5, t, m): over log response, depth and angle of the element, then σ and log μ."""
        if series is not None:
            return series.derivatives(vector[: self.n_base], recording.signal)
        chain = self.chain(vector)
        radius = self._radius(recording)
        of_signal = calibration_jacobian(chain, radius, np.radians(recording.place[0]), recording.load)
        of_signal[0] *= chain.response
        return of_signal

    def by_load(self, vector: FloatArray) -> FloatArray:
        """Derivative of the mean readings of each touch over its load, (t, m)."""
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
        """The same sensor and effects for other touches, without what belongs to the touches: loads, fast evaluator."""
        return self._sharing(replace(self, observed=observed, evaluator=None, assumed_load=None))

    def with_effects(self, effects: tuple[Effect, ...]) -> FingerModel:
        """The same sensor with other effects."""
        return self._sharing(replace(self, effects=effects))

    def correction_basis(self, vector: FloatArray) -> FingerCorrectionBasis:
        """Basis of an empirical correction, over the angles that the touches cover."""
        element, chain = np.degrees(vector[self.layout.angle]), self.chain(vector)
        return FingerCorrectionBasis.of(element, self.peak, self.reference_load, chain, self.poses(vector))

    def correction_inputs(self, vector: FloatArray) -> tuple[FloatArray, ...]:
        """Composite radius (mm), location (degree) and load (N/m) of the touches, all (t,)."""
        recording = self.poses(vector)
        return self._radius(recording), recording.place[0], recording.load

    def possible_touches(self) -> PossibleTouches:
        """Possible touches that could distinguish two models, with the tips, locations and loads that were used."""
        return possible_touches(self.known, self.load)

    def at(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FingerModel:
        """The same model for touches with these actual R (mm), location (rad) and load (N/m), all (t,)."""
        return self._sharing(replace(self, pose=np.stack([radius_mm, angle, load]), evaluator=None))

    def _sharing(self, other: FingerModel) -> FingerModel:
        """The other model, with the cache of this one."""
        other.__dict__["_last"] = self._last
        return other


def finger_model(model: SensorModel) -> FingerModel:
    """The model itself, as a `FingerModel`."""
    assert isinstance(model, FingerModel)
    return model
