"""Start of all fits of a finger with effects: the fit without effects, and its noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import read_once
from bayestouch.data.sensor import Sensor, finger_of
from bayestouch.errors import InputError
from bayestouch.finger.fit import FingerFit, fit_finger, with_offsets
from bayestouch.finger.model import FingerModel
from bayestouch.finger.priors import FingerPriors
from bayestouch.model.fitting import Fitted, fit
from bayestouch.model.noise import LoadNoise, NoiseModel
from bayestouch.model.observations import Observations
from bayestouch.model.shared_rest import RestOffsets
from bayestouch.priors.parameters import Prior

# Without repeats, the noise is estimated from readings predicted below this share of the peak.
FAR = 0.03
# Median absolute deviation of a normal variable over its standard deviation.
MAD = 0.6745


@dataclass(frozen=True, eq=False)
class FingerStart:
    """A finger without effects, fitted in two ways.

    Attributes
    ----------
    priors : FingerPriors
        Priors of both fits.
    notes : tuple of str
        Assumptions of the priors.
    calibrated : FingerFit
        Fit of a calibration, with unknown noise.
    used : (t,) bool array
        Touches that were fitted: True for all.
    fitted : Fitted
        Fit with the noise of repeats, so that residuals show the model error. The search for effects starts from it.
    """

    priors: FingerPriors
    notes: tuple[str, ...]
    calibrated: FingerFit
    used: NDArray[np.bool_]
    fitted: Fitted

    @property
    def peak(self) -> FloatArray:
        """Peak readings, (m,), the unit of errors of all fits."""
        return np.exp(self.fitted.vector[self.calibrated.likelihood.layout.response]) * self.fitted.model.reference_load


def base_fit(observed: Observations, sensor: Sensor, contact: str, stated: Mapping[str, Prior] | None = None) -> Fitted:
    """Fit of a finger without effects, see `FingerStart.fitted`; parameters as in `finger_start`."""
    return finger_start(observed, sensor, contact, stated).fitted


def finger_start(
    observed: Observations,
    sensor: Sensor,
    contact: str,
    stated: Mapping[str, Prior] | None = None,
    offsets: RestOffsets | None = None,
) -> FingerStart:
    """Both fits of a finger without effects.

    Parameters
    ----------
    observed : Observations
        Touches with known indenter and location.
    sensor : Sensor
        The finger, with its nominal dimensions.
    contact : str
        Contact model.
    stated : mapping of str to Prior, optional
        Priors instead of the default ones, as in `bayestouch.calibrate`.
    offsets : RestOffsets, optional
        Errors of the rest readings that touches share, for the fit of a calibration.

    Raises
    ------
    InputError
        For the reasons of `bayestouch.finger.fit.fit_finger`, or a touch has no load above zero.
    """
    finger = finger_of(sensor)
    priors, notes = FingerPriors.of(sensor)
    priors = priors.with_stated(stated or {}, finger)
    base, used = fit_finger(observed.means, finger, priors, contact=contact)
    if not used.all():
        raise InputError("touches without a load above zero cannot be diagnosed with")
    known, reference = base.likelihood.known, base.likelihood.known.typical_load
    peak = np.abs(base.chain.response) * reference
    model = replace(
        base.likelihood.model, observed=observed, pose=None, peak=peak, evaluator=None, assumed_load=known.load
    )
    at, prior = base.likelihood.layout.force_noise, base.likelihood.prior
    of_loads = LoadNoise(
        float(prior.mean[at]), float(prior.spread[at]), float(known.force_scatter), float(known.force_scatter_dof)
    )
    model = replace(model, evaluator=base.likelihood.series.at_loads(model.load), load_noise=of_loads)
    noise = plain_noise(model, base.predicted, known.load_sd(base.noise.force_sd))
    if priors.noise is not None:  # the noise of the fit combines the stated prior with the repeats
        noise = replace(noise, sd=np.maximum(base.noise.tactile_sd, 1e-6 * model.peak))
    calibrated = base if offsets is None else with_offsets(base, offsets)
    return FingerStart(priors, notes, calibrated, used, fit(model, base.laplace.mode, noise))


def plain_noise(model: FingerModel, predicted: FloatArray, load_sd: FloatArray) -> NoiseModel:
    """Noise of one reading: pure error if an element has repeats, else the scatter of readings far from the touch.

    Parameters
    ----------
    model : FingerModel
        The fitted model.
    predicted : (t, m) array
        Predicted mean readings.
    load_sd : (t,) array
        Standard error of the load of each touch, N/m.
    """
    means = model.known.means
    sd = np.sqrt(means.pure_error_variance)
    scaled = (means.readings - predicted) * np.sqrt(read_once(means.counts))
    far = np.where(np.abs(predicted) < FAR * model.peak, scaled, np.nan)
    for e in np.flatnonzero(~(np.isfinite(sd) & (sd > 0))):
        rows = far[:, e] if np.isfinite(far[:, e]).sum() >= 10 else scaled[:, e]
        rows = rows[np.isfinite(rows)]
        sd[e] = np.median(np.abs(rows)) / MAD if len(rows) else 1.0
    return NoiseModel(np.maximum(sd, 1e-6 * model.peak), load_sd, model.peak)
