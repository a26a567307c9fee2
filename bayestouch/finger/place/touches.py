"""Functions of place at the touches of a calibration, and what they make of the errors of its readings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.sampling.low_rank import LowRank

# Directions of the functions about which the readings say less than this share of what the prior says are left to it.
LEAST_INFORMATION = 1e-3


@dataclass(frozen=True, eq=False)
class PlacedErrors:
    """Errors of the readings of known touches, functions of place among them.

    Attributes
    ----------
    weight : (t, m) array
        Inverse standard deviation of each reading's independent error; zero where there is none.
    low_rank : LowRank
        In units of those: errors of the loads, and the functions.
    """

    weight: FloatArray
    low_rank: LowRank

    def whiten(self, rows: FloatArray) -> FloatArray:
        """As `LowRank.whiten`, of rows (..., t, m) in readings."""
        return self.low_rank.whiten(rows * self.weight)

    def weights(self, rows: FloatArray) -> FloatArray:
        """Mean of the functions' weights (..., m r + q) given rows (..., t, m) in readings."""
        return self.low_rank.weights(rows * self.weight)

    @property
    def spent(self) -> FloatArray:
        """How many of the weights the readings of each element determine, (m,); shared ones count in equal parts."""
        m, _, r = self.low_rank.own.shape
        told = 1 - np.diag(self.low_rank.covariance)
        return np.asarray(told[: m * r].reshape(m, r).sum(axis=1) + told[m * r :].sum() / m)


@dataclass(frozen=True, eq=False)
class PlacedTouches:
    """Readings that standard normal weights of functions of place add to known touches.

    Attributes
    ----------
    basis : (m, k, r) array
        Combinations, orthonormal, of each element's k own functions that its touches tell of.
    own : (m, t, r) array
        What these add.
    surface : (t, m, q) array
        What the functions of the surface's curvature add.
    shift : (t, m) array
        Added to the readings of the touches, because the weights of the surface are counted from zero while the touches
        have its mean curvature already.
    """

    basis: FloatArray
    own: FloatArray
    surface: FloatArray
    shift: FloatArray

    @classmethod
    def of(cls, own: FloatArray, surface: FloatArray, sd: FloatArray, mean: FloatArray) -> PlacedTouches:
        """From columns (t, m, k) and (t, m, q), and standard deviations (t, m) of readings, inf for missing ones.

        `mean` (q,) are the weights of the surface whose curvature the touches have.
        """
        columns = np.moveaxis(own, 1, 0)
        k = columns.shape[2]
        scaled = columns / sd.T[:, :, None]
        values, turn = np.linalg.eigh(scaled.swapaxes(1, 2) @ scaled)
        kept = int((values > LEAST_INFORMATION).sum(axis=1).max()) if k else 0
        basis = turn[:, :, k - kept :]
        return cls(basis, columns @ basis, surface, surface @ mean)

    def errors(self, sd: FloatArray, by_load: FloatArray) -> PlacedErrors:
        """Errors of the readings with standard deviations (t, m), and by the load's standard deviation (t, m)."""
        weight = np.where(np.isfinite(sd), 1 / sd, 0.0)
        low_rank = LowRank(by_load * weight, self.own * weight.T[:, :, None], self.surface * weight[:, :, None])
        return PlacedErrors(weight, low_rank)

    def added(self, weights: FloatArray) -> FloatArray:
        """Readings (..., t, m) that weights (..., m r + q) add."""
        return LowRank(np.zeros(self.surface.shape[:2]), self.own, self.surface).added(weights)
