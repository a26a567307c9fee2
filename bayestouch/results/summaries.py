"""Summaries of many posteriors: five statistics of each parameter and touch."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from bayestouch.array_types import FloatArray

#: Statistics of a parameter in a summary, in this order.
STATISTICS = ("mean", "sd", "q5", "q50", "q95")
PROBABILITIES = (0.05, 0.5, 0.95)
# Number of draws that are sorted together: so few that reading them across the touches finds them in the cache (twice
# as fast as a few megabytes).
_SLICE = 1 << 15


def summarise(draws: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Five statistics of the draws of each parameter.

    Parameters
    ----------
    draws : mapping of (chain, draw, t) arrays
        Draws by parameter.

    Returns
    -------
    dict of (5, t) arrays
        The `STATISTICS` by parameter. Quantiles are interpolated between draws as in numpy; if a neighbouring draw is
        infinite (r_c of a flat tip), the quantile is one of the draws. The sd of such draws is NaN.
    """
    with ThreadPoolExecutor(max(1, len(draws))) as pool:
        return dict(zip(draws, pool.map(_summary, draws.values()), strict=True))


def _summary(draws: FloatArray) -> FloatArray:
    t = draws.shape[-1]
    flat = draws.reshape(-1, t)
    step = max(1, _SLICE // len(flat))
    return np.concatenate([_some(flat[:, first : first + step]) for first in range(0, t, step)], axis=1)


def _some(flat: FloatArray) -> FloatArray:
    """Statistics of draws (n, t), as (5, t)."""
    rows = np.sort(flat.T, axis=1)
    n = rows.shape[1]
    place = np.array(PROBABILITIES) * (n - 1)
    below = np.floor(place).astype(int)
    above = np.minimum(below + 1, n - 1)
    low, high = rows[:, below], rows[:, above]
    with np.errstate(invalid="ignore"):
        between = low + (place - below) * (high - low)
        mean = rows.mean(axis=1)
        sd = np.sqrt(np.square(rows - mean[:, None]).mean(axis=1))
    # As in `bayestouch.data.arrays.quantiles`: the smallest draw that at least this share of draws does not exceed.
    at = rows[:, np.maximum(np.ceil(np.array(PROBABILITIES) * n).astype(int) - 1, 0)]
    finite = np.isfinite(rows[:, [0, -1]]).all(axis=1, keepdims=True)
    return np.stack([mean, sd, *np.where(finite, between, at).T])
