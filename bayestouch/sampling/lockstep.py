"""Sampling of thousands of independent posteriors at once with emcee."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import BoolArray, IndexArray
from bayestouch.sampling.adapt import adapt
from bayestouch.sampling.density import LogDensity, weighed
from bayestouch.sampling.draws import BlockDraws, Demands, empty_draws, keep_better, put
from bayestouch.sampling.ensembles import ensemble_round, given_round
from bayestouch.sampling.independence import independence_round
from bayestouch.sampling.pareto import pareto_smooth, shape_that_counts
from bayestouch.sampling.proposals import BlockProposal
from bayestouch.sampling.run import Run
from bayestouch.sampling.streams import BlockStreams

# With more parameters than this, a thousand draws do not suffice to fit a mixture, and ensembles mix too slowly.
LARGEST_RESHAPED = 8
# Steps per kept draw of a block that is sampled again, and of one that does not meet the targets with a fitted mixture.
# Most of these have a good mixture, but too few points for the tail of its weights: many more points take less time
# than ensembles.
THIN_AGAIN, THIN_LONGER = 4, (32, 128)
# A proposal is good if the effective size of its points is at least this fraction of their number; points tried.
GOOD_PROPOSAL, POINTS = 0.5, 1024
# Purpose number of the random streams, see `BlockStreams`.
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
    moves: Any = None,
    progress: Callable[[float], None] | None = None,
) -> BlockDraws:
    """Return draws from many posteriors at once with emcee.

    One `emcee.EnsembleSampler` moves the walkers of many blocks. In the first round each walker is an independence
    Metropolis chain with the proposal of its block. Blocks that miss the targets are sampled again with four steps per
    kept draw. If the proposal of a block is good and its chains were only too short, they use the same proposal, and
    the block is not sampled a third time. The others use a mixture fitted to the posterior. Those that still miss the
    targets are sampled with 32 and then 128 steps from this mixture, and at last with stretch and
    differential-evolution moves, each block in ensembles of its own. The better round is kept.
    With more than eight parameters the second round uses the first proposal again and there is no third round.

    Parameters
    ----------
    log_density : callable
        ``(x, blocks) -> (B', n)``: log density up to a constant per block, of points x (B', n, d) for the blocks
        numbered `blocks` (B',); ``-inf`` outside the support, never NaN.
    proposal : BlockProposal
        Proposals of the B blocks.
    walkers, draws : int
        Independent chains per block, and draws kept of each. A few long chains get better grades than many short ones.
    seed : int
        The draws of a block depend only on the seed and the number of the block.
    blocks : (B,) int array_like, optional
        Numbers of the blocks, 0 ... B - 1 by default.
    demands : Demands, optional
        Targets for a good block.
    first_round : int
        1 or 2; use 2 for blocks that were poor with `proposal` in another run.
    rounds : int
        Maximum number of rounds for a poor block, 1 to 3.
    moves : emcee.moves.Move or list, optional
        Moves of emcee, as `emcee.EnsembleSampler` takes them, in place of the three rounds. These moves mix all walkers
        of a sampler; therefore each chain of each block is then an ensemble of its own, of ``4 (d + 1)`` walkers that
        start at points of the proposal. `progress` is not called.
    progress : callable, optional
        Called with the fraction of the first round that is done, 0 to 1.

    Raises
    ------
    ValueError
        The log density is NaN at some point, or the numbers of blocks differ.
    """
    numbers = np.arange(proposal.n_blocks) if blocks is None else np.asarray(blocks, dtype=np.intp)
    if numbers.shape != (proposal.n_blocks,):
        raise ValueError(f"expected one number for each of {proposal.n_blocks} blocks, got {numbers.shape}")
    if walkers < 2 or draws < 4:
        raise ValueError(f"expected at least 2 walkers and 4 draws, got {walkers} and {draws}")
    run = Run(log_density, walkers, draws, seed, demands or Demands(), moves)
    if moves is not None:
        return given_round(run, proposal, numbers)
    if first_round > 1:
        return _further_rounds(run, proposal, numbers, rounds)
    result = independence_round(run, proposal, numbers, round_=1, thin=1, progress=progress)
    poor = np.flatnonzero(~result.grade)
    if rounds >= 2 and len(poor):
        keep_better(result, _further_rounds(run, proposal.select(poor), numbers[poor], rounds), poor)
    return result


def _further_rounds(run: Run, proposal: BlockProposal, numbers: IndexArray, rounds: int) -> BlockDraws:
    """Draws of the second round, and of the third for blocks that are still poor."""
    small = proposal.dimension <= LARGEST_RESHAPED
    result = empty_draws(run.walkers, run.draws, proposal.n_blocks, proposal.dimension, 2)
    served = _with_good_proposal(run, proposal, numbers) if small else np.ones(proposal.n_blocks, dtype=bool)
    lucky, rest = np.flatnonzero(served), np.flatnonzero(~served)
    if len(lucky):
        longer = independence_round(run, proposal.select(lucky), numbers[lucky], round_=2, thin=THIN_AGAIN)
        put(result, longer, lucky)
    if len(rest):
        mixture = adapt(run.log_density, proposal.select(rest), numbers[rest], run.seed)
        put(result, independence_round(run, mixture, numbers[rest], round_=2, thin=THIN_AGAIN), rest)
        still = np.flatnonzero(~result.grade[rest])
        for thin in THIN_LONGER:
            if len(still):
                longer = independence_round(run, mixture.select(still), numbers[rest[still]], round_=2, thin=thin)
                keep_better(result, longer, rest[still])
                still = still[~result.grade[rest[still]]]
        if rounds >= 3 and len(still):
            keep_better(result, ensemble_round(run, mixture.select(still), numbers[rest[still]]), rest[still])
    return result


def _with_good_proposal(run: Run, proposal: BlockProposal, numbers: IndexArray) -> BoolArray:
    """True for blocks with a good proposal, whose chains were only too short, (B,)."""
    served = np.empty(proposal.n_blocks, dtype=bool)
    streams = BlockStreams(run.seed, numbers, purpose=PURPOSE)
    for part, _, log_p, log_q in weighed(run.log_density, proposal, numbers, streams, POINTS):
        log_weights = log_p - log_q
        weights, shape = pareto_smooth(log_weights)
        shape = shape_that_counts(log_weights, shape)
        enough = (weights * weights).sum(axis=1) * POINTS * GOOD_PROPOSAL <= 1
        served[part] = enough & (shape <= run.demands.pareto_k) & (weights.sum(axis=1) > 0)
    return served
