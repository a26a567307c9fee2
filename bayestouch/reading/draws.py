"""Posterior draws of many touches, computed in pieces by several processes."""

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
#: Names of the arrays (t,) that grade the draws of a touch.
GRADES = ("ess_bulk", "rhat", "acceptance", "pareto_k", "round", "grade")


@dataclass(frozen=True)
class DrawPlan:
    """Settings of the sampler.

    Attributes
    ----------
    draws : int
        Draws of a touch, over all chains.
    seed : int
        Seed. The draws of a touch depend only on it and on the number of the touch.
    method : {"emcee", "importance"}
        Sampling method.
    least_ess : float
        Effective sample size that every parameter of a touch must reach; otherwise the touch is drawn again.
    """

    draws: int
    seed: int
    method: str = "emcee"
    least_ess: float = 400.0

    @property
    def draws_a_chain(self) -> int:
        """Number of draws of each of the `CHAINS` chains."""
        return -(-self.draws // CHAINS)

    @property
    def first_round(self) -> int:
        """Number of the round in which all touches are drawn."""
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
    """Posterior draws of touches.

    The touches are divided into pieces, which are drawn in parallel, see `bayestouch.parallel.processes`.

    Parameters
    ----------
    sampler : TouchSampler
        The calibrated sensor.
    touches : Block
        The touches in the form that the sampler needs.
    plan : DrawPlan
        Settings of the sampler.
    workers : int, optional
        Number of processes; by default the number of cores. The result does not depend on it.
    progress : callable, optional
        Function that is called with the fraction of the work that is done.
    first : int
        Number of the first touch.

    Returns
    -------
    dict
        The arrays of `TouchSampler.shapes` and the `GRADES`; the last axis is the touch.
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
                # Chains replace poor importance weights even if they are poor too: their grades are more reliable.
                better = (drawn["grade"] > 0) | (drawn["ess_bulk"] > out["ess_bulk"][rows]) | (start == 0)
                for name, values in drawn.items():
                    out[name][..., rows[better]] = values[..., better]
    return out


def draw_groups(
    sampler: TouchSampler[Any], touches: Any, rows: IndexArray, plan: DrawPlan, first: int, rounds: tuple[int, int]
) -> Iterator[tuple[IndexArray, Drawn]]:
    """Rows and results of each group of touches, drawn from the first to the last of `rounds`."""
    for group in sampler.groups(touches, rows):
        drawn = _sample(group, plan, first + group.rows, rounds)
        grades = dict(zip(GRADES, _grades(drawn), strict=True))
        yield group.rows, {**group.results(drawn.draws), **grades}


def _sample(
    group: TouchGroup, plan: DrawPlan, numbers: IndexArray, rounds: tuple[int, int]
) -> BlockDraws | ImportanceDraws:
    """Draws of the coordinates of a group's touches; `numbers` are the numbers of the touches."""

    def log_density(x: FloatArray, blocks: IndexArray) -> FloatArray:
        return group.log_density(x, np.searchsorted(numbers, blocks))

    n, proposal = plan.draws_a_chain, group.proposal
    common: dict[str, Any] = {"walkers": CHAINS, "draws": n, "seed": plan.seed, "blocks": numbers}
    if rounds[0] == 0:
        return importance_blocks(log_density, proposal, proposals=plan.draws, least_ess=plan.least_ess, **common)
    # R-hat of correct chains scatters, by about as many hundredths as there are chains for each hundred draws.
    demands = Demands(ess_bulk=plan.least_ess, rhat=1 + max(0.02, 3 / n))
    return sample_blocks(log_density, proposal, demands=demands, first_round=rounds[0], rounds=rounds[1], **common)


def _grades(drawn: BlockDraws | ImportanceDraws) -> tuple[NDArray[Any], ...]:
    """Grades of the draws, in the order of `GRADES`."""
    if isinstance(drawn, ImportanceDraws):
        # Weighted draws are independent: their size is that of the weights, and there are no chains to compare.
        one = np.ones(len(drawn.ess))
        return drawn.ess, one, one, drawn.pareto_k, 0 * one, drawn.grade
    return drawn.worst_ess, drawn.worst_rhat, drawn.acceptance, drawn.pareto_k, drawn.rounds, drawn.grade
