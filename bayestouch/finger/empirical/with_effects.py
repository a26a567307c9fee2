"""Identification of an E map for a finger with effects, from the signals before the effects.

The effects are fitted with the elastic model and linearised near the signals of the touches. The readings of each touch
then give its signals before the effects and their standard deviations, and E is identified from these. Where a reading
hardly depends on its signal, as in saturation, the signal has a large standard deviation and a small weight. Drifts are
estimated again with the map.

The derivative of the fitted map over each value of the effects is stored with the map, so that the posteriors of
touches include the uncertainty of the effects.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.contact import composite_radius
from bayestouch.finger.derivatives import by_signal
from bayestouch.finger.empirical.calibration import EmpiricalFit, identified_map
from bayestouch.finger.empirical.map import MapNeighbours
from bayestouch.finger.empirical.touches import MapTouches, SharedParameter, contact_parameters
from bayestouch.finger.model import FingerModel, finger_model
from bayestouch.model.fitting import Fitted

# Standard deviation, over the peak, of a signal that the readings do not determine.
UNTOLD = 100.0


def identify_beside_effects(fitted: Fitted, noise: Noise, shared_covariance: FloatArray) -> EmpiricalFit:
    """E identified from the touches of a fit with effects.

    Parameters
    ----------
    fitted : Fitted
        The elastic finger with its effects.
    noise : Noise
        Noise of the calibration.
    shared_covariance : (s, s) array
        Covariance of σ, log μ and the values of the effects of the chain.
    """
    model, vector = finger_model(fitted.model), fitted.vector
    of_model = _Unmixed(fitted, noise, model.signal(vector).signal, fitted.drifted)
    first = identified_map(of_model.touches(vector), (), np.zeros((0, 0)))
    # Effects are linearised at the signals of the map, which are more accurate than those of the model.
    of_map = _Unmixed(fitted, noise, first.predicted, _course(fitted, first.predicted))
    touches = of_map.touches(vector)
    effects = [
        SharedParameter(near, (of_map.touches(up), of_map.touches(down)))
        for near, up, down in _about_values(model, vector)
    ]
    found = identified_map(touches, (*contact_parameters(touches), *effects), shared_covariance)
    predicted = of_map.readings(vector, found.predicted) + _course(fitted, found.predicted)
    return replace(found, predicted=predicted, sd=np.sqrt(of_map.variance * found.lack_of_fit))


def effect_neighbours(model: FingerModel, vector: FloatArray) -> tuple[MapNeighbours, ...]:
    """Fingers at one step above and below in each value of the effects of the chain."""
    return tuple(near for near, _, _ in _about_values(model, vector))


def _about_values(model: FingerModel, vector: FloatArray) -> list[tuple[MapNeighbours, FloatArray, FloatArray]]:
    """For each value of the effects: fingers at one step above and below, and the two vectors."""
    elastic, out = model.chain(vector), []
    for effect, place in zip(model.effects, model.value_places, strict=True):
        for i in range(place.start, place.stop):
            up, down, step = model.about_value(vector, i)
            sides = (model.chain(up), model.chain(down)) if effect.changes_finger else (elastic, elastic)
            out.append((MapNeighbours(((sides[0], 1.0), (sides[1], 1.0)), step), up, down))
    return out


def _course(fitted: Fitted, signal: FloatArray) -> FloatArray:
    """Contribution of drifts to the mean readings (t, m), estimated for touches with these signals."""
    functions = fitted.linear.functions
    if functions is None:
        return np.zeros_like(signal)
    model = finger_model(fitted.model)
    static = model.readings(replace(model.poses(fitted.vector), signal=signal), fitted.vector).touches
    residual = fitted.whitening.touches(model.known.means.readings - static)
    return np.asarray(np.tensordot(functions.weights(residual.reshape(-1, 1))[:, 0], functions.raw, axes=1))


@dataclass(frozen=True, eq=False)
class _Unmixed:
    """Touches with the effects removed, linearised at given signals.

    Attributes
    ----------
    fitted : Fitted
        The elastic finger with its effects.
    noise : Noise
        Noise of the calibration.
    about : (t, m) array
        Signals at which the effects are linearised.
    course : (t, m) array
        Contribution of drifts to the readings.
    """

    fitted: Fitted
    noise: Noise
    about: FloatArray
    course: FloatArray

    def readings(self, vector: FloatArray, signal: FloatArray) -> FloatArray:
        """Mean readings (t, m) for mean signals (t, m), without drifts."""
        model = finger_model(self.fitted.model)
        return model.readings(replace(model.poses(vector), signal=signal), vector).touches

    @cached_property
    def variance(self) -> FloatArray:
        """Variance of each mean reading about the prediction, (t, m); inf where missing."""
        fitted, means = self.fitted, self.fitted.model.known.means
        there = self.fitted.whitening.present
        predicted = self.readings(fitted.vector, self.about) + self.course
        own = fitted.noise.variance(predicted, np.where(there, means.counts, 1))
        by_load = fitted.model.by_load(fitted.vector) * fitted.noise.load_sd[:, None]
        return np.where(there, own + by_load**2 + self._course_variance(), np.inf)

    def _course_variance(self) -> FloatArray:
        functions = self.fitted.linear.functions
        if functions is None:
            return np.zeros_like(self.course)
        rows = solve_triangular(functions.root, functions.raw.reshape(len(functions.raw), -1), lower=True)
        return np.asarray((rows**2).sum(axis=0).reshape(self.course.shape))

    def touches(self, vector: FloatArray) -> MapTouches:
        """The touches with actual poses and with the signals before the effects, for the values in `vector`."""
        model, means = finger_model(self.fitted.model), self.fitted.model.known.means
        assert model.flat_prior is not None
        there, variance = self.fitted.whitening.present, self.variance
        recording = replace(model.poses(vector), signal=self.about)
        residual = np.where(there, means.readings - self.readings(vector, self.about) - self.course, 0.0)
        jacobian = by_signal(model, recording, vector)
        pull = np.swapaxes(jacobian, 1, 2) / variance[:, None]
        untold = np.diag(1 / (UNTOLD * model.peak) ** 2)
        covariance = np.linalg.inv(pull @ jacobian + untold)
        signal = self.about + (covariance @ pull @ residual[:, :, None])[:, :, 0]
        sd = np.sqrt(np.einsum("tii->ti", covariance))
        outer = model.finger.outer_radius_mm
        return MapTouches(
            elastic=model.chain(vector),
            prior=model.flat_prior,
            radius_mm=composite_radius(recording.indenter_radius_mm, outer),
            angle=np.radians(recording.place[0]),
            load=recording.load,
            signal=np.where(there, signal, np.nan),
            sd=np.where(there, sd, np.inf),
            reading_sd=np.sqrt(variance),
            counts=np.where(there, means.counts, 0),
            repeated=np.nan_to_num(means.pure_error_dof) > 0,
            noise=self.noise,
        )
