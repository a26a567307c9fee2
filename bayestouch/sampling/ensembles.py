"""Many walkers a chain: the third round of sampling, for blocks without a good proposal, given moves, and renewal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.sampling.density import BlockDensity, by_walker, of_blocks
from bayestouch.sampling.draws import BlockDraws, empty_draws, grade
from bayestouch.sampling.proposals import BlockProposal, RenewableProposal
from bayestouch.sampling.run import Run
from bayestouch.sampling.streams import BlockStreams

# Purpose numbers of the random streams: round 3, starting points, moves that are given, and renewal.
ROUND, STARTS, GIVEN, RENEWAL = 3, 4, 8, 13
# Number of the round of moves that are given, and of the round of renewal.
GIVEN_ROUND, RENEWAL_ROUND = 4, 5
# Walkers of an ensemble, and steps, each times (number of parameters + 1). Half as many steps before are discarded.
WALKERS, STEPS = 4, 192
# Walkers of a chain of renewal: together they are evaluated at hardly more than the cost of a few.
RENEWED = 16
# Number of proposal points from which the starting points are chosen.
CANDIDATES = 4096
POINTS_HELD = 1 << 21


@dataclass(frozen=True)
class _Plan:
    """Size of the ensembles: walkers of each, steps kept, and every which step is kept."""

    members: int
    kept: int
    thin: int

    @classmethod
    def of(cls, run: Run, d: int) -> _Plan:
        members = WALKERS * (d + 1)
        kept = -(-run.draws // members)
        return cls(members, kept, max(1, STEPS * (d + 1) // kept))


def ensemble_round(run: Run, proposal: BlockProposal, numbers: IndexArray) -> BlockDraws:
    """Return draws with stretch and differential-evolution moves, one independent ensemble for each chain.

    The draws of a chain are those of the walkers of its ensemble, one walker after the other.
    """
    from bayestouch.sampling.moves import GroupDifferenceMove, GroupStretchMove

    d = proposal.dimension
    result = empty_draws(run.walkers, run.draws, proposal.n_blocks, d, ROUND)
    plan = _Plan.of(run, d)
    held = max(1, POINTS_HELD // max(CANDIDATES, run.walkers * plan.members * plan.kept))
    for first in range(0, proposal.n_blocks, held):
        index = np.arange(first, min(first + held, proposal.n_blocks))
        part = slice(first, first + len(index))
        density = of_blocks(run.log_density, numbers[part])
        start = _starts(proposal.select(index), density, run, numbers[part], run.walkers * plan.members)
        streams = BlockStreams(run.seed, numbers[part], purpose=ROUND)
        moves = [(move(streams, run.walkers), 0.5) for move in (GroupStretchMove, GroupDifferenceMove)]
        # The random numbers of emcee only choose the move of each step, the same for all blocks.
        _run(run, density, start, moves, (ROUND,), plan, result, part, slice(None))
        grade(result, part, run.demands)
    return result


def given_round(run: Run, proposal: BlockProposal, numbers: IndexArray) -> BlockDraws:
    """Return draws with the moves of the run; every chain of every block is a sampler of its own.

    The moves of emcee do not know of blocks: they mix all walkers of a sampler.
    """
    d = proposal.dimension
    result = empty_draws(run.walkers, run.draws, proposal.n_blocks, d, GIVEN_ROUND)
    plan = _Plan.of(run, d)
    for block, number in enumerate(numbers):
        part = slice(block, block + 1)
        density = of_blocks(run.log_density, numbers[part])
        start = _starts(proposal.select([block]), density, run, numbers[part], run.walkers * plan.members)
        for chain in range(run.walkers):
            own = slice(chain, chain + 1)
            walkers = start[:, chain * plan.members : (chain + 1) * plan.members]
            _run(run, density, walkers, run.moves, (GIVEN, int(number), chain), plan, result, part, own)
        grade(result, part, run.demands)
    return result


def renewal_round(run: Run, proposal: RenewableProposal, numbers: IndexArray, *, thin: int) -> BlockDraws:
    """Return draws with moves that renew a part of the coordinates; every `thin`-th step is kept.

    In many dimensions a proposal that is near the target in every coordinate still has log ratios to it that scatter by
    more than one: a few points have much larger ratios than all others, and an independence chain stays at such a point
    for hundreds of steps. A part of the coordinates has a part of this scatter. The walkers of a chain do not interact.
    """
    from bayestouch.sampling.moves import RenewalMove

    result = empty_draws(run.walkers, run.draws, proposal.n_blocks, proposal.dimension, RENEWAL_ROUND)
    plan = _Plan(RENEWED, -(-run.draws // RENEWED), thin)
    for block, number in enumerate(numbers):
        part = slice(block, block + 1)
        density, own = of_blocks(run.log_density, numbers[part]), proposal.select([block])
        start = _starts(own, density, run, numbers[part], run.walkers * plan.members, CANDIDATES // 4)
        move = RenewalMove(own, BlockStreams(run.seed, numbers[part], purpose=RENEWAL))
        _run(run, density, start, move, (RENEWAL, int(number)), plan, result, part, slice(None))
        grade(result, part, run.demands)
    return result


def _starts(
    proposal: BlockProposal,
    density: BlockDensity,
    run: Run,
    numbers: IndexArray,
    n: int,
    candidates: int = CANDIDATES,
) -> FloatArray:
    """Choose n different points per block (B, n, d) from the proposals, with probability by importance weight."""
    streams = BlockStreams(run.seed, numbers, purpose=STARTS)
    x, log_q = proposal.draw(streams, max(candidates, 2 * n))
    # The n largest sums of log weight and Gumbel random number are a weighted sample without replacement.
    keys = density(x) - log_q - np.log(streams.exponential(x.shape[1]))
    best = np.argpartition(keys, -n, axis=1)[:, -n:]
    return np.take_along_axis(x, best[..., None], axis=1)


def _run(
    run: Run,
    density: BlockDensity,
    start: FloatArray,
    moves: Any,
    spawn_key: tuple[int, ...],
    plan: _Plan,
    result: BlockDraws,
    part: slice,
    chains: slice,
) -> None:
    """Run the ensembles of some chains of some blocks, from points (B, n, d), into `result`."""
    import emcee

    from bayestouch.sampling.sampler import ArraySampler

    n_blocks, n, d = start.shape
    kept, members = plan.kept, plan.members
    sampler = ArraySampler(n_blocks * n, d, by_walker(density, n_blocks), moves=moves, vectorize=True)
    random = np.random.RandomState(np.random.MT19937(np.random.SeedSequence(run.seed, spawn_key=spawn_key)))
    state = emcee.State(
        start.transpose(1, 0, 2).reshape(-1, d),
        log_prob=density(start).T.reshape(-1),
        random_state=random.get_state(),
    )
    state = sampler.run_mcmc(state, max(1, kept * plan.thin // 2), store=False, skip_initial_state_check=True)
    sampler.run_mcmc(state, kept, thin_by=plan.thin, skip_initial_state_check=True)

    def by_chain(values: FloatArray) -> FloatArray:
        """(kept, chains * members * blocks, ...) -> (chain, draw, block, ...)."""
        parts = values.reshape(kept, -1, members, n_blocks, *values.shape[2:])
        parts = parts.transpose(1, 2, 0, 3, *range(4, parts.ndim))
        return parts.reshape(-1, members * kept, n_blocks, *values.shape[2:])[:, : run.draws]

    result.draws[chains, :, part] = by_chain(sampler.get_chain())
    result.log_density[chains, :, part] = by_chain(sampler.get_log_prob())
    accepted = sampler.acceptance_fraction.reshape(n, n_blocks).mean(axis=0)
    result.acceptance[part] += accepted * n / (run.walkers * members)
