"""Noise of the force sensor in a fit: from its prior, from repeats, and from what the readings show of each load.

The fit without effects takes an effect that it lacks for noise of the loads, if elements share the error: a gain that
drifts changes all readings of a touch as a wrong load does. So the noise is estimated again as effects are found.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

from bayestouch.array_types import FloatArray
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
    slope, information = _of_loads(fitted, np.where(measured, 1 / np.sqrt(np.maximum(reads, 1.0)), 0.0))
    # With another noise s of the loads, the covariance of the whitened readings changes by (s² - now²) U Uᵀ.
    values, vectors = np.linalg.eigh(information)
    squares = (vectors.T @ slope) ** 2
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


def _of_loads(fitted: Fitted, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Score (t,) and information (t, t) of an error of each load, in units `scale` (t,); all else integrated out."""
    by_load = fitted.model.by_load(fitted.vector) * scale[:, None]
    own = fitted.whitening.touches(by_load)
    scorer, (t, m) = Scorer(fitted.linear), own.shape

    def onto(rows: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("tm,tmq->tq", own, rows.reshape(t, m, -1)))

    information = np.diag((own**2).sum(axis=1))
    functions = fitted.linear.functions
    if functions is not None:
        shared = onto(functions.white.dense())
        information -= shared @ cho_solve((functions.root, True), shared.T)
    absorbed = solve_triangular(scorer.root, onto(scorer.integrated_jacobian).T, lower=True)
    return onto(scorer.plain)[:, 0], information - absorbed.T @ absorbed
