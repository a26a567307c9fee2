"""Many random functions of one element each, integrated out element by element.

With hundreds of functions for all elements, the Gram matrix of all functions and its factor take most of the time of a
density. If the noise of an element is the same in all touches but for its number of samples, the functions of the
element can be turned so that they do not overlap; then their weights are eliminated without any matrix, and a matrix is
left for the shared errors of the touches and the functions that change several elements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dsyrk
from scipy.linalg.lapack import dpotrf, dtrtrs

from bayestouch.array_types import FloatArray
from bayestouch.model.columns import WhiteColumns

# Largest relative difference of an element's noise level between touches that counts as none: rounding.
SAME = 1e-9
# The matrix that is left has a row for each shared error: it takes longer than the Gram matrix of a few functions. With
# 468 touches and 16 elements 90 functions of all elements take 5 ms in place of 8, 1388 more of one element 14 in place
# of 86.
MOST_SHARED = 8


@dataclass(frozen=True, eq=False)
class OwnColumns:
    """Functions with standard normal weights over t touches of m elements, for noise with known shares of its variance.

    Attributes
    ----------
    share : (t, m) array
        Variance of the noise of each reading over that of its element, positive; inf for a missing reading.
    own : (m, b, t) array
        Functions of one element each, orthogonal in the noise; zero beyond the functions of an element.
    size : (m, b) array
        Sum over touches of ``own² / share``.
    full : (t, m, a) array
        Functions that change several elements.
    own_full, full_full : (m, b, a), (m, a, a) array
        Products of the functions over the shares, summed over the touches.
    """

    share: FloatArray
    own: FloatArray
    size: FloatArray
    full: FloatArray
    own_full: FloatArray
    full_full: FloatArray

    @classmethod
    def of(cls, raw: FloatArray, share: FloatArray) -> OwnColumns:
        """From functions (c, t, m), NaN missing, and the shares."""
        t, m = share.shape
        white = WhiteColumns.of(raw, np.broadcast_to(np.eye(m), (t, m, m)))
        own, size = np.zeros_like(white.own), np.zeros(white.own.shape[:2])
        for e, each in enumerate(white.own):
            axes, sizes, _ = np.linalg.svd(each / np.sqrt(share[:, e]), full_matrices=False)
            own[e, : len(sizes)], size[e, : len(sizes)] = axes.T @ each, sizes**2
        full = white.full.reshape(t, m, -1)
        over = full / share[:, :, None]
        return cls(
            share=share,
            own=own,
            size=size,
            full=full,
            own_full=own @ over.transpose(1, 0, 2),
            full_full=full.transpose(1, 2, 0) @ over.transpose(1, 0, 2),
        )

    def log_density(self, left: FloatArray, weight: FloatArray, slopes: FloatArray) -> FloatArray | None:
        """Log density (n,) of n tables of errors, up to a constant, with all weights integrated out.

        Parameters
        ----------
        left, weight : (n, t, m) arrays
            Errors of the readings and inverse variances of their noise, zero missing.
        slopes : (k, n, t, m) array
            Shared errors of each touch: change of its readings by k standard normal numbers of its own.

        Returns
        -------
        (n,) array or None
            None if the noise of an element is not in proportion to `share`, or if this way takes longer because there
            are few functions.
        """
        if MOST_SHARED * ((self.size > 0).sum() + self.full.shape[2]) < len(slopes) * len(self.share):
            return None
        present = np.isfinite(self.share)
        product = np.where(present, weight * np.where(present, self.share, 1.0), 0.0)
        level = product.max(axis=1)
        if (np.abs(product - level[:, None]) > SAME * level[:, None])[:, present].any():
            return None
        volume = np.log(np.where(weight > 0, weight, 1.0)).sum(axis=(1, 2))
        rows = zip(left, np.where(present, weight, 0.0), level, slopes.swapaxes(0, 1), strict=True)
        return np.asarray(0.5 * volume - 0.5 * np.array([self._left_over(*row) for row in rows]))

    def _left_over(self, left: FloatArray, weight: FloatArray, level: FloatArray, slopes: FloatArray) -> float:
        """Sum of squares and log determinant of one table (t, m), with slopes (k, t, m) and levels (m,)."""
        count, n_full = len(slopes) * len(left), self.full.shape[2]
        weighted, turned = weight * left, weight * slopes
        # The precision of the functions' own weights is diagonal: they go first, and leave less of the others.
        precision = 1 + level[:, None] * self.size
        root = np.sqrt(precision)[:, :, None]
        between = np.empty((*precision.shape, count + n_full))
        by_touch = np.einsum("ebt,kte->ebkt", self.own, turned).reshape(*precision.shape, count)
        np.divide(by_touch, root, out=between[:, :, :count])
        np.divide(level[:, None, None] * self.own_full, root, out=between[:, :, count:])
        between = between.reshape(-1, count + n_full)
        onto_own = (self.own @ weighted.T[:, :, None] / root).ravel()
        # LAPACK needs the lower triangle only, and works in the same memory.
        rest = np.zeros((count + n_full, count + n_full), order="F")
        rest[:count, :count] = _of_touches(turned, slopes)
        rest[count:, :count] = np.einsum("ktm,tma->akt", turned, self.full, optimize=True).reshape(n_full, count)
        rest[count:, count:] = np.tensordot(level, self.full_full, axes=1)
        rest[np.diag_indices(len(rest))] += 1
        rest = dsyrk(-1.0, between.T, beta=1.0, c=rest, lower=1, overwrite_c=1)
        factor, failed = dpotrf(rest, lower=1, clean=0, overwrite_a=1)
        if failed:
            raise np.linalg.LinAlgError("the precision of the weights is not positive")
        onto = np.r_[(slopes * weighted).sum(axis=2).ravel(), np.einsum("tma,tm->a", self.full, weighted)]
        along, _ = dtrtrs(factor, onto - between.T @ onto_own, lower=1)
        squares = (weighted * left).sum() - onto_own @ onto_own - along @ along
        return float(squares + np.log(precision).sum() + 2 * np.log(np.diag(factor)).sum())


def _of_touches(turned: FloatArray, slopes: FloatArray) -> FloatArray:
    """Precision (k t, k t) of the shared errors from the readings: those of different touches do not meet."""
    k, t, _ = slopes.shape
    out = np.zeros((k, t, k, t))
    out[:, np.arange(t), :, np.arange(t)] = np.einsum("itm,jtm->tij", turned, slopes)
    return out.reshape(k * t, k * t)
