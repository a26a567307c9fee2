"""Quadrature over the location of one touch on a pad: Gauss-Legendre nodes on an adapted region."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray

# Number of nodes of each coordinate, in one and in two dimensions: at first, and if these do not resolve the posterior.
NODES = {1: (25, 61), 2: (15, 31)}
# Number of points between which a distribution function is interpolated.
FINE = 41
# Below this share of its largest value a density has less than 2 % of the variance beyond the end, however slowly it
# falls there (one e-fold over the region).
NOTHING = 1e-5


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
    reach : (D, 2) array
        Distances of the lower and the upper end of each coordinate from the centre, in standard deviations.
    """

    low: FloatArray
    high: FloatArray
    mean: FloatArray
    covariance: FloatArray
    n: int
    reach: FloatArray

    def nodes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Locations (n, D), weights (n,), and the ends (k, 2) of the last coordinate for each node of the first."""
        dimensions = len(self.mean)
        unit, weight = _legendre(self.n)
        begin, end = self._first_ends
        first = begin + (end - begin) * unit
        weights = (end - begin) * weight
        if dimensions == 1:
            return first[:, None], weights, np.array([[begin, end]])
        slope = self.covariance[0, 1] / self.covariance[0, 0]
        own = np.sqrt(max(self.covariance[1, 1] - slope * self.covariance[0, 1], 1e-4 * self.covariance[1, 1]))
        centre = self.mean[1] + slope * (first - self.mean[0])
        below, above = centre - self.reach[1, 0] * own, centre + self.reach[1, 1] * own
        low, high = _clipped(below, above, self.low[1], self.high[1])
        second = low[:, None] + (high - low)[:, None] * unit
        out = np.stack([np.repeat(first, len(unit)), second.ravel()], axis=-1)
        both = (weights * (high - low))[:, None] * weight
        return out, both.ravel(), np.stack([low, high], axis=-1)

    def beyond(self, mass: FloatArray, ends: FloatArray, load: FloatArray, load_sd: float) -> FloatArray:
        """Share (D, 2) of the variance of location or load, whichever is larger, that is beyond each end of the region.

        Beyond an end, the density is taken to fall exponentially, as it does at the outermost nodes, and the load to
        go on changing evenly. Ends of the calibrated region are not counted.

        Parameters
        ----------
        mass, ends : arrays
            Masses (n,) of the `nodes`, and ends (k, 2).
        load, load_sd : (n,) array, float
            Mean load at each node, and standard deviation of the load.
        """
        table, loads = mass.reshape(self.n, -1), load.reshape(self.n, -1)
        along_last = (table, loads) if len(self.mean) == 1 else (table.T, loads.T)
        out, about = np.zeros((len(self.mean), 2)), (float(mass @ load), load_sd)
        first_ends = self._first_ends
        # Rows of which this end is inside the calibrated region; in one dimension there is one row.
        for side, rows in enumerate((ends[:, 0] > self.low[-1], ends[:, 1] < self.high[-1])):
            if rows.any():
                out[-1, side] = self._tail(along_last[0][:, rows], along_last[1][:, rows], side, *about)
            if len(self.mean) == 2 and first_ends[side] not in (self.low[0], self.high[0]):
                out[0, side] = self._tail(table, loads, side, *about)
        return out

    @property
    def _first_ends(self) -> tuple[float, float]:
        """Ends of the first coordinate, mm."""
        below, above = self.mean[0] + np.array([-1, 1]) * self.reach[0] * np.sqrt(self.covariance[0, 0])
        return _clipped(below, above, self.low[0], self.high[0])

    def _tail(self, mass: FloatArray, loads: FloatArray, side: int, mean_load: float, load_sd: float) -> float:
        """Share of the variance of a coordinate or of the load beyond one end, from masses and loads (n, rows)."""
        unit, weight = _legendre(self.n)
        marginal = mass.sum(axis=1)
        density = marginal / weight
        ends = [0, 2] if side == 0 else [-1, -3]
        outer, inner = density[ends].tolist()
        if outer <= NOTHING * density.max():
            return 0.0
        step = float(abs(unit[2] - unit[0]))
        middle = float(unit @ marginal) / float(marginal.sum())
        variance = float((unit - middle) ** 2 @ marginal) / float(marginal.sum())
        if inner <= 0 or variance <= 0:
            return np.inf  # the region has nothing but its end in common with the posterior
        # At least one e-fold over the region: a density that does not fall would have no end.
        length = step / max(float(np.log(inner / outer)), step)
        load = np.einsum("er,er->e", mass[ends], loads[ends]) / marginal[ends]
        of_place = _moment(abs(unit[ends[0]] - middle), length) / variance
        of_load = _moment(load[0] - mean_load, length * (load[0] - load[1]) / step)
        return float(outer * length * max(of_place, of_load / load_sd**2 if load_sd > 0 else 0.0))

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


def _moment(value: float, change: float) -> float:
    """Mean of ``(value + change t)²`` for an exponential distance ``t`` with mean 1."""
    return value * value + 2 * value * change + 2 * change * change


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
