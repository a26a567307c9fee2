"""Log posterior of a pad to second order about a vector, from the model linearised there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, cho_solve

from bayestouch.array_types import FloatArray
from bayestouch.model.fitting import linearised
from bayestouch.model.linear import Linearised
from bayestouch.pad.density import PadDensity


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Log density to second order about a vector; d entries.

    Attributes
    ----------
    gradient, precision : (d,), (d, d) arrays
        Derivative of the log density, and minus its second derivative.
    cost : float
        Minus the log density at the vector, up to a constant.
    """

    gradient: FloatArray
    precision: FloatArray
    cost: float

    @classmethod
    def at(cls, density: PadDensity, vector: FloatArray) -> Quadratic:
        """The posterior about a vector (d,); a flat prior counts as a normal one, its width as the sd.

        Size and time of the drifts have the gradient and the precision of their normal approximation, in which they are
        independent of the other entries. `cost` is that of the drifts of this size and time.
        """
        if not len(density.drifts):
            linear = density.linearised(vector)
            return cls(linear.gradient(), linear.hessian(), linear.cost())
        own, logs = vector[: density.n_model], vector[density.n_model :]
        linear = linearised(density.model, own, density.fitted.whitening)
        gram, log_determinant = _without_functions(density, vector, linear)
        precision, gradient = np.diag(linear.precision) + gram[1:, 1:], linear.precision * linear.pull + gram[1:, 0]
        if linear.deviation_jacobian is not None:
            precision = precision + linear.deviation_jacobian.T @ linear.deviation_jacobian
            gradient = gradient + linear.deviation_jacobian.T @ linear.deviation.ravel()
        squares = gram[0, 0] + log_determinant + (linear.deviation**2).sum() + linear.precision @ linear.pull**2
        of_drifts, entries = density.drifts.sd**-2.0, density.drifts
        return cls(
            np.concatenate([gradient, of_drifts * (entries.mode - logs)]),
            np.asarray(block_diag(precision, np.diag(of_drifts))),
            0.5 * float(squares) - float(entries.log_prior(logs)),
        )


def _without_functions(density: PadDensity, vector: FloatArray, linear: Linearised) -> tuple[FloatArray, float]:
    """Gram matrix (1 + n, 1 + n) of residual and derivatives, map and drifts integrated out, and log determinant."""
    own = vector[: density.n_model]
    t, m = linear.residual.shape
    rows = np.column_stack([linear.residual.ravel(), linear.jacobian]).reshape(1, t, m, -1)
    predicted = density.model.predict(own).touches[None]
    (gram,), (volume,) = density.without_drifts(vector[None], predicted, (rows, density.columns[None]))
    n = rows.shape[3]
    root = np.linalg.cholesky(gram[n:, n:] + np.eye(len(gram) - n))
    absorbed = gram[:n, n:] @ cho_solve((root, True), gram[n:, :n])
    return np.asarray(gram[:n, :n] - absorbed), float(volume + 2 * np.log(np.diag(root)).sum())
