"""Cross-validated predictive densities of a model linearised at its fit."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.model.columns import WhiteColumns
from bayestouch.model.linear import Functions, Linearised, conditioned


def gained(difference: FloatArray) -> FloatArray:
    """Log density of the readings of each touch, (t,), from `held_out_density` (t, 3) or a difference of two."""
    return np.asarray(difference[:, :2].sum(axis=1))


def held_out_density(model: Linearised, fold: IntArray) -> FloatArray:
    """Log predictive density of each touch given the touches of the other folds, up to a constant.

    Parameters
    ----------
    model : Linearised
        The model at its fit to all touches; the rows of a fold are removed from it, which is exact for a linear model.
    fold : (t,) int array
        Fold of each touch.

    Returns
    -------
    (t, 3) array
        Log density of the mean readings; of the deviations of samples from the means; and minus half the squared error
        of the means in units of the noise, which does not depend on the uncertainty of the prediction.
    """
    t, m = model.residual.shape
    design, hessian = model.jacobian, precision_of_all(model)
    d = len(model.pull)
    white = None if model.functions is None else model.functions.white
    if white is not None:
        design = np.concatenate([design, white.dense()], axis=1)
    gradient = design.T @ model.residual.ravel()
    gradient[:d] += model.precision * model.pull
    if model.deviation_jacobian is not None:
        gradient[:d] += model.deviation_jacobian.T @ model.deviation.ravel()
    by_touch = design.reshape(t, m, -1)
    out = np.zeros((t, 3))
    for k in np.unique(fold):
        rows = np.flatnonzero(fold == k)
        flat, residual = by_touch[rows].reshape(-1, design.shape[1]), model.residual[rows]
        less = hessian - _products(flat[:, :d], None if white is None else white.of_touches(rows))
        slope = gradient - flat.T @ residual.ravel()
        inside = np.flatnonzero(fold[model.touch] == k)
        within = None
        if model.deviation_jacobian is not None:
            within = model.deviation_jacobian.reshape(len(model.deviation), m, d)[inside].reshape(-1, d)
            less[:d, :d] -= within.T @ within
            slope[:d] -= within.T @ model.deviation[inside].ravel()
        root = np.linalg.cholesky(conditioned(less))
        step = cho_solve((root, True), slope)
        error = residual - (flat @ step).reshape(residual.shape)
        spread = solve_triangular(root, flat.T, lower=True).T.reshape(*residual.shape, -1)
        out[rows, 0] = density_of_touches(error, spread)
        out[rows, 2] = -0.5 * (error**2).sum(axis=1)
        left = model.deviation[inside]
        if within is not None:
            left = left - (within @ step[:d]).reshape(left.shape)
        np.add.at(out[:, 1], model.touch[inside], -0.5 * (left**2).sum(axis=1))
    return out


def density_of_touches(error: FloatArray, spread: FloatArray) -> FloatArray:
    """Log density of each touch, (t,), up to a constant: its errors are normal with covariance ``1 + spread spreadᵀ``.

    Parameters
    ----------
    error : (t, m) array
        Errors of the prediction in units of the noise.
    spread : (t, m, k) array
        Uncertainty of the prediction: its change per standard deviation of each of k independent directions.
    """
    covariance = np.einsum("tid,tjd->tij", spread, spread, optimize=True) + np.eye(error.shape[1])
    solved = np.linalg.solve(covariance, error[..., None])[..., 0]
    _, volume = np.linalg.slogdet(covariance)
    return np.asarray(-0.5 * ((error * solved).sum(axis=1) + volume))


def precision_of_all(model: Linearised) -> FloatArray:
    """Joint posterior precision of the parameters and the weights of the functions, (d + k, d + k)."""
    own = np.diag(model.precision)
    if model.deviation_jacobian is not None:
        own = own + model.deviation_jacobian.T @ model.deviation_jacobian
    white = None if model.functions is None else model.functions.white
    total = _products(model.jacobian, white)
    total[: len(own), : len(own)] += own
    total[len(own) :, len(own) :] += np.eye(len(total) - len(own))
    return total


def _products(jacobian: FloatArray, white: WhiteColumns | None) -> FloatArray:
    """Gram matrix of the columns of the parameters (n, d) and of the weights."""
    own = jacobian.T @ jacobian
    if white is None:
        return np.asarray(own)
    cross = white.transposed(jacobian)
    return np.block([[own, cross.T], [cross, white.gram()]])


def precision_of_touches(functions: Functions, numbers_held: int) -> FloatArray:
    """Block (t, m, m) of each touch in the precision of all whitened readings, random functions integrated out.

    Parameters
    ----------
    functions : Functions
        The random functions.
    numbers_held : int
        Largest number of entries of an array that is computed at once.
    """
    white, root = functions.white, functions.root
    t, m = white.shape
    out, some = np.empty((t, m, m)), max(1, numbers_held // (m * white.count))
    for first in range(0, t, some):
        which = np.arange(first, min(first + some, t))
        columns = solve_triangular(root, white.of_touches(which).dense().T, lower=True)
        onto = columns.reshape(white.count, len(which), m)
        out[which] = np.eye(m) - np.einsum("kti,ktj->tij", onto, onto, optimize=True)
    return out
