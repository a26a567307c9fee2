"""Tables of a fitted model of a pad over location."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import PadChain
from bayestouch.chain.pad_map import PadMap
from bayestouch.pad.candidates import PadCandidate, kernel_shape
from bayestouch.pad.known_touches import location_spacing

# Grid points per width of the kernel: cubic splines then have errors of a few millionths of its peak.
_STEPS_PER_WIDTH = 6.0

# Fewest grid points per width, for many tables of one map: errors are then below a thousandth of the peak.
_FEWEST_PER_WIDTH = 2.0

# Smallest number of grid steps over the extent of the region, for wide kernels and corrections.
_STEPS_ACROSS = 60

# Grid points beyond the calibrated region: the error at the ends of a spline decreases by 0.27 per step.
_MARGIN_STEPS = 6

# Largest number of grid points, of all tables together: at each, the time for the variance of the correction increases
# with (touches)².
_MOST_POINTS = 12000

# Grid points for which the variance is computed together: 16 MB with 1,400 touches.
_CHUNK = 1500


def tabulate(model: PadCandidate) -> PadMap:
    """Tables of sensitivity and its variance over the calibrated region.

    The region extends one typical spacing beyond the box around the calibration touches. The variance is that of the
    chain (linear at its mode) and of the correction together: ``h C hᵀ`` plus the variance of the correction. C is the
    covariance of the parameters of the chain, and h is the derivative of the sensitivity over these parameters minus
    the part that the correction compensates (C. E. Rasmussen and C. K. I. Williams 2006, equation 2.42).
    """
    grid = MapGrid.of(model, model.fit.misfit.length_mm if model.has_map else np.inf)
    return grid.map_of(model, *grid.tables(lambda points: _sensitivity(model, points)))


@dataclass(frozen=True, eq=False)
class MapGrid:
    """Grid over the calibrated region, D coordinates.

    Attributes
    ----------
    low, high : (D,) arrays
        Ends of the region, mm.
    step : float
        Distance between grid points, mm.
    axes : tuple of D arrays
        Grid points along each coordinate, mm; they extend beyond the region by a margin.
    """

    low: FloatArray
    high: FloatArray
    step: float
    axes: tuple[FloatArray, ...]

    @classmethod
    def of(cls, model: PadCandidate, length_mm: float, tables: int = 1) -> MapGrid:
        """Grid for `tables` tables of a map whose shortest correlation length is `length_mm`, mm.

        It is coarser for many tables, but not so coarse that a table is wrong: see `most_tables`.
        """
        location = model.fit.known.location
        spacing = location_spacing(location)
        low, high = location.min(axis=0) - spacing, location.max(axis=0) + spacing
        width = min(kernel_width(model.fit.chain, extent=float((high - low).max())), length_mm)
        step = min(width / _STEPS_PER_WIDTH, float((high - low).max()) / _STEPS_ACROSS)
        while (points := np.prod((high - low) / step + 2 * _MARGIN_STEPS + 1)) > _MOST_POINTS or (
            tables * points > _MOST_POINTS and 1.1 * step <= width / _FEWEST_PER_WIDTH
        ):
            step *= 1.1
        axes = tuple(
            np.arange(np.ceil((b - a) / step) + 2 * _MARGIN_STEPS + 1) * step + a - _MARGIN_STEPS * step
            for a, b in zip(low, high, strict=True)
        )
        return cls(low, high, step, axes)

    @property
    def most_tables(self) -> int:
        """Number of tables that together have no more points than a map may have, at least 1."""
        return max(int(_MOST_POINTS / np.prod([len(axis) for axis in self.axes])), 1)

    def tables(self, at: Callable[[FloatArray], tuple[FloatArray, ...]]) -> tuple[FloatArray, ...]:
        """Values (..., m) over the grid of a function that returns arrays (k, m) for points (k, D)."""
        grid = np.stack(np.meshgrid(*self.axes, indexing="ij"), axis=-1)
        points = grid.reshape(-1, grid.shape[-1])
        parts = [at(points[i : i + _CHUNK]) for i in range(0, len(points), _CHUNK)]
        return tuple(np.concatenate(each).reshape(*grid.shape[:-1], -1) for each in zip(*parts, strict=True))

    def map_of(
        self, model: PadCandidate, sensitivity: FloatArray, variance: FloatArray, covariance: FloatArray
    ) -> PadMap:
        """The map with these tables and the offsets of a model."""
        fit = model.fit
        m = fit.chain.n_elements
        return PadMap(
            origin=np.array([axis[0] for axis in self.axes]),
            step=np.full(len(self.axes), self.step),
            low=self.low,
            high=self.high,
            offset=fit.chain.offset,
            offset_variance=np.diag(fit.laplace.covariance)[m : 2 * m].copy(),
            sensitivity=sensitivity,
            variance=variance,
            covariance=covariance,
        )


def _sensitivity(model: PadCandidate, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sensitivity, its variance and its covariance with the offset at points (k, D), three (k, m) arrays."""
    fit = model.fit
    chain, misfit, covariance = fit.chain, fit.misfit, fit.laplace.covariance
    m = chain.n_elements
    sensitivity = chain.sensitivity(points)
    derivative = chain.sensitivity_derivatives(points)
    shape = kernel_shape(model.shape, points)
    variance, with_offset = np.zeros_like(sensitivity), np.zeros_like(sensitivity)
    for e, (columns, jacobian) in enumerate(fit.jacobian):
        h = derivative[:, e, columns]
        if model.has_map:
            covariance_of_map, functions = misfit.covariances[e], misfit.functions_at(e, points, shape[:, e])
            sensitivity[:, e] += functions @ covariance_of_map.weights(fit.residual[:, e])
            h = h - functions @ covariance_of_map.weights(jacobian)
            variance[:, e] = covariance_of_map.variance_at(misfit.prior_variance(e, shape[:, e]), functions)
        variance[:, e] += np.einsum("kp,pq,kq->k", h, covariance[np.ix_(columns, columns)], h)
        with_offset[:, e] = h @ covariance[columns, m + e]
    return sensitivity, variance, with_offset


def kernel_width(chain: PadChain, extent: float) -> float:
    """Distance at which the kernel has decreased to e^(-1/2), mm; `extent` (mm) if it never does."""
    distance = np.linspace(0, extent, 2000)
    fallen = chain.kernel(distance, chain.values) < np.exp(-0.5)
    return float(distance[fallen.argmax()]) if fallen.any() else extent
