"""Draws of many touches: in pieces, shared out to processes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.parallel.processes import cores, may_fork, shared_empty, spread_out
from bayestouch.progress import Progress
from bayestouch.reading.touch_reader import Drawn, TouchGroup, TouchSampler
from bayestouch.sampling import BlockDraws, Demands, ImportanceDraws, importance_blocks, sample_blocks

CHAINS = 4
#: With fewer touches, starting other processes takes as long as drawing.
SHARED_FROM = 256
#: Rounds of the sampler, see `bayestouch.sampling.sample_blocks`. Round 0 is importance sampling.
LAST_ROUND = 3
#: Grades of the draws of a touch, (t,).
GRADES = ("ess_bulk", "rhat", "acceptance", "pareto_k", "round", "grade")


@dataclass(frozen=True)
class DrawPlan:
    """How touches are drawn.

    Attributes
    ----------
    draws : int
        Draws of a touch, over all chains.
    seed : int
        A touch's draws depend on it and on the touch's number alone.
    method : {"emcee", "importance"}
        How to draw.
    least_ess : float
        Effective sample size that every parameter of a touch must reach; below it the touch is drawn again.
    """

    draws: int
    seed: int
    method: str = "emcee"
    least_ess: float = 400.0

    @property
    def draws_a_chain(self) -> int:
        """Draws of each of the `CHAINS` chains."""
        return -(-self.draws // CHAINS)

    @property
    def first_round(self) -> int:
        """Round that draws all touches."""
        return 0 if self.method == "importance" else 1


def draw(
    sampler: TouchSampler[Any],
    touches: Any,
    plan: DrawPlan,
    *,
    workers: int | None = None,
    progress: Progress | None = None,
    first: int = 0,
) -> Drawn:
    """Draw the posteriors of touches.

    Pieces are drawn side by side, see `bayestouch.parallel.processes`.

    Parameters
    ----------
    sampler : TouchSampler
        The calibrated sensor.
    touches : Block
        The touches as the sampler takes them.
    plan : DrawPlan
        How to draw.
    workers : int, optional
        How many processes draw; as many as there are cores by default. The result does not depend on it.
    progress : callable, optional
        Called with the share of the work done.
    first : int
        Number of the first touch.

    Returns
    -------
    dict
        Arrays of `TouchSampler.shapes`, and the `GRADES`; the last axis is the touch.
    """
    t = touches.n_touches
    workers = cores(workers) if t >= SHARED_FROM else 1
    empty = np.empty if workers == 1 or not may_fork() else shared_empty
    shapes = {**sampler.shapes(CHAINS, plan.draws_a_chain), **dict.fromkeys(GRADES, ())}
    out: Drawn = {name: empty((*shape, t)) for name, shape in shapes.items()}
    start = plan.first_round
    rounds = (start, start) if sampler.redraws_together else (start, LAST_ROUND)

    def draw_piece(piece: tuple[IndexArray, bool]) -> list[tuple[IndexArray, Drawn]]:
        rows, again = piece
        drawn = draw_groups(sampler, touches, rows, plan, first, (start + 1, LAST_ROUND) if again else rounds)
        if again:
            return list(drawn)
        for some, values_by_name in drawn:
            for name, values in values_by_name.items():
                out[name][..., some] = values
        return []

    with spread_out(draw_piece, workers) as spread:
        pieces, done = sampler.pieces(np.arange(t), again=False), 0
        for piece, _ in zip(pieces, spread([(rows, False) for rows in pieces]), strict=True):
            done += len(piece)
            if progress is not None:
                progress(done / t)
        poor = np.flatnonzero(out["grade"] == 0) if sampler.redraws_together else np.arange(0)
        for groups in spread([(rows, True) for rows in sampler.pieces(poor, again=True)]):
            for rows, drawn in groups:
                # Chains replace poor weights even where they are poor themselves: they at least tell what they missed.
                better = (drawn["grade"] > 0) | (drawn["ess_bulk"] > out["ess_bulk"][rows]) | (start == 0)
                for name, values in drawn.items():
                    out[name][..., rows[better]] = values[..., better]
    return out


def draw_groups(
    sampler: TouchSampler[Any], touches: Any, rows: IndexArray, plan: DrawPlan, first: int, rounds: tuple[int, int]
) -> Iterator[tuple[IndexArray, Drawn]]:
    """Draw some touches, from the first to the last of `rounds`; yields the rows of each group, and what is kept."""
    for group in sampler.groups(touches, rows):
        drawn = _sample(group, plan, first + group.rows, rounds)
        grades = dict(zip(GRADES, _grades(drawn), strict=True))
        yield group.rows, {**group.results(drawn.draws), **grades}


def _sample(
    group: TouchGroup, plan: DrawPlan, numbers: IndexArray, rounds: tuple[int, int]
) -> BlockDraws | ImportanceDraws:
    """Draw coordinates of the touches of a group, which have these numbers."""

    def log_density(x: FloatArray, blocks: IndexArray) -> FloatArray:
        return group.log_density(x, np.searchsorted(numbers, blocks))

    n, proposal = plan.draws_a_chain, group.proposal
    common: dict[str, Any] = {"walkers": CHAINS, "draws": n, "seed": plan.seed, "blocks": numbers}
    if rounds[0] == 0:
        return importance_blocks(log_density, proposal, proposals=plan.draws, least_ess=plan.least_ess, **common)
    # R-hat of chains that are right scatters by as many hundredths as there are chains for each hundred draws.
    demands = Demands(ess_bulk=plan.least_ess, rhat=1 + max(0.02, 3 / n))
    return sample_blocks(log_density, proposal, demands=demands, first_round=rounds[0], rounds=rounds[1], **common)


def _grades(drawn: BlockDraws | ImportanceDraws) -> tuple[NDArray[Any], ...]:
    """In the order of `GRADES`."""
    if isinstance(drawn, ImportanceDraws):
        # Weighted draws are independent: their size is that of the weights, and there is no chain to compare.
        one = np.ones(len(drawn.ess))
        return drawn.ess, one, one, drawn.pareto_k, 0 * one, drawn.grade
    return drawn.worst_ess, drawn.worst_rhat, drawn.acceptance, drawn.pareto_k, drawn.rounds, drawn.grade
