"""Functions of place at the touches of a calibration, and the errors of the readings that include them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.sampling.low_rank import LowRank

# A combination of weights keeps its prior if the information of the readings on it is below this share of the prior's.
LEAST_INFORMATION = 1e-3


@dataclass(frozen=True, eq=False)
class ErrorsWithPlaces:
    """Errors of the readings of known touches, including functions of place.

    Attributes
    ----------
    weight : (t, m) array
        Inverse standard deviation of the independent error of each reading; zero for a missing reading.
    low_rank : LowRank
        Errors of the loads and functions of place, in units of the independent errors.
    """

    weight: FloatArray
    low_rank: LowRank

    def whiten(self, rows: FloatArray) -> FloatArray:
        """Whitened rows, see `LowRank.whiten`; `rows` (..., t, m) are in the unit of the readings."""
        return self.low_rank.whiten(rows * self.weight)

    def weights(self, rows: FloatArray) -> FloatArray:
        """Mean (..., m r + q) of the weights, given residuals (..., t, m) in the unit of the readings."""
        return self.low_rank.weights(rows * self.weight)

    @property
    def spent(self) -> FloatArray:
        """Number of weights that the readings of each element determine, (m,).

        Shared weights are divided equally among the elements.
        """
        m, _, r = self.low_rank.own.shape
        determined = 1 - np.diag(self.low_rank.covariance)
        return np.asarray(determined[: m * r].reshape(m, r).sum(axis=1) + determined[m * r :].sum() / m)


@dataclass(frozen=True, eq=False)
class TouchesWithPlaces:
    """Readings that standard normal weights of functions of place add to known touches.

    Attributes
    ----------
    basis : (m, k, r) array
        Orthonormal combinations of the k own functions of each element on which the touches have information.
    own : (m, t, r) array
        Change of the readings for each weight of these combinations.
    surface : (t, m, q) array
        Change of the readings for each weight of the curvature of the surface.
    shift : (t, m) array
        Term to add to the readings: the radii of the touches already include the mean curvature of the surface, but
        its weights are counted from zero.
    """

    basis: FloatArray
    own: FloatArray
    surface: FloatArray
    shift: FloatArray

    @classmethod
    def of(cls, own: FloatArray, surface: FloatArray, sd: FloatArray, mean: FloatArray) -> TouchesWithPlaces:
        """Functions at the touches, from their columns and the errors of the readings.

        Parameters
        ----------
        own, surface : (t, m, k), (t, m, q) arrays
            Change of the readings for each weight of the own functions and of the surface.
        sd : (t, m) array
            Standard deviations of the readings; inf where missing.
        mean : (q,) array
            Weights of the surface that the radii of the touches include.
        """
        columns = np.moveaxis(own, 1, 0)
        k = columns.shape[2]
        scaled = columns / sd.T[:, :, None]
        values, turn = np.linalg.eigh(scaled.swapaxes(1, 2) @ scaled)
        kept = int((values > LEAST_INFORMATION).sum(axis=1).max()) if k else 0
        basis = turn[:, :, k - kept :]
        return cls(basis, columns @ basis, surface, surface @ mean)

    @classmethod
    def of_offsets(cls, sd: FloatArray, shift: FloatArray) -> TouchesWithPlaces:
        """An offset of each element that touches share, as a function of place that is constant.

        Parameters
        ----------
        sd : (t, m) array
            Standard deviation of the offset; zero for touches that do not share it.
        shift : (t, m) array
            Offset that was subtracted from the readings.
        """
        t, m = sd.shape
        return cls(np.ones((m, 1, 1)), sd.T[:, :, None].copy(), np.zeros((t, m, 0)), shift)

    def errors(self, sd: FloatArray, by_load: FloatArray) -> ErrorsWithPlaces:
        """Errors of the readings.

        Parameters
        ----------
        sd : (t, m) array
            Standard deviation of the independent error of each reading; inf where missing.
        by_load : (t, m) array
            Change of the readings for one standard deviation of the load.
        """
        weight = np.where(np.isfinite(sd), 1 / sd, 0.0)
        low_rank = LowRank(by_load * weight, self.own * weight.T[:, :, None], self.surface * weight[:, :, None])
        return ErrorsWithPlaces(weight, low_rank)

    def drawn(self, n: int, rng: np.random.Generator) -> FloatArray:
        """Change of the readings (n, t, m) by functions drawn from their prior."""
        own = self.own.shape[0] * self.own.shape[2]
        return self.added(rng.standard_normal((n, own + self.surface.shape[2])))

    def added(self, weights: FloatArray) -> FloatArray:
        """Change of the readings (..., t, m) for weights (..., m r + q)."""
        return LowRank(np.zeros(self.surface.shape[:2]), self.own, self.surface).added(weights)
