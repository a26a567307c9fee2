"""Pareto-smoothed importance sampling of many posteriors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import BoolArray, FloatArray, IndexArray
from bayestouch.sampling.density import LogDensity, weighed
from bayestouch.sampling.pareto import pareto_smooth, shape_that_counts, systematic_resample
from bayestouch.sampling.proposals import BlockProposal
from bayestouch.sampling.streams import BlockStreams

# Purpose number of the random streams, different from those of `sample_blocks`.
PURPOSE = 5


@dataclass(frozen=True, eq=False)
class ImportanceDraws:
    """Equally weighted draws from B posteriors of dimension d, and their quality.

    Attributes
    ----------
    draws : (W, n, B, d) array
        Chain, draw, block, parameter, resampled with the smoothed weights. A point of large weight is repeated
        consecutively, so that ArviZ sees its weight as autocorrelation. NaN if no proposal had a finite density.
    log_density : (W, n, B) array
        Log density at each draw.
    ess : (B,) array
        ``1 / sum(weights²)``.
    pareto_k : (B,) array
        Pareto shape of the weights.
    grade : (B,) bool array
        Whether `ess` and `pareto_k` are good enough; if not, use `sample_blocks`.
    """

    draws: FloatArray
    log_density: FloatArray
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
    """Return draws from many posteriors by Pareto-smoothed importance sampling.

    Parameters
    ----------
    log_density, proposal, seed, blocks, progress
        As `sample_blocks`.
    proposals : int
        Number of points per block at which the density is evaluated.
    walkers, draws : int
        Shape of the draws; ``walkers * draws`` of them are resampled from the proposals.
    least_ess, largest_k : float
        Limits of `ess` and `pareto_k` for a good block.
    """
    numbers = np.arange(proposal.n_blocks) if blocks is None else np.asarray(blocks, dtype=np.intp)
    n_blocks, d, n = proposal.n_blocks, proposal.dimension, walkers * draws
    if numbers.shape != (n_blocks,):
        raise ValueError(f"expected one number for each of {n_blocks} blocks, got {numbers.shape}")
    result = ImportanceDraws(
        # The draws of one parameter are contiguous in memory, as files and diagnostics need them.
        draws=np.moveaxis(np.empty((d, walkers, draws, n_blocks)), 0, -1),
        log_density=np.empty((walkers, draws, n_blocks)),
        ess=np.empty(n_blocks),
        pareto_k=np.empty(n_blocks),
        grade=np.empty(n_blocks, dtype=bool),
    )
    streams = BlockStreams(seed, numbers, purpose=PURPOSE)
    for part, x, log_p, log_q in weighed(log_density, proposal, numbers, streams, proposals):
        log_q -= log_p
        weights, shape = pareto_smooth(np.negative(log_q, out=log_q))
        result.pareto_k[part] = shape_that_counts(log_q, shape)
        found: BoolArray = weights.sum(axis=1) > 0
        nan = np.where(found, 0.0, np.nan)
        result.ess[part] = np.where(found, 1 / np.maximum(np.einsum("bn,bn->b", weights, weights), 1e-300), 0.0)
        chosen = systematic_resample(weights, n, streams.select(part).uniform(1))
        chosen += proposals * np.arange(len(chosen))[:, None]

        def by_chain(values: FloatArray, chosen: IndexArray = chosen) -> FloatArray:
            return np.moveaxis(values.take(chosen).reshape(-1, walkers, draws), 0, 2)

        for j in range(d):
            result.draws[:, :, part, j] = by_chain(x[..., j])
        result.log_density[:, :, part] = by_chain(log_p)
        if not found.all():
            result.draws[:, :, part] += nan[:, None]
        if progress is not None:
            progress(part.stop / n_blocks)
    np.logical_and(result.ess >= least_ess, result.pareto_k <= largest_k, out=result.grade)
    return result
