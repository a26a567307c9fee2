"""Smooth random functions of one variable, as a few weights of known prior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray

# Knots a length: halfway between two of them a Matérn function of this smoothness is left open by 16 % of its sd,
# and by 6 % where knots are twice as dense.
KNOTS_A_LENGTH = 2.0
DENSE = 4.0


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
    def of(
        cls, low: float, high: float, length: float, *, knots: float = KNOTS_A_LENGTH, most: int = 60
    ) -> SmoothBasis:
        """Process on the interval from `low` to `high`, with so many `knots` a length, but not more than `most`.

        A length that would need more than `most` knots at `KNOTS_A_LENGTH` is raised.
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
        """Values of the basis functions, shape ``x.shape + (k,)``; zero where x is NaN."""
        x = np.asarray(x, dtype=float)
        distance = np.abs(np.where(np.isnan(x), np.inf, x)[..., None] - self.knots) / self.length
        return np.asarray(matern_3_2(distance) @ self.root)


def matern_3_2(distance: FloatArray) -> FloatArray:
    """Matérn correlation of smoothness 3/2 at a distance in lengths."""
    scaled = np.sqrt(3.0) * np.minimum(distance, 400.0)
    return np.asarray((1 + scaled) * np.exp(-scaled))


@dataclass(frozen=True, eq=False)
class PlaceBasis:
    """The same process over places of one or two coordinates, held at the nodes of a grid; D coordinates.

    Attributes
    ----------
    knots : (k, D) array
        Where it is held; it goes back to zero within some lengths of them.
    length : float
        Correlation length, in the unit of the coordinates.
    root : (k, k) array
        As of `SmoothBasis`.
    """

    knots: FloatArray
    length: float
    root: FloatArray

    @classmethod
    def grid(cls, low: ArrayLike, high: ArrayLike, length: float, *, most: int = 200) -> FloatArray:
        """Nodes (k, D) of a grid over a box; the grid is coarser than the length asks for where that takes too many."""
        low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        step = length / KNOTS_A_LENGTH
        while np.prod(np.ceil((high - low) / step) + 1) > most:
            step *= 1.1
        axes = [np.linspace(a, b, max(2, int(np.ceil((b - a) / step)) + 1)) for a, b in zip(low, high, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))

    @classmethod
    def at(cls, knots: FloatArray, length: float) -> PlaceBasis:
        """Process held at knots (k, D)."""
        correlation = matern_3_2(_apart(knots, knots) / length) + 1e-9 * np.eye(len(knots))
        return cls(knots, length, np.asarray(np.linalg.inv(np.linalg.cholesky(correlation)).T))

    def __call__(self, place: FloatArray) -> FloatArray:
        """Values of the basis functions at places (n, D), shape (n, k)."""
        return np.asarray(matern_3_2(_apart(place, self.knots) / self.length) @ self.root)


def _apart(first: FloatArray, second: FloatArray) -> FloatArray:
    """Distances between places (n, D) and (k, D), shape (n, k)."""
    return np.asarray(np.sqrt(sum((a[:, None] - b) ** 2 for a, b in zip(first.T, second.T, strict=True))))
