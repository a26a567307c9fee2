"""Fits whose shares refer to the peaks that they find themselves, not to those of a fit without the effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.model.base import SensorModel
from bayestouch.model.fitting import Drift, Fitted, fit
from bayestouch.model.noise import NoiseModel

# A change of a peak (as a share of it) that is far below one standard deviation of any effect's value; fits at most.
SETTLED, MOST_FITS = 2e-4, 6


def fit_with_own_peaks(model: SensorModel, start: FloatArray, noise: NoiseModel, drifts: tuple[Drift, ...]) -> Fitted:
    """Fit as `bayestouch.model.fitting.fit`, again with the peaks of the last fit until they stay.

    An effect that bends the readings bends the peaks of a fit without it, too: limits and curves that are stated in
    shares of those are a tenth and more off, and where elements saturate each at its own limit their form is wrong.
    """
    for _ in range(MOST_FITS):
        fitted = fit(model, start, noise, drifts)
        peak = fitted.model.peak_at(fitted.vector)
        if np.all(np.abs(peak / model.peak - 1) < SETTLED):
            break
        # Noise that is stated in shares stays as large as it is.
        ratio = float(model.peak.mean() / peak.mean())
        noise = noise.with_(peak=peak, added=noise.added.for_peaks(ratio))
        model, start = replace(model, peak=peak), fitted.vector
    return fitted


def settled(fitted: Fitted) -> Fitted:
    """The model fitted once more under its own whitening; what effects explain within touches is no noise any more."""
    noise = fitted.noise
    if fitted.linear.deviation_jacobian is not None:
        observed = fitted.model.known
        spent = np.bincount(observed.row_touch, minlength=observed.n_touches)
        freedom = (~np.isnan(observed.deviation)).sum(axis=0) - int((spent > 0).sum())
        square = (fitted.linear.deviation**2).sum(axis=0) / np.maximum(freedom, 1)
        noise = noise.with_(sd=np.where(freedom > 0, np.sqrt(square) * noise.sd, noise.sd))
    return fit_with_own_peaks(fitted.model, fitted.vector, noise, fitted.drifts)
