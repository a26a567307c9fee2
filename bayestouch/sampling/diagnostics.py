"""Rank-normalised split R-hat and bulk effective sample size of thousands of parameters at once.

Vehtari, Gelman, Simpson, Carpenter and Bürkner (2021), doi:10.1214/20-BA1221, with the choices of ArviZ, to which the
numbers agree; ArviZ takes one parameter at a time, which for the touches of one run takes longer than drawing them.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri

FloatArray = NDArray[np.float64]

_SLICE = 1 << 18  # values looked at together: a few megabytes, so that they stay in cache


def ess_bulk(draws: ArrayLike) -> FloatArray:
    """Bulk effective sample size.

    Parameters
    ----------
    draws : (chain, draw, ...) array_like
        Draws; every further axis is another parameter.

    Returns
    -------
    (...) array
        NaN for a parameter that never moves or is not finite (ArviZ says such draws are all effective), and for
        fewer than 4 draws.
    """
    return bulk_statistics(draws)[0]


def rhat(draws: ArrayLike) -> FloatArray:
    """Rank-normalised split R-hat, the larger of bulk and tail; arguments as `ess_bulk`."""
    return bulk_statistics(draws)[1]


def bulk_statistics(draws: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Bulk effective sample size and R-hat together, which share most of the work; as `ess_bulk` and `rhat`."""
    values = np.asarray(draws, dtype=float)
    chains, n, *shape = values.shape
    half = n // 2
    series = values.reshape(chains, n, -1)
    count = series.shape[-1]
    ess, scale_reduction = np.full(count, np.nan), np.full(count, np.nan)
    if n >= 4:
        step = max(1, _SLICE // (chains * n))
        for first in range(0, count, step):
            part = slice(first, first + step)
            chunk = np.moveaxis(series[:, :, part], -1, 0)
            split = np.concatenate([chunk[:, :, :half], chunk[:, :, n - half :]], axis=1)
            ess[part], scale_reduction[part] = _statistics(split)
    return ess.reshape(shape), scale_reduction.reshape(shape)


def _statistics(split: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Statistics of split chains, (series, chain, draw) -> two (series,) arrays."""
    flat = split.reshape(len(split), -1)
    low, high = flat.min(axis=1), flat.max(axis=1)
    usable = np.isfinite(low) & np.isfinite(high) & (low < high)
    ess, scale_reduction = np.full(len(split), np.nan), np.full(len(split), np.nan)
    if usable.any():
        flat, shape = flat[usable], split[usable].shape
        bulk, median = _normal_scores(flat)
        folded = _normal_scores(np.abs(flat - median[:, None]))[0]
        ess[usable] = _ess(bulk.reshape(shape))
        scale_reduction[usable] = np.maximum(_rhat(bulk.reshape(shape)), _rhat(folded.reshape(shape)))
    return ess, scale_reduction


@lru_cache(maxsize=8)
def _score_of_rank(n: int) -> FloatArray:
    """Normal score (Blom) of the average rank 1 + k/2 among n values, for k = 0 ... 2n - 2."""
    return np.asarray(ndtri((1 + np.arange(2 * n - 1) / 2 - 3 / 8) / (n + 1 / 4)))


def _normal_scores(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Replace each value by the normal score of its rank in its row (ties share one); also the row's median."""
    n = values.shape[1]
    order = np.argsort(values, axis=1)
    order += n * np.arange(len(values))[:, None]
    ordered = values.reshape(-1)[order]
    median = (ordered[:, (n - 1) // 2] + ordered[:, n // 2]) / 2
    # A rejected proposal repeats its walker's value, so ties are the rule: runs of equal values share an average rank.
    begins = np.ones(values.shape, dtype=bool)
    np.not_equal(ordered[:, 1:], ordered[:, :-1], out=begins[:, 1:])
    first = np.flatnonzero(begins)
    length = np.diff(first, append=values.size)
    scores = np.empty(values.size)
    scores[order.reshape(-1)] = np.repeat(_score_of_rank(n)[2 * (first % n) + length - 1], length)
    return scores.reshape(values.shape), median


def _rhat(scores: FloatArray) -> FloatArray:
    n = scores.shape[2]
    between = n * scores.mean(axis=2).var(axis=1, ddof=1)
    within = scores.var(axis=2, ddof=1).mean(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):  # chains that each stand still
        return np.asarray(np.sqrt((between / within + n - 1) / n))


def _ess(scores: FloatArray) -> FloatArray:
    """Effective sample size with Geyer's initial monotone sequence, (series, chain, draw) -> (series,)."""
    count, chains, n = scores.shape
    means = scores.mean(axis=2)
    centred = scores - means[:, :, None]
    variance = np.einsum("sct,sct->s", centred, centred) / (chains * (n - 1))
    total = variance * (n - 1) / n + means.var(axis=1, ddof=1)

    active = np.arange(count)  # series whose sum of correlations still goes on

    def correlation(lag: int) -> FloatArray:
        product = np.einsum("sct,sct->s", centred[:, :, lag:], centred[:, :, : n - lag]) / (chains * n)
        return np.asarray(1 - (variance[active] - product) / total[active])

    even, odd = np.ones(count), correlation(1)
    floor, paired = np.full(count, np.inf), np.zeros(count)
    lag = 1
    # Pairs of correlations (even lag, odd lag) are summed while positive, each at most its predecessor. Lag by lag
    # instead of a Fourier transform: nearly all series of an independence chain end within ten lags.
    while lag < n - 3:
        going = even[active] + odd[active] > 0
        if not going.all():
            active, centred = active[going], centred[going]
        if not len(active):
            break
        floor[active] = np.minimum(floor[active], even[active] + odd[active])
        paired[active] += floor[active]
        even[active], odd[active] = correlation(lag + 1), correlation(lag + 2)
        lag += 2
    last = np.where((even > 0) | (even + odd >= 0), even, 0.0)
    size = chains * n
    time = np.maximum(2 * paired + last - 1, 1 / np.log10(size))
    return np.asarray(size / time)
