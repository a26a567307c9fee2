"""Chains of one posterior that are made longer, attempt by attempt, until they are good."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.sampling.density import LogDensity
from bayestouch.sampling.diagnostics import bulk_statistics
from bayestouch.sampling.draws import BlockDraws, Demands
from bayestouch.sampling.ensembles import renewal_round
from bayestouch.sampling.lockstep import sample_blocks
from bayestouch.sampling.proposals import RenewableProposal
from bayestouch.sampling.run import Run

#: Chains of a calibration.
CHAINS = 4


def demands_of(draws: int | None) -> Demands:
    """Return the targets of the chains of a calibration with `draws` draws in all; None if that is not known.

    Few draws have lower ones: their effective sample size is at most their number, and their R-hat scatters.
    """
    usual = Demands()
    if draws is None:
        return usual
    return replace(usual, ess_bulk=min(usual.ess_bulk, 0.4 * draws), rhat=max(usual.rhat, 1 + 8 * CHAINS / draws))


def long_enough(ess: FloatArray, rhat: FloatArray, draws: int) -> bool:
    """Return whether chains are long enough for `draws` draws in all."""
    return demands_of(draws).met(float(ess.min()), float(rhat.max()))


def draw_until_good(
    log_density: LogDensity,
    proposal: RenewableProposal,
    to_vectors: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    *,
    draws: int,
    seed: int,
    thins: Sequence[int],
    progress: Callable[[float], None] | None = None,
    moves: Any = None,
) -> BlockDraws:
    """Return draws of the vectors of one posterior, which is sampled in other coordinates, graded as vectors.

    Parameters
    ----------
    log_density, proposal, seed, moves
        As of `sample_blocks`, in the coordinates of the chains.
    to_vectors : callable
        From points (..., d) to vectors (..., d), and the log of the derivative (...).
    draws : int
        Number of draws in all.
    thins : sequence of int
        Steps per draw of each attempt; with `moves` there is one attempt of one step per draw. Where independence
        chains stick (Pareto shape above 0.5), the next attempts renew a part of the coordinates in each step, with half
        as many steps.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    BlockDraws
        Of the first attempt that is long enough, else of the best one. The log density is that of the vectors.
    """
    each, sticks, best = -(-draws // CHAINS), False, None
    for attempt, thin in enumerate(thins if moves is None else (1,)):
        if not sticks:
            drawn = sample_blocks(
                log_density,
                proposal,
                walkers=CHAINS,
                draws=thin * each,
                seed=seed,
                # One round: in so many dimensions an adapted proposal is not better than the first one.
                rounds=1,
                moves=moves,
                progress=part_of(progress, attempt),
            )
            points, log_at = drawn.draws[:, ::thin], drawn.log_density[:, ::thin]
            sticks = moves is None and not drawn.pareto_k[0] <= Demands().pareto_k
        else:
            run = Run(log_density, CHAINS, each, seed, Demands())
            drawn = renewal_round(run, proposal, np.zeros(1, dtype=np.intp), thin=thin // 2)
            points, log_at = drawn.draws, drawn.log_density
            if drawn.worst_ess[0] > 0:
                # The proposal of the next attempt is nearer to the target.
                proposal = proposal.refitted(points.reshape(-1, points.shape[-1]), float(drawn.worst_ess[0]))
        points, log_at = begun(points, log_at)
        kept, log_derivative = to_vectors(points)
        ess, rhat = bulk_statistics(kept)
        # The size is NaN where a chain found no point: such an attempt must not replace a better one.
        if best is None or np.isnan(best.ess_bulk.min()) or ess.min() > best.ess_bulk.min():
            log = log_at - log_derivative
            best = replace(drawn, draws=kept, log_density=log, ess_bulk=ess, rhat=rhat)
        if long_enough(ess, rhat, draws):
            break
    if progress is not None:
        progress(1.0)
    assert best is not None
    return best


def begun(points: FloatArray, log_at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Draws (chain, draw, block, d) and log densities (chain, draw, block) without those before a chain has begun.

    A chain begins with the first proposal inside the support; until then its draws are NaN. They become the first draw
    of the chain, or of another one if it has none: so short an attempt is not good enough, and a longer one follows.
    """
    missing: BoolArray = np.asarray(np.isnan(points).any(axis=(2, 3)))
    if not missing.any() or missing.all():
        return points, log_at
    points, log_at = points.copy(), log_at.copy()
    with_any: BoolArray = np.asarray((~missing).any(axis=1))
    for chain in range(len(points)):
        source = chain if with_any[chain] else int(with_any.argmax())
        first = int((~missing[source]).argmax())
        points[chain, missing[chain]] = points[source, first]
        log_at[chain, missing[chain]] = log_at[source, first]
    return points, log_at


def part_of(progress: Callable[[float], None] | None, attempt: int) -> Callable[[float], None] | None:
    """Return the progress of one attempt: the first fills one half, the next a half of what is left."""
    if progress is None:
        return None
    left = 0.5**attempt
    return lambda done: progress(1 - left + 0.5 * left * done)
