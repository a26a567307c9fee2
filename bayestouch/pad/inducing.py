"""A smooth random function at many touches, as a sum of few functions: those that belong to inducing touches.

Neighbouring touches say nearly the same about a smooth function. A pivoted Cholesky factorisation of its covariance
finds the touches whose values determine it at all others, up to a rest that is small beside the noise of the readings.
The rest counts as noise of each reading. With n touches, of which k are inducing, time increases with n k², where the
whole covariance would take n³.

Source: E. Snelson and Z. Ghahramani, Advances in Neural Information Processing Systems 18 (2006) 1257 (the covariance);
H. Harbrecht, M. Peters and R. Schneider, Applied Numerical Mathematics 62 (2012) 428 (the choice of the touches).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dtrtrs

from bayestouch.array_types import FloatArray, IntArray

# Largest variance of the rest, over the noise variance of the same reading: the standard deviation of a reading changes
# by half a percent at most.
REST = 0.01


@dataclass(frozen=True, eq=False)
class InducedCovariance:
    """Covariance ``Φ Φᵀ + V`` of n readings of one element, by k functions with standard normal weights.

    Attributes
    ----------
    inducing : (k,) int array
        Indices of the inducing touches.
    root : (k, k) array
        Lower Cholesky factor of the covariance of the function at these.
    columns : (n, k) array
        Φ: change of the readings per unit of each weight.
    left : (n,) array
        Variance of the rest of the function.
    noise : (n,) array
        Noise variance of the readings. V is the diagonal of this and `left`.
    """

    inducing: IntArray
    root: FloatArray
    columns: FloatArray
    left: FloatArray
    noise: FloatArray

    @classmethod
    def of(
        cls, covariance: FloatArray, noise: FloatArray, rest: float = REST, most: int | None = None
    ) -> InducedCovariance:
        """From the covariance (n, n) of the function at the touches and the noise variance (n,) of the readings.

        The rest is at most the share `rest` of the noise, unless more than `most` inducing touches were needed.
        """
        from scipy.linalg.lapack import dpstrf

        sd = np.sqrt(noise)
        factor, pivot, rank, _ = dpstrf(covariance / sd[:, None] / sd, tol=rest, lower=1)
        k = rank if most is None else min(rank, most)
        columns = np.zeros((len(sd), k))
        columns[pivot - 1] = np.tril(factor)[:, :k]
        columns *= sd[:, None]
        inducing = np.asarray(pivot[:k] - 1, dtype=np.int64)
        left = np.maximum(np.diag(covariance) - (columns**2).sum(axis=1), 0.0)
        return cls(inducing, columns[inducing], columns, left, noise)

    @classmethod
    def independent(cls, noise: FloatArray) -> InducedCovariance:
        """No function: readings with independent noise of variance (n,)."""
        none = np.zeros((len(noise), 0))
        return cls(np.zeros(0, dtype=np.int64), none[:0], none, np.zeros(len(noise)), noise)

    @property
    def variance(self) -> FloatArray:
        """Diagonal of V, (n,)."""
        return self.left + self.noise

    @cached_property
    def _pull(self) -> FloatArray:
        """``V^-1 Φ``, (n, k)."""
        return np.asarray(self.columns / self.variance[:, None])

    @cached_property
    def _information_root(self) -> FloatArray:
        """Lower Cholesky factor of the inverse covariance of the weights given the readings, ``I + Φᵀ V^-1 Φ``."""
        return np.asarray(np.linalg.cholesky(np.eye(self.columns.shape[1]) + self.columns.T @ self._pull))

    def weights(self, rows: FloatArray) -> FloatArray:
        """Mean of the weights given readings (n, ...): (k, ...)."""
        if not self.columns.shape[1]:
            return np.zeros((0, *rows.shape[1:]))
        # The root is upper for LAPACK, whose rows are columns. scipy's functions take longer than the solution.
        root = self._information_root.T
        onto, _ = dtrtrs(root, self._pull.T @ rows, lower=0, trans=1)
        return np.asarray(dtrtrs(root, onto, lower=0)[0])

    def solve(self, rows: FloatArray) -> FloatArray:
        """Inverse covariance times rows (n, ...)."""
        return np.asarray(((rows - self.columns @ self.weights(rows)).T / self.variance).T)

    def whiten(self, rows: FloatArray) -> FloatArray:
        """Rows (n + k, ...) whose products are those of rows (n, ...) with the inverse covariance between them.

        They are what the functions do not explain, in units of the noise, and the weights of the functions.
        """
        if not self.columns.shape[1]:
            return np.asarray((rows.T / np.sqrt(self.variance)).T)
        weights = self.weights(rows)
        return np.concatenate([((rows - self.columns @ weights).T / np.sqrt(self.variance)).T, weights])

    def precision(self, part: IntArray) -> FloatArray:
        """Rows and columns `part` (b,) of the inverse covariance, (b, b)."""
        explained = solve_triangular(self._information_root, self._pull[part].T, lower=True, check_finite=False)
        return np.asarray(np.diag(1 / self.variance[part]) - explained.T @ explained)

    @cached_property
    def precision_diagonal(self) -> FloatArray:
        """Diagonal of the inverse covariance, (n,)."""
        explained = solve_triangular(self._information_root, self._pull.T, lower=True, check_finite=False)
        return np.asarray(1 / self.variance - (explained**2).sum(axis=0))

    def functions_at(self, cross: FloatArray) -> FloatArray:
        """The functions (q, k) at places whose covariance with the inducing touches is `cross` (q, k)."""
        return np.asarray(solve_triangular(self.root, cross.T, lower=True, check_finite=False).T)

    def variance_at(self, prior: FloatArray, functions: FloatArray) -> FloatArray:
        """Variance (q,) of the function given the readings, where it is `prior` (q,) without, and functions (q, k)."""
        known = solve_triangular(self._information_root, functions.T, lower=True, check_finite=False)
        return np.asarray(np.maximum(prior - (functions**2).sum(axis=1), 0.0) + (known**2).sum(axis=0))
