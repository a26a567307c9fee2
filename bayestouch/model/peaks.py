"""Fits in which shares refer to the peak readings of the fit itself, not to those of a fit without the effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.model.base import SensorModel
from bayestouch.model.fitting import Drift, Fitted, fit
from bayestouch.model.load_noise import load_noise_again
from bayestouch.model.noise import NoiseModel

# Relative change of the peaks at which the iteration ends (far below one sd of any value); largest number of fits.
SAME_PEAKS, MOST_FITS = 2e-4, 6
# Relative fall of the noise of the loads for which fits are not repeated: as much as it is uncertain from 200 touches.
SAME_NOISE = 0.05


def fit_with_own_peaks(model: SensorModel, start: FloatArray, noise: NoiseModel, drifts: tuple[Drift, ...]) -> Fitted:
    """Fit as `bayestouch.model.fitting.fit`, repeated with the peaks of the last fit until the peaks are constant.

    If the readout is nonlinear, a fit without this effect has wrong peaks. Limits and curves in shares of these peaks
    are wrong by 10 % and more, and their form is wrong if each element saturates at its own limit.
    """
    for _ in range(MOST_FITS):
        fitted = fit(model, start, noise, drifts)
        peak = fitted.model.peak_at(fitted.vector)
        if np.all(np.abs(peak / model.peak - 1) < SAME_PEAKS):
            break
        # Shares of the noise are rescaled by the mean ratio: in the unit of the readings the noise hardly changes.
        ratio = float(model.peak.mean() / peak.mean())
        noise = noise.with_(peak=peak, added=noise.added.for_peaks(ratio))
        model, start = replace(model, peak=peak), fitted.vector
    return fitted


def settled(fitted: Fitted) -> Fitted:
    """The model fitted again with its own peaks and whitening.

    The noise is estimated again from the scatter within touches, if effects explain a part of this scatter; and so is
    that of the loads, where it was estimated from the readings. A fit with the noise of a model that lacks an effect
    leaves more than its own noise would, so that fits are repeated while that of the loads falls. They are not repeated
    where it rises: a larger noise hides structure that is left, from which the next one is larger again.
    """
    of_loads = fitted.model.load_noise
    if of_loads is None:
        return _fitted_again(fitted, fitted.noise)
    load_sd = load_noise_again(fitted, of_loads)
    for _ in range(MOST_FITS):
        fitted = _fitted_again(fitted, fitted.noise.with_(load_sd=load_sd))
        load_sd, before = load_noise_again(fitted, of_loads), load_sd
        if (load_sd >= (1 - SAME_NOISE) * before).all():
            break
    return fitted


def _fitted_again(fitted: Fitted, noise: NoiseModel) -> Fitted:
    """The model fitted again with its own peaks, and with a noise whose scatter within touches is what it leaves."""
    if fitted.linear.deviation_jacobian is not None:
        observed = fitted.model.known
        read = ~np.isnan(observed.deviation)
        means = np.zeros((observed.n_touches, read.shape[1]), dtype=bool)
        np.logical_or.at(means, observed.row_touch, read)
        freedom = read.sum(axis=0) - means.sum(axis=0)
        square = (fitted.linear.deviation**2).sum(axis=0) / np.maximum(freedom, 1)
        noise = noise.with_(sd=np.where(freedom > 0, np.sqrt(square) * noise.sd, noise.sd))
    return fit_with_own_peaks(fitted.model, fitted.vector, noise, fitted.drifts)
