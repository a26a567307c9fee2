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
# Correlation lengths beyond which a correlation is zero: it is far below the smallest double.
FAR = 400.0


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
        cls, low: float, high: float, length: float, *, knots: float = KNOTS_A_LENGTH, most: int = 60, least: int = 2
    ) -> SmoothBasis:
        """Return the process on `low` to `high` with `knots` knots per length, from `least` to `most` in all.

        The length is increased if it would need more than `most` knots at `KNOTS_A_LENGTH`.
        """
        span = max(high - low, 1e-12)
        length = max(length, span * KNOTS_A_LENGTH / (most - 1))
        count = max(least, int(np.ceil(span / length * KNOTS_A_LENGTH)) + 1)
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
        """Return the function with these weights (k,), shape of `x`; as ``basis(x) @ weights``, in fewer steps.

        Between two knots the knots below sum to ``(a + b u) exp(-u)`` with the distance u from the knot below, and
        those above to such a function of the distance from the knot above: two exponentials in place of k.
        """
        size, unit = self.root @ np.asarray(weights), np.sqrt(3.0) / self.length
        apart = unit * np.abs(self.knots[:, None] - self.knots)
        faded = size * np.exp(-apart)
        # At each knot, from itself and the knots below; from itself and those above. None are below the first.
        below = np.stack([np.tril(faded * (1 + apart)).sum(axis=1), np.tril(faded).sum(axis=1)])
        above = np.stack([np.triu(faded * (1 + apart)).sum(axis=1), np.triu(faded).sum(axis=1)])
        a, b = np.pad(below, ((0, 0), (1, 0)))
        c, d = np.pad(above, ((0, 0), (0, 1)))
        x = np.asarray(np.clip(np.nan_to_num(np.asarray(x, dtype=float), nan=np.inf), *self._reach))
        passed = np.searchsorted(self.knots, x)
        u = unit * np.maximum(x - self.knots[np.maximum(passed - 1, 0)], 0.0)
        v = unit * np.maximum(self.knots[np.minimum(passed, len(self.knots) - 1)] - x, 0.0)
        return np.asarray((a[passed] + b[passed] * u) * np.exp(-u) + (c[passed] + d[passed] * v) * np.exp(-v))

    @property
    def _reach(self) -> tuple[float, float]:
        """Positions beyond which the function is zero."""
        return float(self.knots[0] - FAR * self.length), float(self.knots[-1] + FAR * self.length)

    def _correlation(self, x: ArrayLike) -> FloatArray:
        """Correlation with each knot, shape ``x.shape + (k,)``."""
        x = np.asarray(x, dtype=float)
        return matern_3_2(np.abs(np.where(np.isnan(x), np.inf, x)[..., None] - self.knots) / self.length)


def matern_3_2(distance: FloatArray) -> FloatArray:
    """Matérn correlation of smoothness 3/2; distance in units of the correlation length."""
    scaled = np.sqrt(3.0) * np.minimum(distance, FAR)
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
