"""Tables of a fitted model of a pad over location."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import PadChain
from bayestouch.chain.pad_map import PadMap
from bayestouch.pad.candidates import PadCandidate, kernel_shape
from bayestouch.pad.known_touches import location_spacing

# Grid points per width of the kernel: cubic splines then have errors of a few millionths of its peak.
_STEPS_PER_WIDTH = 6.0

# Smallest number of grid points over the extent of the pad, for wide kernels and corrections.
_STEPS_ACROSS = 60

# Grid points beyond the calibrated region: the error at the ends of a spline decreases by 0.27 per step.
_MARGIN_STEPS = 6

# Largest number of grid points; the variance of the correction costs (touches)² for each.
_MOST_POINTS = 12000

# Grid points for which the variance is computed together: 16 MB with 1,400 touches.
_CHUNK = 1500


def tabulate(model: PadCandidate) -> PadMap:
    """Tables of sensitivity and its variance over the calibrated region.

    The region extends one typical spacing beyond the box around the calibration touches. The variance is that of chain
    (linear at its mode) and correction together: ``h C hᵀ`` plus the variance of the correction, where h is the
    derivative of the sensitivity over the parameters of the chain minus the part that the correction compensates
    (C. E. Rasmussen and C. K. I. Williams 2006, equation 2.42).
    """
    fit = model.fit
    low, high, step, axes = map_grid(model, fit.misfit.length_mm if model.has_map else np.inf)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    points = grid.reshape(-1, grid.shape[-1])
    parts = [_sensitivity(model, points[i : i + _CHUNK]) for i in range(0, len(points), _CHUNK)]
    sensitivity, variance, covariance = (
        np.concatenate(each).reshape(*grid.shape[:-1], -1) for each in zip(*parts, strict=True)
    )
    m = fit.chain.n_elements
    offsets = slice(m, 2 * m)
    return PadMap(
        origin=np.array([axis[0] for axis in axes]),
        step=np.full(len(axes), step),
        low=low,
        high=high,
        offset=fit.chain.offset,
        offset_variance=np.diag(fit.laplace.covariance)[offsets].copy(),
        sensitivity=sensitivity,
        variance=variance,
        covariance=covariance,
    )


def map_grid(
    model: PadCandidate, length_mm: float, tables: int = 1
) -> tuple[FloatArray, FloatArray, float, tuple[FloatArray, ...]]:
    """Ends of the calibrated region (D,), step of the grid of a map, mm, and its points along each coordinate.

    Parameters
    ----------
    model : PadCandidate
        Model with the known touches.
    length_mm : float
        Shortest correlation length of the map, mm.
    tables : int
        Number of tables over this grid.
    """
    location = model.fit.known.location
    spacing = location_spacing(location)
    low, high = location.min(axis=0) - spacing, location.max(axis=0) + spacing
    step = min(kernel_width(model.fit.chain, extent=float((high - low).max())), length_mm)
    step = min(step / _STEPS_PER_WIDTH, float((high - low).max()) / _STEPS_ACROSS)
    while tables * np.prod((high - low) / step + 2 * _MARGIN_STEPS + 1) > _MOST_POINTS:
        step *= 1.1
    axes = tuple(
        np.arange(np.ceil((b - a) / step) + 2 * _MARGIN_STEPS + 1) * step + a - _MARGIN_STEPS * step
        for a, b in zip(low, high, strict=True)
    )
    return low, high, step, axes


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
            cross = misfit.cross(e, points, shape[:, e])
            explained = misfit.whiten(e, cross.T)
            sensitivity[:, e] += cross @ fit.weights[:, e]
            h = h - explained.T @ misfit.whiten(e, jacobian)
            own = misfit.prior_variance(e, shape[:, e]) - np.einsum("nk,nk->k", explained, explained)
            variance[:, e] = np.maximum(own, 0.0)
        variance[:, e] += np.einsum("kp,pq,kq->k", h, covariance[np.ix_(columns, columns)], h)
        with_offset[:, e] = h @ covariance[columns, m + e]
    return sensitivity, variance, with_offset


def kernel_width(chain: PadChain, extent: float) -> float:
    """Distance at which the kernel has decreased to e^(-1/2), mm; `extent` (mm) if it never does."""
    distance = np.linspace(0, extent, 2000)
    fallen = chain.kernel(distance, chain.values) < np.exp(-0.5)
    return float(distance[fallen.argmax()]) if fallen.any() else extent
