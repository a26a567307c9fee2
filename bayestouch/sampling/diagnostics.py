"""Rank-normalised split R-hat and bulk effective sample size of thousands of parameters at once.

Vehtari, Gelman, Simpson, Carpenter and Bürkner (2021), doi:10.1214/20-BA1221, with the conventions of ArviZ. The
numbers agree with ArviZ, which computes one parameter at a time; for the touches of one run that takes longer than
sampling them.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from bayestouch.array_types import FloatArray, IntArray

_SLICE = 1 << 16  # number of values processed together: half a megabyte, which fits the cache


def ess_bulk(draws: ArrayLike) -> FloatArray:
    """Return the bulk effective sample size of each parameter.

    Parameters
    ----------
    draws : (chain, draw, ...) array_like
        Draws; the further axes are parameters.

    Returns
    -------
    (...) array
        NaN for a parameter that is constant or not finite (ArviZ returns the number of draws then), and for fewer
        than 4 draws.
    """
    return bulk_statistics(draws)[0]


def rhat(draws: ArrayLike) -> FloatArray:
    """Return the rank-normalised split R-hat, the larger of bulk and tail; arguments as in `ess_bulk`."""
    return bulk_statistics(draws)[1]


def bulk_statistics(draws: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return bulk effective sample size and R-hat, which share most of the computation; see `ess_bulk` and `rhat`."""
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
    """Effective sample size and R-hat of split chains, (series, chain, draw) -> two (series,) arrays."""
    flat = split.reshape(len(split), -1)
    low, high = flat.min(axis=1), flat.max(axis=1)
    usable = np.isfinite(low) & np.isfinite(high) & (low < high)
    ess, scale_reduction = np.full(len(split), np.nan), np.full(len(split), np.nan)
    if usable.any():
        flat, shape = flat[usable], split[usable].shape
        bulk, median = _normal_scores(flat, _order(flat))
        folded = np.abs(flat - median[:, None])
        # The two values next to a median have the same distance from it; rounding decides whether they are a tie.
        folded, _ = _normal_scores(folded, np.argsort(folded, axis=1))
        bulk, folded = bulk.reshape(shape), folded.reshape(shape)
        means, squares = _moments(bulk)
        ess[usable] = _ess(bulk, means, squares)
        scale_reduction[usable] = np.maximum(_rhat(means, squares, shape), _rhat(*_moments(folded), shape))
    return ess, scale_reduction


def _order(values: FloatArray) -> IntArray:
    """Indices that sort each row, three times as fast as `argsort`.

    The numbers become integers of the same order with the index of each in the last bits, so that sorting them gives
    the indices. Numbers that differ by less than 1e-12 of their distance from the row's first may be exchanged.
    """
    last = (1 << (values.shape[1] - 1).bit_length()) - 1
    keys = (values - values[:, :1]).view(np.int64)
    keys ^= (keys >> 63) & np.iinfo(np.int64).max
    keys &= ~last
    keys |= np.arange(values.shape[1])
    keys.sort(axis=1)
    keys &= last
    return keys


@lru_cache(maxsize=8)
def _score_of_rank(n: int) -> FloatArray:
    """Normal score (Blom) of the average rank 1 + k/2 among n values, for k = 0 ... 2n - 2."""
    return np.asarray(ndtri((1 + np.arange(2 * n - 1) / 2 - 3 / 8) / (n + 1 / 4)))


def _normal_scores(values: FloatArray, order: IntArray) -> tuple[FloatArray, FloatArray]:
    """Normal score of the rank of each value in its row (the same for ties), and the median of the row."""
    n = values.shape[1]
    order = order + n * np.arange(len(values))[:, None]
    ordered = values.take(order)
    median = (ordered[:, (n - 1) // 2] + ordered[:, n // 2]) / 2
    # A rejected proposal repeats the value of its walker. Ties are therefore frequent and get their average rank.
    begins = np.ones(values.shape, dtype=bool)
    np.not_equal(ordered[:, 1:], ordered[:, :-1], out=begins[:, 1:])
    first = np.flatnonzero(begins)
    length = np.diff(first, append=values.size)
    scores = np.empty(values.size)
    scores[order.reshape(-1)] = np.repeat(_score_of_rank(n).take(2 * (first % n) + length - 1), length)
    return scores.reshape(values.shape), median


def _moments(scores: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of each chain (series, chain), and sum of squares about the means (series,)."""
    means = scores.mean(axis=2)
    squares = np.einsum("sct,sct->s", scores, scores) - scores.shape[2] * (means * means).sum(axis=1)
    return means, np.maximum(squares, 0.0)


def _rhat(means: FloatArray, squares: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    _, chains, n = shape
    between, within = n * means.var(axis=1, ddof=1), squares / (chains * (n - 1))
    with np.errstate(divide="ignore", invalid="ignore"):  # chains that are all constant
        return np.asarray(np.sqrt((between / within + n - 1) / n))


def _ess(scores: FloatArray, means: FloatArray, squares: FloatArray) -> FloatArray:
    """Effective sample size with Geyer's initial monotone sequence, (series, chain, draw) -> (series,)."""
    count, chains, n = scores.shape
    centred = scores - means[:, :, None]
    variance = squares / (chains * (n - 1))
    total = variance * (n - 1) / n + means.var(axis=1, ddof=1)

    active = np.arange(count)  # series whose sum of correlations is not complete

    def correlation(lag: int) -> FloatArray:
        product = np.einsum("sct,sct->s", centred[:, :, lag:], centred[:, :, : n - lag]) / (chains * n)
        return np.asarray(1 - (variance[active] - product) / total[active])

    even, odd = np.ones(count), correlation(1)
    floor, paired = np.full(count, np.inf), np.zeros(count)
    lag = 1
    # Pairs of correlations (even lag, odd lag) are summed while positive, each limited to its predecessor. The lags are
    # computed one by one, without a Fourier transform: most series of an independence chain end within ten lags.
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
