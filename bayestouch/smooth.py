"""Smooth random functions of one variable, as a few weights of known prior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

# Knots a length: halfway between two of them a Matérn function of this smoothness is known to 4 % of its sd.
KNOTS_A_LENGTH = 2.0


@dataclass(frozen=True, eq=False)
class SmoothBasis:
    """A Gaussian process of sd 1 with the Matérn 3/2 correlation, held at equally spaced knots.

    ``f(x) = basis(x) @ w`` with independent standard normal weights w (the process given its values at the knots).

    Attributes
    ----------
    knots : (k,) array
        Where it is held.
    length : float
        Correlation length, in the unit of the variable.
    root : (k, k) array
        Inverse of the Cholesky factor of the knots' correlation, transposed.
    """

    knots: FloatArray
    length: float
    root: FloatArray

    @classmethod
    def of(cls, low: float, high: float, length: float, *, most: int = 60) -> SmoothBasis:
        """Process on the interval from `low` to `high`; a length that would need more than `most` knots is raised."""
        span = max(high - low, 1e-12)
        length = max(length, span * KNOTS_A_LENGTH / (most - 1))
        count = max(2, int(np.ceil(span / length * KNOTS_A_LENGTH)) + 1)
        knots = np.linspace(low, high, count)
        correlation = matern(np.abs(knots[:, None] - knots) / length) + 1e-9 * np.eye(count)
        root = np.linalg.inv(np.linalg.cholesky(correlation)).T
        return cls(knots, float(length), np.asarray(root))

    def __call__(self, x: ArrayLike) -> FloatArray:
        """Values of the basis functions, shape ``x.shape + (k,)``; zero where x is NaN."""
        x = np.asarray(x, dtype=float)
        distance = np.abs(np.where(np.isnan(x), np.inf, x)[..., None] - self.knots) / self.length
        return np.asarray(matern(distance) @ self.root)


def matern(distance: FloatArray) -> FloatArray:
    """Matérn correlation of smoothness 3/2 at a distance in lengths."""
    scaled = np.sqrt(3.0) * np.minimum(distance, 400.0)
    return np.asarray((1 + scaled) * np.exp(-scaled))
