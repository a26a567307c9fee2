"""Errors of rows of readings: independent ones, one that a row shares, and functions of low rank that rows share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayestouch.array_types import FloatArray


@dataclass(frozen=True, eq=False)
class LowRank:
    """Covariance ``Q = L + F Fᵀ`` of t rows of m entries, in units of the independent errors.

    ``L = I + u uᵀ`` in each row: its independent errors of one and its shared error. F holds functions whose weights
    are standard normal: r of each entry's own, which no other entry has, and q that all entries have.

    Source: G. H. Golub and C. F. Van Loan, Matrix Computations (2013), section 2.1.4 (Sherman-Morrison-Woodbury).

    Attributes
    ----------
    direction : (t, m) array
        u: change of each entry by one standard deviation of its row's shared error.
    own : (m, t, r) array
        What each function of an entry's own adds to it.
    shared : (t, m, q) array
        What the functions that all entries have add to them.
    """

    direction: FloatArray
    own: FloatArray
    shared: FloatArray

    @property
    def n_weights(self) -> int:
        """``m r + q``: the weights of the functions, those of the first entry first."""
        return int(self.own.shape[0] * self.own.shape[2] + self.shared.shape[2])

    @cached_property
    def _length2(self) -> FloatArray:
        return np.asarray((self.direction**2).sum(axis=-1))

    def _without_row_error(self, rows: FloatArray) -> FloatArray:
        """``L^-1`` of rows (..., t, m)."""
        along = (self.direction * rows).sum(axis=-1) / (1 + self._length2)
        return np.asarray(rows - self.direction * along[..., None])

    def _onto_functions(self, rows: FloatArray) -> FloatArray:
        """``Fᵀ`` of rows (..., t, m): (..., m r + q)."""
        lead = rows.shape[:-2]
        flat = rows.reshape(-1, *rows.shape[-2:])
        m, _, r = self.own.shape
        own = np.matmul(np.ascontiguousarray(np.moveaxis(flat, -1, 0)), self.own)
        parts = [np.moveaxis(own, 0, 1).reshape(len(flat), m * r)]
        if self.shared.shape[2]:
            parts.append(flat.reshape(len(flat), -1) @ self.shared.reshape(-1, self.shared.shape[2]))
        return np.concatenate(parts, axis=1).reshape(*lead, -1)

    def added(self, weights: FloatArray) -> FloatArray:
        """What weights (..., m r + q) of the functions add to the entries, (..., t, m)."""
        m, _, r = self.own.shape
        own = weights[..., : m * r].reshape(*weights.shape[:-1], m, r)
        total = np.einsum("mtr,...mr->...tm", self.own, own, optimize=True)
        if self.shared.shape[2]:
            total = total + np.einsum("tmq,...q->...tm", self.shared, weights[..., m * r :], optimize=True)
        return np.asarray(total)

    @cached_property
    def information(self) -> FloatArray:
        """``A = I + Fᵀ L^-1 F``: inverse covariance of the weights given the rows, (m r + q, m r + q)."""
        m, t, r = self.own.shape
        n = m * r
        out = np.eye(self.n_weights)
        for e, gram in enumerate(self.own.swapaxes(1, 2) @ self.own):
            out[e * r : (e + 1) * r, e * r : (e + 1) * r] += gram
        turned = np.moveaxis(self.own * self.direction.T[:, :, None], 0, 1).reshape(t, n)
        if self.shared.shape[2]:
            flat = self.shared.reshape(t * m, -1)
            out[n:, n:] += flat.T @ flat
            cross = np.einsum("mtr,tmq->mrq", self.own, self.shared, optimize=True).reshape(n, self.shared.shape[2])
            out[:n, n:] += cross
            out[n:, :n] += cross.T
            turned = np.concatenate([turned, np.einsum("tm,tmq->tq", self.direction, self.shared)], axis=1)
        scaled = turned / np.sqrt(1 + self._length2)[:, None]
        return np.asarray(out - scaled.T @ scaled)

    @cached_property
    def covariance(self) -> FloatArray:
        """Of the weights given the rows, (m r + q, m r + q)."""
        return np.asarray(self._inverse_root.T @ self._inverse_root)

    @cached_property
    def _inverse_root(self) -> FloatArray:
        """``R^-1`` of ``A = R Rᵀ``."""
        from scipy.linalg import solve_triangular

        root = np.linalg.cholesky(self.information)
        return np.asarray(solve_triangular(root, np.eye(len(root)), lower=True, check_finite=False))

    def weights(self, rows: FloatArray) -> FloatArray:
        """Mean of the weights given rows (..., t, m): (..., m r + q)."""
        onto = self._onto_functions(self._without_row_error(rows))
        return np.asarray(onto @ self._inverse_root.T @ self._inverse_root)

    def drawn_weights(self, rows: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Draws of the weights given rows (..., t, m), one for each: (..., m r + q)."""
        mean = self.weights(rows)
        return np.asarray(mean + rng.standard_normal(mean.shape) @ self._inverse_root)

    def whiten(self, rows: FloatArray) -> FloatArray:
        """Rows whose sum of squares is ``xᵀ Q^-1 x``, (..., t, m) to (..., t + r + q, m).

        What the functions do not explain, then their weights: of an entry's own functions in its column, those of the
        shared ones the same in all columns.
        """
        m, _, r = self.own.shape
        weights = self.weights(rows)
        left = rows - self.added(weights)
        along = (self.direction * left).sum(axis=-1, keepdims=True)
        root = np.sqrt(1 + self._length2)[:, None]
        white = left - self.direction * along / (root * (1 + root))
        own = weights[..., : m * r].reshape(*weights.shape[:-1], m, r).swapaxes(-1, -2)
        common = np.repeat(weights[..., m * r :, None] / np.sqrt(m), m, axis=-1)
        return np.concatenate([white, own, common], axis=-2)

    def squared_distance(self, rows: FloatArray) -> FloatArray:
        """``xᵀ Q^-1 x`` of rows (..., t, m), (...)."""
        inner = self._without_row_error(rows)
        explained = self._onto_functions(inner) @ self._inverse_root.T
        return np.asarray((rows * inner).sum(axis=(-2, -1)) - (explained * explained).sum(axis=-1))

    @cached_property
    def log_determinant(self) -> float:
        """``log det Q``."""
        of_functions = -2 * np.log(np.diag(self._inverse_root)).sum()
        return float(np.log1p(self._length2).sum() + of_functions)
