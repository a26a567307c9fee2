"""Third round of sampling: ensemble moves, for blocks without a good proposal."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.sampling.density import BlockDensity, of_blocks
from bayestouch.sampling.draws import BlockDraws, empty_draws, grade
from bayestouch.sampling.proposals import BlockProposal
from bayestouch.sampling.run import Run
from bayestouch.sampling.streams import BlockStreams

# Purpose numbers of the random streams: round 3, and its starting points.
ROUND, STARTS = 3, 4
# Walkers of an ensemble, and steps, each times (number of parameters + 1). Half as many steps before are discarded.
WALKERS, STEPS = 4, 192
# Number of proposal points from which the starting points are chosen.
CANDIDATES = 4096
POINTS_HELD = 1 << 21


def ensemble_round(run: Run, proposal: BlockProposal, numbers: IndexArray) -> BlockDraws:
    """Return draws with stretch and differential-evolution moves, one independent ensemble for each chain.

    The draws of a chain are those of the walkers of its ensemble, one walker after the other.
    """
    d = proposal.dimension
    result = empty_draws(run.walkers, run.draws, proposal.n_blocks, d, ROUND)
    members = WALKERS * (d + 1)
    kept = -(-run.draws // members)
    thin = max(1, STEPS * (d + 1) // kept)
    held = max(1, POINTS_HELD // max(CANDIDATES, run.walkers * members * kept))
    for first in range(0, proposal.n_blocks, held):
        index = np.arange(first, min(first + held, proposal.n_blocks))
        part = slice(first, first + len(index))
        density = of_blocks(run.log_density, numbers[part])
        start = _starts(proposal.select(index), density, run, numbers[part], run.walkers * members)
        _ensembles(run, density, numbers[part], start, result, part, (members, kept, thin))
        grade(result, part, run.demands)
    return result


def _starts(proposal: BlockProposal, density: BlockDensity, run: Run, numbers: IndexArray, n: int) -> FloatArray:
    """Choose n different points per block (B, n, d) from the proposals, with probability by importance weight."""
    streams = BlockStreams(run.seed, numbers, purpose=STARTS)
    x, log_q = proposal.draw(streams, max(CANDIDATES, 2 * n))
    # The n largest sums of log weight and Gumbel random number are a weighted sample without replacement.
    keys = density(x) - log_q - np.log(streams.exponential(x.shape[1]))
    best = np.argpartition(keys, -n, axis=1)[:, -n:]
    return np.take_along_axis(x, best[..., None], axis=1)


def _ensembles(
    run: Run,
    density: BlockDensity,
    numbers: IndexArray,
    start: FloatArray,
    result: BlockDraws,
    part: slice,
    plan: tuple[int, int, int],
) -> None:
    """Run the ensembles of some blocks into `result`."""
    import emcee

    from bayestouch.sampling.moves import GroupDifferenceMove, GroupStretchMove

    members, kept, thin = plan
    n_blocks, n, d = start.shape
    streams = BlockStreams(run.seed, numbers, purpose=ROUND)
    moves = [(move(streams, density, run.walkers), 0.5) for move in (GroupStretchMove, GroupDifferenceMove)]
    sampler = emcee.EnsembleSampler(n_blocks * n, d, density, moves=moves, vectorize=True)
    # The random numbers of emcee only choose the move of each step, the same for all blocks.
    chooser = np.random.RandomState(np.random.MT19937(np.random.SeedSequence(run.seed, spawn_key=(ROUND,))))
    state = emcee.State(
        np.ascontiguousarray(start).reshape(-1, d),
        log_prob=density(start).reshape(-1),
        random_state=chooser.get_state(),
    )
    state = sampler.run_mcmc(state, kept * thin // 2, store=False, skip_initial_state_check=True)
    sampler.run_mcmc(state, kept, thin_by=thin, skip_initial_state_check=True)

    def by_chain(values: FloatArray) -> FloatArray:
        """(kept, blocks * chains * members, ...) -> (chain, draw, block, ...)."""
        parts = values.reshape(kept, n_blocks, run.walkers, members, *values.shape[2:])
        parts = parts.transpose(2, 3, 0, 1, *range(4, parts.ndim))
        return parts.reshape(run.walkers, members * kept, n_blocks, *values.shape[2:])[:, : run.draws]

    result.draws[:, :, part] = by_chain(sampler.get_chain())
    result.log_density[:, :, part] = by_chain(sampler.get_log_prob())
    result.acceptance[part] = sampler.acceptance_fraction.reshape(n_blocks, n).mean(axis=1)
