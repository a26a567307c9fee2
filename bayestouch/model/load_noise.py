"""Noise of the force sensor in a fit: from its prior, from repeats, and from what the readings show of each load.

The fit without effects takes an effect that it lacks for noise of the loads, if elements share the error: a gain that
drifts changes all readings of a touch as a wrong load does. So the noise is estimated again as effects are found.
"""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import read_once
from bayestouch.model.fitting import Fitted, fit
from bayestouch.model.left_over import force_noise
from bayestouch.model.linear import Scorer
from bayestouch.model.noise import LoadNoise


def load_noise_again(fitted: Fitted, known: LoadNoise) -> FloatArray:
    """Standard errors of the loads, (t,), with the noise of the force sensor that is most plausible after a fit.

    It is the mean of the logarithm under the marginal likelihood of the linearised model: parameters and random
    functions are integrated out. Loads that were not measured keep their standard errors.
    """
    load, reads = fitted.model.known.load, fitted.model.known.means.reads_of_load
    measured, now = np.isfinite(load), force_noise(fitted)
    one_read = np.where(measured, 1 / np.sqrt(read_once(reads)), 0.0)
    by_noise = fitted.model.by_load(fitted.vector) * one_read[:, None]
    score = Scorer(fitted.linear).of_touches(fitted.whitening.touches(by_noise))
    # With another noise s of the loads, the covariance of the whitened readings changes by (s² - now²) U Uᵀ.
    values, vectors = np.linalg.eigh(score.information)
    squares = (vectors.T @ score.slope) ** 2
    grid = known.grid
    change = np.exp(2 * grid)[:, None] - now**2
    # The information contains the present noise, so that it is below its inverse square.
    volume = np.maximum(1 + change * np.maximum(values, 0.0), 1e-12)
    log_density = known.log_density(grid) + 0.5 * (change * squares / volume - np.log(volume)).sum(axis=1)
    weight = np.exp(log_density - log_density.max())
    found = float(np.exp(weight @ grid / weight.sum()))
    return np.where(measured, fitted.noise.load_sd * found / now, fitted.noise.load_sd)


def with_load_noise_of(other: Fitted, fitted: Fitted) -> Fitted:
    """A fit repeated with the noise of the loads of another fit of the same touches."""
    if np.array_equal(other.noise.load_sd, fitted.noise.load_sd):
        return fitted
    return fit(fitted.model, fitted.vector, fitted.noise.with_(load_sd=other.noise.load_sd), fitted.drifts)
