"""A calibrated finger before any touch: predictions, noise, and uncertainty of the calibration."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.chain.empirical import pressure_matrix
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.neighbours import Neighbours, calibration_jacobian
from bayestouch.chain.noise import Noise
from bayestouch.data.sensor import finger_of
from bayestouch.errors import InputError
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.empirical.map import EmpiricalCalibration
from bayestouch.finger.place.chain import FingerWithPlaces
from bayestouch.finger.place.posterior import PlacePosterior
from bayestouch.finger.planned import touch_slopes
from bayestouch.finger.reading.covariance import reading_covariance
from bayestouch.finger.reading.places import CovarianceWithPlaces
from bayestouch.finger.reading.reader import CalibratedFinger
from bayestouch.output.summary import Summarised
from bayestouch.results.objects import Calibration

# Unknowns of a touch: R, θ_c and P.
_UNKNOWNS = 3
# The variance of an element without readings, of which only the prior is known, is multiplied by this: nothing is read
# from it, and covariances stay finite.
_UNREAD = 1e8


def require_touches(radius_mm: FloatArray, angle: FloatArray) -> None:
    """Raise an error unless there are radii and finite locations.

    Raises
    ------
    InputError
        There are no radii or no locations, or a location is not finite.
    """
    if not len(radius_mm):
        raise InputError("expected one indenter at least")
    if not len(angle) or not np.isfinite(angle).all():
        raise InputError("expected finite locations, and one at least")


@dataclass(frozen=True, eq=False, repr=False)
class TouchPlaces(Summarised):
    """Possible touches; t of them.

    Attributes
    ----------
    radius_mm, angle, load : (t,) arrays
        Composite radius R (mm), location (rad), line load (N/m).
    """

    radius_mm: FloatArray
    angle: FloatArray
    load: FloatArray

    @classmethod
    def grid(cls, radius_mm: FloatArray, angle: FloatArray, load: float, largest: float = np.inf) -> TouchPlaces:
        """Touches with every radius at every location and one load, ordered by radius.

        Raises
        ------
        InputError
            If there are no radii or no locations, a location is not finite, or the load is not above zero and finite,
            or above the `largest` one.
        """
        require_touches(radius_mm, angle)
        if not (0 < load < np.inf and load <= largest):
            most = f", at most {largest:g}," if np.isfinite(largest) else ","
            raise InputError(f"load: expected above zero{most} in N/m, got {load:g}")
        r, a = (g.ravel() for g in np.meshgrid(radius_mm, angle, indexing="ij"))
        return cls(r, a, np.full(len(r), float(load)))

    @property
    def n_touches(self) -> int:
        """Number of touches t."""
        return len(self.radius_mm)


class CalibrationErrors(Protocol):
    """Uncertainty of a calibration, expressed as errors of the predicted readings."""

    def covariance(self, touches: TouchPlaces) -> FloatArray:
        """Covariance of the readings of each touch, (t, m, m)."""
        ...

    def draw(self, touches: TouchPlaces, n: int, rng: np.random.Generator) -> FloatArray:
        """Errors of n calibrations drawn from the posterior, at all touches, (n, t, m): true minus predicted."""
        ...


@dataclass(frozen=True, eq=False)
class ElasticErrors:
    """Errors of a calibration of the elastic model; a `CalibrationErrors`.

    Attributes
    ----------
    chain : FingerChain
        The finger at the posterior mode.
    parameters : (3 m + 2, 3 m + 2) array
        Covariance of responses, depths (mm), angles (rad), σ, log μ.
    """

    chain: FingerChain
    parameters: FloatArray

    @cached_property
    def _neighbours(self) -> Neighbours:
        return Neighbours.of(self.chain)

    def _jacobian(self, touches: TouchPlaces) -> FloatArray:
        return self._neighbours.jacobian(touches.radius_mm, touches.angle, touches.load)

    def covariance(self, touches: TouchPlaces) -> FloatArray:
        """Covariance of the readings of each touch, (t, m, m)."""
        return reading_covariance(self._jacobian(touches), self.parameters)

    def draw(self, touches: TouchPlaces, n: int, rng: np.random.Generator) -> FloatArray:
        """Errors of n calibrations drawn from the posterior, (n, t, m), to first order."""
        return _drawn(self._jacobian(touches), self.parameters, n, rng)


@dataclass(frozen=True, eq=False)
class PlaceErrors:
    """Errors of a calibration with functions of place; a `CalibrationErrors`.

    Attributes
    ----------
    finger : FingerWithPlaces
        The finger at the posterior mode, with the posterior of its functions of place.
    """

    finger: FingerWithPlaces

    @cached_property
    def _covariance(self) -> CovarianceWithPlaces:
        return CovarianceWithPlaces(self.finger)

    def covariance(self, touches: TouchPlaces) -> FloatArray:
        """Covariance of the readings of each touch, (t, m, m)."""
        return self._covariance(touches.radius_mm, touches.angle, touches.load)

    def draw(self, touches: TouchPlaces, n: int, rng: np.random.Generator) -> FloatArray:
        """Errors of n calibrations drawn from the posterior, (n, t, m), to first order."""
        chain, places = self.finger.elastic, self.finger.places
        touch = self.finger.effective_radius(touches.radius_mm, touches.angle), touches.angle, touches.load
        jacobian, _ = places.jacobian(calibration_jacobian(chain, *touch), chain, touch)
        out = _drawn(jacobian, places.covariance, n, rng)
        own = places.functions.own_columns(places.reference(chain), *touch)
        for e, covariance in enumerate(places.own_covariance):
            out[:, :, e] += rng.standard_normal((n, len(covariance))) @ (own[:, e] @ _root(covariance)).T
        return out


@dataclass(frozen=True, eq=False)
class EmpiricalErrors:
    """Errors of an identified E map; a `CalibrationErrors`.

    Attributes
    ----------
    calibration : EmpiricalCalibration
        Posterior of the map.
    """

    calibration: EmpiricalCalibration

    def covariance(self, touches: TouchPlaces) -> FloatArray:
        """Covariance of the readings of each touch, (t, m, m)."""
        return self.calibration.reading_covariance(touches.radius_mm, touches.angle, touches.load)

    def draw(self, touches: TouchPlaces, n: int, rng: np.random.Generator) -> FloatArray:
        """Errors of n maps drawn from the posterior, (n, t, m); contact parameters (σ, μ) are fixed at the mode."""
        chain = self.calibration.chain
        design = pressure_matrix(chain.elastic, touches.radius_mm, touches.angle, touches.load, chain.n_coefficients)
        out = np.empty((n, touches.n_touches, chain.n_elements))
        for e, covariance in enumerate(self.calibration.covariance):
            out[:, :, e] = rng.standard_normal((n, len(covariance))) @ (design @ _root_by_eigenvalues(covariance)).T
        return out


def _drawn(jacobian: FloatArray, covariance: FloatArray, n: int, rng: np.random.Generator) -> FloatArray:
    """Errors (n, t, m) of n draws of the parameters; jacobian and covariance as in `reading_covariance`."""
    m = jacobian.shape[-1]
    drawn = rng.standard_normal((n, len(covariance))) @ _root(covariance).T
    own = np.einsum("nae,ate->nte", drawn[:, : 3 * m].reshape(n, 3, m), jacobian[:3])
    return np.asarray(own + np.einsum("nr,rte->nte", drawn[:, 3 * m :], jacobian[3:]))


def _root(covariance: FloatArray) -> FloatArray:
    """Matrix L with ``L Lᵀ`` equal to a covariance, which is singular if it is that of few draws."""
    try:
        return np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    except np.linalg.LinAlgError:
        return _root_by_eigenvalues(covariance)


def _root_by_eigenvalues(covariance: FloatArray) -> FloatArray:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


@dataclass(frozen=True, eq=False, repr=False)
class KnownFinger(Summarised):
    """A calibrated finger without any touches.

    Attributes
    ----------
    chain : CalibratedFinger
        Model that predicts the readings.
    noise : Noise
        Noise of one reading of the elements and of the force sensor.
    errors : CalibrationErrors or None
        Uncertainty of the calibration; None if it is exact.
    typical_load : float
        Typical load of a touch, N/m.
    largest_load : float
        Largest load for which the contact is tabulated, N/m.
    load_reads : float, optional
        Number of readings of the force sensor in a touch; by default one with each sample.
    responds : (m,) array, optional
        Whether each element responds to touches: a touch is read by those that do. By default all do.
    """

    chain: CalibratedFinger
    noise: Noise
    errors: CalibrationErrors | None
    typical_load: float
    largest_load: float = np.inf
    load_reads: float | None = None
    responds: BoolArray | None = None

    @classmethod
    def of(cls, calibration: Calibration) -> KnownFinger:
        """Finger from a calibration, with a modelled or an identified E map, or with functions of place.

        The force sensor is read as often in a touch as in those of the calibration.

        Raises
        ------
        InputError
            If the sensor is a pad, or the calibration has effects.
        """
        finger_of(calibration.sensor, "reading a radius")
        if calibration.has_effects:
            raise InputError(
                "there are no maps of a calibration with effects, because effects may change the readings from touch "
                "to touch; bayestouch.next_touches plans touches with such a calibration"
            )
        elastic = finger_chain(calibration)
        further = (
            float(calibration.settings["typical_load"]),
            float(calibration.settings.get("largest_load", np.inf)),
            calibration.rows.usual_load_reads,
            calibration.rows.responds,
        )
        if calibration.has_identified_map:
            empirical = EmpiricalCalibration.from_arrays(calibration.extra, elastic, calibration.noise)
            return cls(empirical.chain, calibration.noise, EmpiricalErrors(empirical), *further)
        places = PlacePosterior.from_arrays(calibration.extra)
        if places is not None:
            finger = FingerWithPlaces(elastic, places)
            return cls(finger, calibration.noise, PlaceErrors(finger), *further)
        return cls(elastic, calibration.noise, ElasticErrors(elastic, calibration.covariance), *further)

    @property
    def n_elements(self) -> int:
        """Number of elements m."""
        return len(self.noise.tactile_sd)

    @property
    def read_elements(self) -> BoolArray:
        """Whether a touch is read by each element, (m,)."""
        return np.full(self.n_elements, True) if self.responds is None else self.responds

    @property
    def outer_radius_mm(self) -> float:
        """Outer radius ``r_b``, mm."""
        return self.chain.outer_radius_mm

    def predict(self, touches: TouchPlaces) -> FloatArray:
        """Expected readings, (t, m)."""
        return np.asarray(self.chain.predict(touches.radius_mm, touches.angle, touches.load))

    def noise_variance(self, samples: int) -> FloatArray:
        """Variance of the mean of `samples` readings, discrepancy included, (m,); huge for an element without readings.

        Raises
        ------
        InputError
            If there is not one sample at least.
        """
        if not samples >= 1:
            raise InputError(f"samples: expected 1 or more, got {samples:g}")
        variance = self.noise.mean_sd(np.full(self.n_elements, samples), np.zeros(self.n_elements)) ** 2
        return np.where(self.read_elements, variance, _UNREAD * variance)

    def covariance(self, touches: TouchPlaces, samples: int) -> FloatArray:
        """Covariance of the readings of each touch about the prediction, from noise and calibration, (t, m, m)."""
        total = np.zeros((touches.n_touches, self.n_elements, self.n_elements))
        if self.errors is not None:
            total += self.errors.covariance(touches)
        index = np.arange(self.n_elements)
        total[:, index, index] += self.noise_variance(samples)
        return total

    def load_sd(self, samples: int, use_load: bool) -> float:
        """Standard error of the measured load, N/m; inf if it is not used or there is no force sensor."""
        sd = float(self.noise.mean_load_sd(samples if self.load_reads is None else self.load_reads))
        return sd if use_load and np.isfinite(sd) and sd > 0 else float(np.inf)

    def check_unknowns(self, use_load: bool) -> None:
        """Raise an error unless a touch has as many readings as unknowns, which are R, θ_c and P.

        Raises
        ------
        InputError
            If there are fewer: then no error of an estimate is finite.
        """
        readings = int(self.read_elements.sum()) + int(np.isfinite(self.load_sd(1, use_load)))
        if readings < _UNKNOWNS:
            raise InputError(
                f"a touch has {readings} readings, with the load if it is read, for {_UNKNOWNS} unknowns (radius, "
                "location, load): a finger needs more elements, or the load"
            )

    def touch_jacobian(self, touches: TouchPlaces) -> FloatArray:
        """Derivative of the readings with respect to R (mm), θ_c (rad), P (N/m); (t, m, 3)."""
        return touch_slopes(self.chain.predict, touches.radius_mm, touches.angle, touches.load)
