"""Thousands of independent posteriors drawn by emcee side by side."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import BoolArray, IndexArray
from bayestouch.sampling.adapt import adapt
from bayestouch.sampling.density import LogDensity, weighed
from bayestouch.sampling.draws import BlockDraws, Demands, empty_draws, keep_better, put
from bayestouch.sampling.ensembles import ensemble_round
from bayestouch.sampling.independence import independence_round
from bayestouch.sampling.pareto import pareto_smooth
from bayestouch.sampling.proposals import BlockProposal
from bayestouch.sampling.run import Run
from bayestouch.sampling.streams import BlockStreams

# Beyond this many parameters a mixture cannot be fitted to a thousand draws, and ensembles mix too slowly.
LARGEST_RESHAPED = 8
# Steps for each draw kept of a block that is drawn again.
THIN_AGAIN = 4
# A proposal serves if its points are worth this share of their number as independent draws; so many are tried.
SERVED, POINTS = 0.5, 1024
# Purpose of the random streams.
PURPOSE = 7


def sample_blocks(
    log_density: LogDensity,
    proposal: BlockProposal,
    *,
    walkers: int = 4,
    draws: int = 256,
    seed: int,
    blocks: ArrayLike | None = None,
    demands: Demands | None = None,
    first_round: int = 1,
    rounds: int = 3,
    progress: Callable[[float], None] | None = None,
) -> BlockDraws:
    """Draw from many posteriors at once with emcee.

    One `emcee.EnsembleSampler` holds the walkers of many blocks, with a move that proposes each walker by itself
    from its block's proposal: every walker is an independence Metropolis chain. Blocks that miss the demands are
    drawn again, four steps for each draw kept, from a mixture fitted to the posterior (or from the same proposal, where
    that is good and the chains were only too short); those that still miss are drawn with stretch and
    differential-evolution moves, in ensembles of their own. The better round is kept. Above eight parameters the second
    round has the first proposal again and there is no third.

    Parameters
    ----------
    log_density : callable
        ``(x, blocks) -> (B', n)``: log density up to a constant a block, of points x (B', n, d) for the blocks
        numbered `blocks` (B',); ``-inf`` outside the support, never NaN.
    proposal : BlockProposal
        Of the B blocks.
    walkers, draws : int
        Independent chains a block, and draws kept of each. Few long chains are graded better than many short ones.
    seed : int
        A block's draws depend on the seed and its number alone.
    blocks : (B,) int array_like, optional
        Numbers of the blocks, 0 ... B - 1 by default.
    demands : Demands, optional
        When a block is good.
    first_round : int
        1 or 2; 2 is for blocks that another run found poor with `proposal`.
    rounds : int
        1 to 3: how far to go for a poor block.
    progress : callable, optional
        Called with the share of the first round's work that is done, 0 to 1.

    Raises
    ------
    ValueError
        The log density is NaN somewhere, or the numbers do not fit.
    """
    numbers = np.arange(proposal.n_blocks) if blocks is None else np.asarray(blocks, dtype=np.intp)
    if numbers.shape != (proposal.n_blocks,):
        raise ValueError(f"expected one number for each of {proposal.n_blocks} blocks, got {numbers.shape}")
    if walkers < 2 or draws < 4:
        raise ValueError(f"expected at least 2 walkers and 4 draws, got {walkers} and {draws}")
    run = Run(log_density, walkers, draws, seed, demands or Demands())
    if first_round > 1:
        return _again(run, proposal, numbers, rounds)
    result = independence_round(run, proposal, numbers, round_=1, thin=1, progress=progress)
    poor = np.flatnonzero(~result.grade)
    if rounds >= 2 and len(poor):
        keep_better(result, _again(run, proposal.select(poor), numbers[poor], rounds), poor)
    return result


def _again(run: Run, proposal: BlockProposal, numbers: IndexArray, rounds: int) -> BlockDraws:
    """Second round, and third for blocks that are still poor."""
    small = proposal.dimension <= LARGEST_RESHAPED
    result = empty_draws(run.walkers, run.draws, proposal.n_blocks, proposal.dimension, 2)
    served = _served(run, proposal, numbers) if small else np.ones(proposal.n_blocks, dtype=bool)
    lucky, rest = np.flatnonzero(served), np.flatnonzero(~served)
    if len(lucky):
        longer = independence_round(run, proposal.select(lucky), numbers[lucky], round_=2, thin=THIN_AGAIN)
        put(result, longer, lucky)
    if len(rest):
        mixture = adapt(run.log_density, proposal.select(rest), numbers[rest], run.seed)
        put(result, independence_round(run, mixture, numbers[rest], round_=2, thin=THIN_AGAIN), rest)
        still = np.flatnonzero(~result.grade[rest])
        if rounds >= 3 and len(still):
            keep_better(result, ensemble_round(run, mixture.select(still), numbers[rest[still]]), rest[still])
    return result


def _served(run: Run, proposal: BlockProposal, numbers: IndexArray) -> BoolArray:
    """Blocks whose proposal is good, so that what their chains lacked was length or luck, (B,)."""
    served = np.empty(proposal.n_blocks, dtype=bool)
    streams = BlockStreams(run.seed, numbers, purpose=PURPOSE)
    for part, _, log_p, log_q in weighed(run.log_density, proposal, numbers, streams, POINTS):
        weights, shape = pareto_smooth(log_p - log_q)
        enough = (weights * weights).sum(axis=1) * POINTS * SERVED <= 1
        served[part] = enough & (shape <= run.demands.pareto_k) & (weights.sum(axis=1) > 0)
    return served
