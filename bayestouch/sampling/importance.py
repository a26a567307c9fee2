"""Posteriors of many blocks by Pareto-smoothed importance sampling."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.sampling.density import LogDensity, of_blocks
from bayestouch.sampling.pareto import pareto_smooth, systematic_resample
from bayestouch.sampling.proposals import BlockProposal
from bayestouch.sampling.streams import BlockStreams

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]

POINTS_HELD = 1 << 18
# Purpose of the random streams: apart from those of the rounds of `sample_blocks`.
PURPOSE = 5


@dataclass(frozen=True, eq=False)
class ImportanceDraws:
    """Equally weighted draws from B posteriors of dimension d, and how good they are.

    Attributes
    ----------
    draws : (W, n, B, d) array
        Chain, draw, block, parameter, resampled with the smoothed weights. A point of large weight comes several times
        running, so that ArviZ sees its weight as autocorrelation. NaN where no proposal had finite density.
    log_density : (W, n, B) array
        Log density at each.
    mean, sd : (B, d) arrays
        Weighted mean and standard deviation of all proposals: less noisy than those of the draws.
    ess : (B,) array
        ``1 / sum(weights²)``.
    pareto_k : (B,) array
        Pareto shape of the weights.
    grade : (B,) bool array
        Whether `ess` and `pareto_k` are good enough; where not, `sample_blocks` serves.
    """

    draws: FloatArray
    log_density: FloatArray
    mean: FloatArray
    sd: FloatArray
    ess: FloatArray
    pareto_k: FloatArray
    grade: BoolArray


def importance_blocks(
    log_density: LogDensity,
    proposal: BlockProposal,
    *,
    proposals: int = 1024,
    walkers: int = 4,
    draws: int = 256,
    seed: int,
    blocks: ArrayLike | None = None,
    least_ess: float = 400.0,
    largest_k: float = 0.7,
    progress: Callable[[float], None] | None = None,
) -> ImportanceDraws:
    """Draw from many posteriors by weighting proposals with Pareto-smoothed importance weights.

    Parameters
    ----------
    log_density, proposal, seed, blocks, progress
        As `sample_blocks`.
    proposals : int
        Points a block at which the density is evaluated.
    walkers, draws : int
        Shape of the draws; ``walkers * draws`` of them are resampled from the proposals.
    least_ess, largest_k : float
        When a block is good.
    """
    numbers = np.arange(proposal.n_blocks) if blocks is None else np.asarray(blocks, dtype=np.intp)
    n_blocks, d, n = proposal.n_blocks, proposal.dimension, walkers * draws
    if numbers.shape != (n_blocks,):
        raise ValueError(f"expected one number for each of {n_blocks} blocks, got {numbers.shape}")
    result = ImportanceDraws(
        draws=np.empty((walkers, draws, n_blocks, d)),
        log_density=np.empty((walkers, draws, n_blocks)),
        mean=np.empty((n_blocks, d)),
        sd=np.empty((n_blocks, d)),
        ess=np.empty(n_blocks),
        pareto_k=np.empty(n_blocks),
        grade=np.empty(n_blocks, dtype=bool),
    )
    held = max(1, POINTS_HELD // proposals)
    for first in range(0, n_blocks, held):
        index = np.arange(first, min(first + held, n_blocks))
        part = slice(first, first + len(index))
        streams = BlockStreams(seed, numbers[part], purpose=PURPOSE)
        x, log_q = proposal.select(index).draw(streams, proposals)
        log_p = of_blocks(log_density, numbers[part])(x)
        weights, result.pareto_k[part] = pareto_smooth(log_p - log_q)
        found: BoolArray = weights.sum(axis=1) > 0
        result.mean[part] = np.where(found[:, None], np.einsum("bn,bnd->bd", weights, x), np.nan)
        deviation = x - result.mean[part][:, None]
        result.sd[part] = np.sqrt(np.einsum("bn,bnd,bnd->bd", weights, deviation, deviation))
        result.ess[part] = np.where(found, 1 / np.maximum((weights * weights).sum(axis=1), 1e-300), 0.0)
        chosen = systematic_resample(weights, n, streams.uniform(1))
        for j in range(d):
            drawn = np.where(found[:, None], np.take_along_axis(x[..., j], chosen, axis=1), np.nan)
            result.draws[:, :, part, j] = np.moveaxis(drawn.reshape(-1, walkers, draws), 0, 2)
        drawn = np.take_along_axis(log_p, chosen, axis=1)
        result.log_density[:, :, part] = np.moveaxis(drawn.reshape(-1, walkers, draws), 0, 2)
        if progress is not None:
            progress((index[-1] + 1) / n_blocks)
    np.logical_and(result.ess >= least_ess, result.pareto_k <= largest_k, out=result.grade)
    return result
