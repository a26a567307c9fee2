"""First and second round of sampling: independence Metropolis chains."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from bayestouch.array_types import IndexArray
from bayestouch.sampling.density import POINTS_A_CALL, BlockDensity, by_walker, of_blocks
from bayestouch.sampling.draws import BlockDraws, empty_draws, grade
from bayestouch.sampling.proposals import BlockProposal
from bayestouch.sampling.run import Run
from bayestouch.sampling.streams import BlockStreams

if TYPE_CHECKING:
    from bayestouch.sampling.moves import IndependenceMove


# Maximum number of proposals in memory.
POINTS_HELD = 1 << 19
# Discarded fraction at the start of a chain, and the minimum number: the first accepted proposal removes the start.
LEFT_OUT, LEAST_LEFT_OUT = 1 / 16, 8


def independence_round(
    run: Run,
    proposal: BlockProposal,
    numbers: IndexArray,
    *,
    round_: int,
    thin: int,
    progress: Callable[[float], None] | None = None,
) -> BlockDraws:
    """Return draws from one independence chain per walker; every `thin`-th step is kept."""
    from bayestouch.sampling.moves import IndependenceMove

    n_blocks = proposal.n_blocks
    result = empty_draws(run.walkers, run.draws, n_blocks, proposal.dimension, round_)
    left_out = thin * max(LEAST_LEFT_OUT, round(LEFT_OUT * run.draws))
    points = run.walkers * (left_out + thin * run.draws)
    total, done = n_blocks * points, 0

    def called(count: int) -> None:
        nonlocal done
        done += count
        if progress is not None:
            progress(done / total)

    a_call = POINTS_A_CALL if progress is None else min(POINTS_A_CALL, max(1, total // 100))
    held = max(1, POINTS_HELD // points)
    for first in range(0, n_blocks, held):
        index = np.arange(first, min(first + held, n_blocks))
        part = slice(first, first + len(index))
        density = of_blocks(run.log_density, numbers[part], points_a_call=a_call, called=called)
        streams = BlockStreams(run.seed, numbers[part], purpose=round_)
        move = IndependenceMove(proposal.select(index), streams, left_out + thin * run.draws)
        _chains(run, density, move, result, part, left_out, thin)
        grade(result, part, run.demands)
    return result


def _chains(
    run: Run,
    density: BlockDensity,
    move: IndependenceMove,
    result: BlockDraws,
    part: slice,
    left_out: int,
    thin: int,
) -> None:
    """Run the chains of some blocks into `result`."""
    import emcee

    from bayestouch.sampling.backend import BlockBackend
    from bayestouch.sampling.sampler import ArraySampler

    d, blocks = result.draws.shape[-1], len(result.acceptance[part])
    backend = BlockBackend(result.draws[:, :, part], result.log_density[:, :, part])
    n_walkers = run.walkers * blocks
    log_prob = by_walker(density, blocks)
    sampler = ArraySampler(n_walkers, d, log_prob, moves=move, vectorize=True, backend=backend)
    # The same memory order as in the proposals; the first proposal replaces this starting point.
    state = emcee.State(np.zeros((d, n_walkers)).T, log_prob=np.full(n_walkers, -np.inf))
    state = sampler.run_mcmc(state, left_out, store=False, skip_initial_state_check=True)
    sampler.run_mcmc(state, run.draws, thin_by=thin, skip_initial_state_check=True)
    result.acceptance[part] = move.acceptance()
    result.pareto_k[part] = move.pareto_k
