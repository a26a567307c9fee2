"""Smooth random functions (Gaussian processes) as a sum of basis functions with standard normal weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray

# Knots per correlation length: halfway between two knots the conditional sd of this Matérn process is 16 % of its sd,
# and 6 % with twice as many knots.
KNOTS_A_LENGTH = 2.0
DENSE = 4.0


@dataclass(frozen=True, eq=False)
class SmoothBasis:
    """A Gaussian process of sd 1 with Matérn 3/2 correlation, defined by its values at equally spaced knots.

    ``f(x) = basis(x) @ w`` with independent standard normal weights w (the conditional mean given the knot values).

    Attributes
    ----------
    knots : (k,) array
        Positions of the knots.
    length : float
        Correlation length, in the unit of the variable.
    root : (k, k) array
        Inverse of the Cholesky factor of the knots' correlation, transposed.
    """

    knots: FloatArray
    length: float
    root: FloatArray

    @classmethod
    def of(
        cls, low: float, high: float, length: float, *, knots: float = KNOTS_A_LENGTH, most: int = 60
    ) -> SmoothBasis:
        """Return the process on `low` to `high` with `knots` knots per length, but not more than `most` in all.

        The length is increased if it would need more than `most` knots at `KNOTS_A_LENGTH`.
        """
        span = max(high - low, 1e-12)
        length = max(length, span * KNOTS_A_LENGTH / (most - 1))
        count = max(2, int(np.ceil(span / length * KNOTS_A_LENGTH)) + 1)
        if knots > KNOTS_A_LENGTH:
            count = max(count, min(most, int(np.ceil(span / length * knots)) + 1))
        places = np.linspace(low, high, count)
        correlation = matern_3_2(np.abs(places[:, None] - places) / length) + 1e-9 * np.eye(count)
        root = np.linalg.inv(np.linalg.cholesky(correlation)).T
        return cls(places, float(length), np.asarray(root))

    def __call__(self, x: ArrayLike) -> FloatArray:
        """Return the values of the basis functions, shape ``x.shape + (k,)``; zero where x is NaN."""
        return np.asarray(self._correlation(x) @ self.root)

    def summed(self, x: ArrayLike, weights: ArrayLike) -> FloatArray:
        """Return the function with these weights (k,), shape of `x`; as ``basis(x) @ weights``, in fewer steps."""
        return np.asarray(self._correlation(x) @ (self.root @ np.asarray(weights)))

    def _correlation(self, x: ArrayLike) -> FloatArray:
        """Correlation with each knot, shape ``x.shape + (k,)``."""
        x = np.asarray(x, dtype=float)
        return matern_3_2(np.abs(np.where(np.isnan(x), np.inf, x)[..., None] - self.knots) / self.length)


def matern_3_2(distance: FloatArray) -> FloatArray:
    """Matérn correlation of smoothness 3/2; distance in units of the correlation length."""
    scaled = np.sqrt(3.0) * np.minimum(distance, 400.0)
    return np.asarray((1 + scaled) * np.exp(-scaled))


@dataclass(frozen=True, eq=False)
class PlaceBasis:
    """The process of `SmoothBasis` over locations of one or two coordinates, with knots on a grid; D coordinates.

    Attributes
    ----------
    knots : (k, D) array
        Positions of the knots; at some lengths from all knots the process goes to zero.
    length : float
        Correlation length, in the unit of the coordinates.
    root : (k, k) array
        As in `SmoothBasis`.
    """

    knots: FloatArray
    length: float
    root: FloatArray

    @classmethod
    def grid(cls, low: ArrayLike, high: ArrayLike, length: float, *, most: int = 200) -> FloatArray:
        """Return the nodes (k, D) of a grid over a box; the spacing is increased to keep at most `most` nodes."""
        low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        step = length / KNOTS_A_LENGTH
        while np.prod(np.ceil((high - low) / step) + 1) > most:
            step *= 1.1
        axes = [np.linspace(a, b, max(2, int(np.ceil((b - a) / step)) + 1)) for a, b in zip(low, high, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))

    @classmethod
    def at(cls, knots: FloatArray, length: float) -> PlaceBasis:
        """Return the process with the given knots (k, D)."""
        correlation = matern_3_2(distances(knots, knots) / length) + 1e-9 * np.eye(len(knots))
        return cls(knots, length, np.asarray(np.linalg.inv(np.linalg.cholesky(correlation)).T))

    def __call__(self, place: FloatArray) -> FloatArray:
        """Return the values of the basis functions at locations (n, D), shape (n, k)."""
        return np.asarray(matern_3_2(distances(place, self.knots) / self.length) @ self.root)


def distances(first: FloatArray, second: FloatArray) -> FloatArray:
    """Distances between locations (n, D) and (k, D), shape (n, k)."""
    return np.asarray(np.sqrt(sum((a[:, None] - b) ** 2 for a, b in zip(first.T, second.T, strict=True))))
