"""Thousands of independent posteriors drawn by emcee side by side."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.sampling.adapt import adapt
from bayestouch.sampling.density import LogDensity
from bayestouch.sampling.draws import BlockDraws, Demands, keep_better
from bayestouch.sampling.ensembles import ensemble_round
from bayestouch.sampling.independence import independence_round
from bayestouch.sampling.proposals import BlockProposal
from bayestouch.sampling.run import Run

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

# Beyond this many parameters a mixture cannot be fitted to a thousand draws, and ensembles mix too slowly.
LARGEST_RESHAPED = 8
# Steps for each draw kept of a block that is drawn again.
THIN_AGAIN = 4


def sample_blocks(
    log_density: LogDensity,
    proposal: BlockProposal,
    *,
    walkers: int = 4,
    draws: int = 256,
    seed: int,
    blocks: ArrayLike | None = None,
    demands: Demands | None = None,
    rounds: int = 3,
    progress: Callable[[float], None] | None = None,
) -> BlockDraws:
    """Draw from many posteriors at once with emcee.

    One `emcee.EnsembleSampler` holds the walkers of many blocks, with a move that proposes each walker by itself
    from its block's proposal: every walker is an independence Metropolis chain. Blocks that miss the demands are
    drawn again, four steps for each draw kept, from a mixture fitted to the posterior; those that still miss are
    drawn with stretch and differential-evolution moves, in ensembles of their own. The better round is kept.
    Above eight parameters the second round has the first proposal again and there is no third.

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
    small = proposal.dimension <= LARGEST_RESHAPED
    result = independence_round(run, proposal, numbers, round_=1, thin=1, progress=progress)
    poor = np.flatnonzero(~result.grade)
    if rounds >= 2 and len(poor):
        better = proposal.select(poor)
        if small:
            better = adapt(log_density, better, numbers[poor], seed)
        again = independence_round(run, better, numbers[poor], round_=2, thin=THIN_AGAIN)
        keep_better(result, again, poor)
        still = np.flatnonzero(~result.grade[poor])
        if rounds >= 3 and len(still) and small:
            keep_better(result, ensemble_round(run, better.select(still), numbers[poor[still]]), poor[still])
    return result
