"""Posterior of the size and correlation time of the drifts of a model."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.effects.effect import Values
from bayestouch.model.drift_likelihood import DriftLikelihood
from bayestouch.model.fitting import Fitted, fit

# Nodes per axis, in standard deviations: the trapezoidal rule with this step integrates a normal density to 1e-5.
NODES = np.linspace(-3.6, 3.6, 7)
# First guess of the standard deviations of the logarithms of size and time: the search tries sizes that differ by a
# factor of two and times that differ by a factor of three.
BEGINNING = (0.5, 0.8)
# Largest number of grids. A grid is accepted if the mean of the density is less than NEAR sd of the grid from the
# middle of the grid, and if the sds of density and grid differ by less than a factor WITHIN.
MOST_GRIDS, NEAR, WITHIN = 12, 0.3, 1.2


def settled_drifts(fitted: Fitted) -> tuple[Fitted, dict[str, Values]]:
    """The model fitted again with the posterior size and time of each drift, and their standard deviations by effect.

    The new fit has more knots per correlation time than the fits of the search.
    """
    drifts, spreads = list(fitted.drifts), {}
    for i, (effect, _) in enumerate(fitted.drifts):
        values, spreads[effect.name] = drift_posterior(fitted, i)
        drifts[i] = (effect.with_dense_knots(), values)
    if not drifts:
        return fitted, {}
    return fit(fitted.model, fitted.vector, fitted.noise, tuple(drifts)), spreads


def drift_posterior(fitted: Fitted, which: int) -> tuple[Values, Values]:
    """Size and correlation time of one drift, with their standard deviations; its kind is fixed.

    Their posterior is nearly normal in the logarithms. A value is the exponential of the mean logarithm; its standard
    deviation is that of the logarithm times the value. The function of time and the parameters of the model are
    integrated out.

    Returns
    -------
    values, sd : tuple of float
        In the order of the parameters of the effect; the sd of a fixed value is NaN.
    """
    effect, (size, time, *kind) = fitted.drifts[which]
    of_size, of_time = (parameter.prior for parameter in effect.parameters[:2])
    likelihood = DriftLikelihood.of(fitted, which)

    def log_density(logs: FloatArray) -> FloatArray:
        """Log density of log size and log time, (g, 2); the last term is the Jacobian of the logarithms."""
        size, time = np.exp(logs).T
        prior = of_size.log_density(size) + of_time.log_density(time)
        return np.asarray(likelihood(size, time) + prior + logs.sum(axis=1))

    mean, covariance = moments(log_density, np.log([size, time]), np.diag(np.square(BEGINNING)))
    values = np.exp(mean)
    sd = values * np.sqrt(np.diag(covariance))
    return (*values.tolist(), *kind), (*sd.tolist(), *(float("nan") for _ in kind))


def moments(
    log_density: Callable[[FloatArray], FloatArray], middle: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean (2,) and covariance (2, 2) of a density of two variables, by quadrature on a grid that is adapted to it.

    Parameters
    ----------
    log_density : callable
        Log density of points (g, 2), up to a constant.
    middle, covariance : (2,), (2, 2) arrays
        First guess of mean and covariance.
    """
    nodes = np.stack(np.meshgrid(NODES, NODES, indexing="ij"), axis=-1).reshape(-1, 2)
    for _ in range(MOST_GRIDS):
        root = np.linalg.cholesky(covariance)
        log = log_density(middle + nodes @ root.T)
        weight = np.exp(log - log.max())
        weight /= weight.sum()
        mean = weight @ nodes
        spread = (nodes - mean).T @ ((nodes - mean) * weight[:, None])
        # If the density lies between two nodes, its spread is underestimated: the next grid is at most 3 times finer.
        values, axes = np.linalg.eigh(spread)
        middle = middle + root @ mean
        covariance = root @ (axes * np.maximum(values, 0.1)) @ axes.T @ root.T
        if np.abs(mean).max() < NEAR and values.min() > WITHIN**-2 and values.max() < WITHIN**2:
            break
    return middle, covariance
