"""Pareto-smoothed importance weights of many blocks at once.

Vehtari, Simpson, Gelman, Yao and Gabry (2024), Journal of Machine Learning Research 25(72), with the
conventions of ArviZ.
"""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray, IndexArray

# Weights below the smallest normal number (relative to the largest) are taken as zero.
_LEAST_LOG = float(np.log(np.finfo(float).tiny))
_SLICE = 1 << 17  # number of points processed together
#: Shape above which the tail of weights is looked at more closely, see `shape_that_counts`.
DOUBTFUL = 0.5
#: A tail counts if its weights exceed the smallest of them by this share of all weights together. The largest weights
#: are some three sd from the mean: if as much again is missing there, a mean moves by 0.03 sd, less than by the Monte
#: Carlo error of 400 draws (0.05 sd).
NEGLIGIBLE = 0.01


def pareto_smooth(log_weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return importance weights with smoothed largest values, and the Pareto shape of their tail.

    Parameters
    ----------
    log_weights : (B, n) array
        Log ratios of posterior to proposal up to a constant per block; ``-inf`` where the posterior is zero.

    Returns
    -------
    weights : (B, n) array
        Smoothed weights; each row adds up to 1, or is zero if no weight is finite.
    shape : (B,) array
        Pareto shape k: below 0.7 weighted means are reliable; inf if fewer than five weights are in the tail.
    """
    weights, shape = np.empty(log_weights.shape), np.empty(len(log_weights))
    for part in _slices(log_weights):
        relative = _relative(log_weights[part])
        smoothed = np.exp(relative)
        _replace_tails(relative, smoothed, shape[part])
        total = smoothed.sum(axis=1, keepdims=True)
        weights[part] = smoothed / np.where(total > 0, total, 1.0)
    return weights, shape


def pareto_shape(log_weights: FloatArray) -> FloatArray:
    """Return the Pareto shape k of importance weights, (B, n) -> (B,); see `pareto_smooth`."""
    shape = np.empty(len(log_weights))
    for part in _slices(log_weights):
        _replace_tails(_relative(log_weights[part]), None, shape[part])
    return shape


def shape_that_counts(log_weights: FloatArray, shape: FloatArray) -> FloatArray:
    """Return the Pareto shape of each row of weights (B, n); 0 where the tail is too light to change a result.

    The shape alone does not say how much weight a tail has: weights that are nearly equal may have one of shape 1.

    Parameters
    ----------
    log_weights : (B, n) array
        As of `pareto_smooth`.
    shape : (B,) array
        Pareto shapes of the rows.
    """
    out, n = shape.copy(), log_weights.shape[1]
    doubtful = np.flatnonzero(shape > DOUBTFUL)
    tail, step = min(_tail_length(n), n - 1), max(1, _SLICE // n)
    for part in (doubtful[first : first + step] for first in range(0, len(doubtful), step)):
        weights = np.exp(_relative(log_weights[part]))
        top = np.partition(weights, n - tail - 1, axis=1)[:, n - tail - 1 :]
        excess = (top - top.min(axis=1, keepdims=True)).sum(axis=1)
        out[part[excess < NEGLIGIBLE * weights.sum(axis=1)]] = 0.0
    return out


def systematic_resample(weights: FloatArray, n: int, offset: FloatArray) -> IndexArray:
    """Return indices (B, n); each occurs n times its weight (B, N), rounded up or down.

    Parameters
    ----------
    weights : (B, N) array
        Rows that add up to 1; a row of zeros is resampled uniformly.
    n : int
        Number of indices.
    offset : (B, 1) array
        Uniform random numbers in [0, 1).
    """
    size = weights.shape[1]
    even = np.where(weights.sum(axis=1, keepdims=True) > 0, weights, 1 / size)
    ends = np.floor(n * np.cumsum(even, axis=1) + offset).astype(np.intp)
    ends[:, -1] = n
    np.minimum(ends, n, out=ends)
    counts = np.diff(ends, axis=1, prepend=0)
    columns = np.broadcast_to(np.arange(size), weights.shape)
    return np.repeat(columns.ravel(), counts.ravel()).reshape(len(weights), n)


def _slices(log_weights: FloatArray) -> list[slice]:
    step = max(1, _SLICE // log_weights.shape[1])
    return [slice(first, first + step) for first in range(0, len(log_weights), step)]


def _relative(log_weights: FloatArray) -> FloatArray:
    """Log weights relative to the largest of each row."""
    largest = log_weights.max(axis=1, keepdims=True)
    return np.asarray(log_weights - np.where(np.isfinite(largest), largest, 0.0))


def _tail_length(n: int) -> int:
    return int(np.ceil(min(n / 5, 3 * np.sqrt(n))))


def _replace_tails(relative: FloatArray, smoothed: FloatArray | None, shape: FloatArray) -> None:
    """Fit the tail of each row; write the shape and, unless `smoothed` is None, the smoothed weights."""
    n = relative.shape[1]
    length = _tail_length(n)
    if length >= n:
        shape[:] = np.inf
        return
    if smoothed is None:
        top = np.partition(relative, n - length - 1, axis=1)[:, n - length - 1 :]
        top.sort(axis=1)
        places = None
    else:
        unordered = np.argpartition(relative, n - length - 1, axis=1)[:, n - length - 1 :]
        top = np.take_along_axis(relative, unordered, axis=1)
        order = np.argsort(top, axis=1)
        top, places = np.take_along_axis(top, order, axis=1), np.take_along_axis(unordered, order, axis=1)
    cutoff = np.maximum(top[:, :1], _LEAST_LOG)
    # Ties with the cut-off and zero weights shorten the tail of a row: rows with equal tail length are fitted together.
    lengths = (top[:, 1:] > cutoff).sum(axis=1)
    for size in np.unique(lengths):
        rows = np.flatnonzero(lengths == size)
        if size <= 4:
            shape[rows] = np.inf
            continue
        base = np.exp(cutoff[rows])
        excess = np.exp(top[rows, -size:]) - base
        k, sigma = _fit_pareto(excess)
        shape[rows] = k
        if smoothed is not None and places is not None:
            tail = np.minimum(_pareto_quantiles(size, k, sigma) + base, 1.0)
            usable = np.isfinite(k) & np.isfinite(sigma) & (sigma > 0)
            smoothed[rows[usable, None], places[rows[usable], -size:]] = tail[usable]


def _fit_pareto(excess: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Shape and scale of generalised Pareto distributions, from ascending rows (B, n) of excesses.

    Zhang and Stephens (2009), doi:10.1198/tech.2009.08017, with a weak prior that shrinks k towards 0.5.
    """
    n = excess.shape[1]
    guesses = 30 + int(np.sqrt(n))
    quartile, largest = excess[:, int(n / 4 + 0.5) - 1, None], excess[:, -1:]
    spread = 1 - np.sqrt(guesses / (np.arange(1, guesses + 1) - 0.5))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # excesses that underflow
        slope = spread / (3 * quartile) + 1 / largest
        shape = np.log1p(-slope[:, :, None] * excess[:, None, :]).mean(axis=2)
        profile = n * (np.log(-slope / shape) - shape - 1)
        weight = np.exp(profile - profile.max(axis=1, keepdims=True))
        weight /= weight.sum(axis=1, keepdims=True)
        weight[weight < 10 * np.finfo(float).eps] = 0.0
        slope_mean = (slope * weight).sum(axis=1) / weight.sum(axis=1)
        k = np.log1p(-slope_mean[:, None] * excess).mean(axis=1)
        sigma = -k / slope_mean
    return np.nan_to_num((n * k + 5) / (n + 10), nan=np.inf), sigma


def _pareto_quantiles(n: int, k: FloatArray, sigma: FloatArray) -> FloatArray:
    """Quantiles at (i + 1/2)/n of generalised Pareto distributions, (B, n)."""
    log_survival = np.log1p(-(np.arange(n) + 0.5) / n)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        quantiles = np.expm1(-k[:, None] * log_survival) / k[:, None]
    return np.where(np.abs(k[:, None]) < np.finfo(float).eps, -log_survival, quantiles) * sigma[:, None]
