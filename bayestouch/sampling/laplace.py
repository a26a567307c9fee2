"""Maximum a posteriori fits and their Laplace covariance; independent of tactile sensors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray

#: A fit ends when a step decreases the objective by less than this share of it, as a rule.
ENOUGH = 1e-10


@dataclass(frozen=True, eq=False)
class LaplaceFit:
    """Mode of a posterior and the normal approximation around it.

    Attributes
    ----------
    mode : (d,) array
        Maximum of the posterior.
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


def damped_newton_steps(gradient: FloatArray, hessian: FloatArray, damping: FloatArray) -> FloatArray:
    """Newton steps (n, d) of n independent minimisations, with Levenberg-Marquardt damping.

    Parameters
    ----------
    gradient : (n, d) array
        Negative gradient of the objective.
    hessian : (n, d, d) array
        Hessian of the objective.
    damping : (n,) array
        Relative increase of each diagonal element of the Hessian, not negative: 0 gives Newton's step, a large value a
        short step along the gradient.
    """
    diagonal = np.einsum("nii->ni", hessian)
    damped = hessian + damping[:, None, None] * np.eye(hessian.shape[1]) * diagonal[:, :, None]
    return np.asarray(np.linalg.solve(damped, gradient[..., None])[..., 0])


def least_squares_map(
    residuals: Callable[[FloatArray], FloatArray],
    jacobian: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
    enough: float = ENOUGH,
) -> LaplaceFit:
    """Return the maximum a posteriori fit of a model with normal residuals.

    Parameters
    ----------
    residuals : callable
        Whitened residuals (data and prior rows), ``(d,) -> (n,)``.
    jacobian : callable
        Derivative of the residuals, ``(d,) -> (n, d)``.
    start : (d,) array
        Starting point, inside the bounds.
    bounds : pair of (d,) arrays
        Lower and upper bounds.
    enough : float
        The fit ends when a step decreases the objective by less than this share of it.
    """
    from scipy.optimize import least_squares

    solution = least_squares(residuals, start, jac=jacobian, bounds=bounds, x_scale="jac", xtol=1e-10, ftol=enough)
    jac = np.asarray(solution.jac)
    scale = np.linalg.norm(jac, axis=0)
    scale[scale == 0] = 1.0
    inverse = np.linalg.inv((jac / scale).T @ (jac / scale))
    return LaplaceFit(solution.x, inverse / np.outer(scale, scale), float(solution.cost))


def inverse_of_lower(root: FloatArray) -> FloatArray:
    """Inverses (..., k, k) of many small lower triangular matrices.

    One call of LAPACK for each is several times faster than `numpy.linalg.solve`, which takes them to be general.
    """
    from scipy.linalg.lapack import dtrtri

    k = root.shape[-1]
    # LAPACK reads columns: the transposed matrix, upper triangular, is not copied.
    inverses = [dtrtri(each.T, lower=0)[0].T for each in root.reshape(-1, k, k)]
    return np.array(inverses).reshape(root.shape)


def solve_lower(root: FloatArray, rows: FloatArray, *, transposed: bool = False) -> FloatArray:
    """Solutions (n, k) of many small triangular systems at once, a row each.

    Parameters
    ----------
    root : (n, k, k) array
        Lower triangular matrices.
    rows : (n, k) array
        Right sides of the systems.
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
