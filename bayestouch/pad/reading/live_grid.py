"""Quadrature over the location of one touch on a pad: Gauss-Legendre nodes on an adapted region."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray

# Number of nodes of each coordinate, in one and in two dimensions: at first, and if these do not resolve the posterior.
NODES = {1: (25, 61), 2: (15, 31)}
# Half width of the region in sd, and number of points between which a distribution function is interpolated.
REACH, FINE = 5.0, 41


@dataclass(frozen=True, eq=False)
class Region:
    """Region that contains the posterior of a location: an interval, or a sheared box in two dimensions; D coordinates.

    The second coordinate is centred on its regression on the first, so that the nodes follow a narrow ridge.

    Attributes
    ----------
    low, high : (D,) arrays
        Calibrated region, mm.
    mean : (D,) array
        Centre, mm.
    covariance : (D, D) array
        Covariance, which determines the widths, mm².
    n : int
        Number of nodes of each coordinate.
    """

    low: FloatArray
    high: FloatArray
    mean: FloatArray
    covariance: FloatArray
    n: int

    def nodes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Locations (n, D), weights (n,), and the ends (k, 2) of the last coordinate for each node of the first."""
        dimensions = len(self.mean)
        unit, weight = _legendre(self.n)
        sd = float(np.sqrt(self.covariance[0, 0]))
        begin, end = _clipped(self.mean[0] - REACH * sd, self.mean[0] + REACH * sd, self.low[0], self.high[0])
        first = begin + (end - begin) * unit
        weights = (end - begin) * weight
        if dimensions == 1:
            return first[:, None], weights, np.array([[begin, end]])
        slope = self.covariance[0, 1] / self.covariance[0, 0]
        own = np.sqrt(max(self.covariance[1, 1] - slope * self.covariance[0, 1], 1e-4 * self.covariance[1, 1]))
        centre = self.mean[1] + slope * (first - self.mean[0])
        low, high = _clipped(centre - REACH * own, centre + REACH * own, self.low[1], self.high[1])
        second = low[:, None] + (high - low)[:, None] * unit
        out = np.stack([np.repeat(first, len(unit)), second.ravel()], axis=-1)
        both = (weights * (high - low))[:, None] * weight
        return out, both.ravel(), np.stack([low, high], axis=-1)

    def at_ends(self, mass: FloatArray, ends: FloatArray) -> float:
        """Largest share of the masses (n,) in the outermost nodes; ends of the calibrated region are not counted."""
        n = self.n
        if len(self.mean) == 1:
            open_ = ends[0, 0] > self.low[0], ends[0, 1] < self.high[0]
            return float(max(mass[0] * open_[0], mass[-1] * open_[1]))
        table = mass.reshape(n, n)
        rows = table.sum(axis=1)
        sd = np.sqrt(self.covariance[0, 0])
        first = (
            rows[0] * (self.mean[0] - REACH * sd > self.low[0]),
            rows[-1] * (self.mean[0] + REACH * sd < self.high[0]),
        )
        second = (table[:, 0] * (ends[:, 0] > self.low[1])).sum(), (table[:, -1] * (ends[:, 1] < self.high[1])).sum()
        return float(max(*first, *second))

    def unresolved(self, mass: FloatArray) -> float:
        """Largest of the last three Legendre coefficients of marginal densities over the first; small if resolved."""
        _, weight = _legendre(self.n)
        table = mass.reshape(self.n, -1)
        marginals = [table.sum(axis=1) / weight]
        if len(self.mean) == 2:
            marginals.append(table.sum(axis=0) / weight)
        last = [np.abs(_highest(self.n) @ each).max() / (each @ weight) for each in marginals]
        return float(max(last))

    def quantiles(self, location: FloatArray, mass: FloatArray, ends: FloatArray, levels: FloatArray) -> FloatArray:
        """Quantiles of each coordinate (D, q), from locations (n, D) and masses (n,) of `nodes`."""
        n, dimensions = self.n, len(self.mean)
        unit, weight = _legendre(n)
        fine, below = _cumulated(n)
        table = mass.reshape(n, -1) if dimensions == 2 else mass[:, None]
        rows = table.sum(axis=1)
        # Density of the first coordinate over its interval, whose ends follow from two nodes.
        x = location.reshape(n, -1, dimensions)[:, 0, 0]
        width = (x[-1] - x[0]) / (unit[-1] - unit[0])
        begin = x[0] - width * unit[0]
        out = [np.interp(levels, _increasing(below @ (rows / weight)), begin + width * fine)]
        if dimensions == 2:
            grid = np.linspace(ends[:, 0].min(), ends[:, 1].max(), 4 * FINE)
            sums = table / weight @ below.T
            total = np.zeros(len(grid))
            for (low, high), sum_ in zip(ends.tolist(), sums, strict=True):
                total += np.interp(grid, low + (high - low) * fine, sum_)
            out.append(np.interp(levels, _increasing(total), grid))
        return np.array(out)


def _increasing(values: FloatArray) -> FloatArray:
    """The distribution function made increasing, with the end 1: interpolation may have made it decrease somewhere."""
    out = np.maximum.accumulate(np.maximum(values, 0.0))
    return np.asarray(out / out[-1] + 1e-12 * np.arange(len(out)))


def _clipped(begin: Any, end: Any, low: float, high: float) -> tuple[Any, Any]:
    """Interval inside the calibrated region, never empty."""
    least = 1e-3 * (high - low)
    begin = np.minimum(np.maximum(begin, low), high - least)
    return begin, np.maximum(np.minimum(end, high), begin + least)


@cache
def _legendre(n: int) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre nodes and weights on 0 to 1."""
    x, weight = np.polynomial.legendre.leggauss(n)
    return 0.5 * (x + 1), 0.5 * weight


@cache
def _highest(n: int) -> FloatArray:
    """Matrix (3, n) from values at the nodes to the three highest Legendre coefficients."""
    unit, weight = _legendre(n)
    terms = np.polynomial.legendre.legvander(2 * unit - 1, n - 1)
    return np.asarray(((terms * weight[:, None]).T * (2 * np.arange(n)[:, None] + 1))[-3:])


@cache
def _cumulated(n: int) -> tuple[FloatArray, FloatArray]:
    """Points from 0 to 1, and the matrix (points, n) from values at the nodes to the integral up to each point."""
    unit, weight = _legendre(n)
    fine = np.linspace(0.0, 1.0, FINE)
    # Legendre series of the interpolating polynomial, integrated term by term.
    terms = np.polynomial.legendre.legvander(2 * unit - 1, n - 1)
    coefficients = (terms * weight[:, None]).T * (2 * np.arange(n)[:, None] + 1)
    integrals = [np.polynomial.legendre.legint(np.eye(n)[k], lbnd=-1) for k in range(n)]
    values = np.stack([np.polynomial.legendre.legval(2 * fine - 1, each) for each in integrals], axis=1)
    return fine, 0.5 * values @ coefficients
