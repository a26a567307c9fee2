"""Discrepancy of a fitted model for each element, and the noise of the load that the fit assumes."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import read_once
from bayestouch.model.fitting import Fitted


def discrepancy(fitted: Fitted) -> FloatArray:
    """Standard deviation of the model error of each element's mean readings, (m,), in the unit of the readings.

    The mean square of the whitened residuals of each element is shrunk towards that of all elements (empirical Bayes).
    Its part above one is the discrepancy. The discrepancy of all elements is zero if the mean square over all elements
    is not more than two standard errors above one.
    """
    plain = fitted.linear.plain
    present = fitted.whitening.present
    count = np.maximum(present.sum(axis=0), 1)
    freedom = np.maximum(count - 3.0, 1.0)
    square = (plain**2).sum(axis=0) / freedom
    alive = present.any(axis=0)
    if not alive.any():
        return np.zeros(len(square))
    whole = float((square * count)[alive].sum() / count[alive].sum())
    scatter = 2 / freedom
    between = max(float(np.var(square[alive]) - scatter[alive].mean()), 0.0)
    shrunk = (square * between + whole * scatter) / (between + scatter)
    error = np.sqrt(2 / freedom[alive].sum())
    excess = np.maximum(shrunk - 1, 0.0) if whole > 1 + 2 * error else np.zeros(len(square))
    reads = np.median(read_once(fitted.model.known.means.counts))
    return np.asarray(np.where(alive, np.sqrt(excess) * fitted.noise.sd / np.sqrt(reads), 0.0))


def force_noise(fitted: Fitted) -> float:
    """Standard deviation of one reading of the load that a fit assumes, N/m or N."""
    means = fitted.model.known.means
    of_one = fitted.noise.load_sd * np.sqrt(means.reads_of_load)
    return float(np.median(of_one[np.isfinite(means.load)]))
