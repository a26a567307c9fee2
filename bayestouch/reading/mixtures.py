"""Quantiles of a mixture of normal distributions, and interpolation between even knots."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.special import ndtr, ndtri

from bayestouch.array_types import FloatArray

# Newton steps for a quantile, error of its probability that is accepted, and halvings if they do not converge.
_STEPS, _CLOSE, _HALVINGS = 4, 3e-4, 40
# Points between two knots of a tabulated density.
_FINER = 8
_PEAK = 0.3989422804014327  # of the standard normal density


def mixture_quantiles(weight: FloatArray, mean: FloatArray, sd: FloatArray, levels: FloatArray) -> FloatArray:
    """Quantiles (d, q) at `levels` (q,) of d mixtures of g normal distributions.

    Parameters
    ----------
    weight : (g,) array
        Weights with sum 1, the same for all mixtures.
    mean, sd : (d, g) arrays
        Means and standard deviations of the parts; an sd may be 0.
    """
    centre = mean @ weight
    off, square = mean - centre[:, None], sd * sd
    variance = (off * off + square) @ weight
    spread = np.sqrt(variance)
    skew = (off * (off * off + 3 * square)) @ weight / (variance * spread)
    # Cornish-Fisher expansion as a start.
    normal = ndtri(levels)
    x = centre[:, None] + spread[:, None] * (normal + skew[:, None] / 6 * (normal * normal - 1))
    inverse = 1 / np.maximum(sd[:, None], 1e-300)
    scaled, height = mean[:, None] * inverse, (weight * inverse) * _PEAK
    limit = 0.7 * spread[:, None]
    for _ in range(_STEPS):
        z = x[:, :, None] * inverse - scaled
        miss = ndtr(z) @ weight - levels
        if np.abs(miss).max() < _CLOSE:
            return np.asarray(x)
        density = (np.exp(-0.5 * z * z) * height).sum(axis=2)
        step = miss / np.maximum(density, 1e-300)
        x = x - np.minimum(np.maximum(step, -limit), limit)
    low, high = (
        np.repeat(end[:, None], len(levels), axis=1)
        for end in ((mean - 8 * sd).min(axis=1), (mean + 8 * sd).max(axis=1))
    )
    for _ in range(_HALVINGS):
        x = 0.5 * (low + high)
        under = ndtr(x[:, :, None] * inverse - scaled) @ weight < levels
        low, high = np.where(under, x, low), np.where(under, high, x)
    return np.asarray(x)


def finer(values: FloatArray) -> FloatArray:
    """Values at even knots (g,), interpolated by a cubic spline between them to 8 (g - 1) + 1 points."""
    return _cubic(len(values)) @ values


@cache
def _cubic(n: int) -> FloatArray:
    """Matrix of the cubic spline (not-a-knot) through n even knots, at points `_FINER` times as dense."""
    from scipy.interpolate import CubicSpline

    points = np.linspace(0, n - 1, (n - 1) * _FINER + 1)
    return np.asarray(CubicSpline(np.arange(n), np.eye(n))(points))
