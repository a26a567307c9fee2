"""Maximum a posteriori fits and their Laplace covariance; nothing here knows of tactile sensors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray


@dataclass(frozen=True, eq=False)
class LaplaceFit:
    """Mode of a posterior and the normal distribution around it.

    Attributes
    ----------
    mode : (d,) array
        Maximum a posteriori.
    covariance : (d, d) array
        Inverse of the Gauss-Newton Hessian at the mode.
    cost : float
        Half the sum of squared whitened residuals at the mode (minus the log posterior up to a constant).
    """

    mode: FloatArray
    covariance: FloatArray
    cost: float

    @property
    def sd(self) -> FloatArray:
        """Standard deviations, shape (d,)."""
        return np.sqrt(np.diag(self.covariance))


def least_squares_map(
    residuals: Callable[[FloatArray], FloatArray],
    jacobian: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
) -> LaplaceFit:
    """Maximum a posteriori of a model with normal residuals.

    Parameters
    ----------
    residuals : callable
        Whitened residuals (data and prior rows), ``(d,) -> (n,)``.
    jacobian : callable
        Their derivative, ``(d,) -> (n, d)``.
    start : (d,) array
        Start, inside the bounds.
    bounds : pair of (d,) arrays
        Lower and upper bounds.
    """
    from scipy.optimize import least_squares

    solution = least_squares(residuals, start, jac=jacobian, bounds=bounds, x_scale="jac", xtol=1e-10, ftol=1e-10)
    jac = np.asarray(solution.jac)
    scale = np.linalg.norm(jac, axis=0)
    scale[scale == 0] = 1.0
    inverse = np.linalg.inv((jac / scale).T @ (jac / scale))
    return LaplaceFit(solution.x, inverse / np.outer(scale, scale), float(solution.cost))


def whiten_rank_one(residual: FloatArray, sd: FloatArray, direction: FloatArray) -> FloatArray:
    """Whiten rows whose covariance is ``diag(sd²) + v vᵀ``.

    Parameters
    ----------
    residual : (..., m) array
        Residuals; rows beyond the last axis are independent.
    sd : (..., m) array
        Independent part; ``inf`` drops an entry (its whitened residual is zero).
    direction : (..., m) array
        ``v``: what one standard deviation of the shared error does to each entry.

    Returns
    -------
    (..., m) array
        ``Σ^(-1/2) residual`` with the symmetric root, so that its sum of squares is the Mahalanobis distance.
    """
    z = residual / sd
    u = direction / sd
    length2 = (u * u).sum(axis=-1, keepdims=True)
    # (I + u uᵀ)^(-1/2) = I - c u uᵀ with c = (1 - 1/sqrt(1 + |u|²)) / |u|², finite as |u| goes to 0.
    root = np.sqrt(1 + length2)
    factor = 1 / (root * (1 + root))
    return np.asarray(z - factor * u * (u * z).sum(axis=-1, keepdims=True))


def solve_lower(root: FloatArray, rows: FloatArray, *, transposed: bool = False) -> FloatArray:
    """Solutions (n, k) of many small triangular systems at once, a row each.

    Parameters
    ----------
    root : (n, k, k) array
        Lower triangular matrices.
    rows : (n, k) array
        Right-hand sides.
    transposed : bool
        Solve with the transposed matrices.
    """
    out = rows.copy()
    k = rows.shape[1]
    for i in reversed(range(k)) if transposed else range(k):
        if not transposed:
            out[:, i] -= np.einsum("nj,nj->n", root[:, i, :i], out[:, :i])
        out[:, i] /= root[:, i, i]
        if transposed:
            out[:, :i] -= root[:, i, :i] * out[:, i, None]
    return out
