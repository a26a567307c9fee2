"""Posterior draws of many touches, computed in pieces by several processes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.parallel.processes import cores, may_fork, shared_empty, spread_out
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
        Seed. The draws of a touch depend only on it and on the number of touches before it.
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
    def largest_rhat(self) -> float:
        """R-hat that no parameter of a touch may exceed; otherwise the touch is drawn again.

        R-hat of correct chains scatters, by about as many hundredths as there are chains for each hundred draws.
        """
        return 1 + max(0.02, 3 / self.draws_a_chain)

    @property
    def first_round(self) -> int:
        """Number of the round in which all touches are drawn."""
        return 0 if self.method == "importance" else 1


@dataclass(frozen=True, eq=False)
class Drawing:
    """A block of touches that is being drawn.

    Attributes
    ----------
    first : int
        Number of its first touch.
    block, touches : object
        The block, and its touches in the form that the sampler needs.
    place : int
        Number of the memory that its draws are written to.
    pieces, results
        Rows of each piece of work, and what the work returns.
    """

    first: int
    block: Any
    touches: Any
    place: int
    pieces: Sequence[IndexArray]
    results: Iterator[Any]


def draw(
    sampler: TouchSampler[Any],
    touches: Any,
    plan: DrawPlan,
    *,
    workers: int | None = None,
) -> Drawn:
    """Posterior draws of one block of touches, numbered from 0. See `draw_blocks`."""
    t = touches.n_touches
    blocks = draw_blocks(sampler, iter([(0, touches)]), lambda block: block, plan, t, t, workers)
    return next(blocks)[2]


def draw_blocks(
    sampler: TouchSampler[Any],
    blocks: Iterator[tuple[int, Any]],
    unknown: Callable[[Any], Any],
    plan: DrawPlan,
    n_touches: int,
    largest: int,
    workers: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Iterator[tuple[int, Any, Drawn]]:
    """Yield posterior draws of blocks of touches, in order.

    The touches of a block are divided into pieces, which are drawn in parallel, see `bayestouch.parallel.processes`.
    While the caller uses one block, the next two are drawn.

    Parameters
    ----------
    sampler : TouchSampler
        The calibrated sensor.
    blocks : iterator of (int, Block)
        Number of the first touch of a block, and the block.
    unknown : callable
        Function of a block: its touches in the form that the sampler needs.
    plan : DrawPlan
        Settings of the sampler.
    n_touches, largest : int
        Number of touches in all blocks, and in the largest one.
    workers : int, optional
        Number of processes; by default the number of cores. The result does not depend on it.
    progress : callable, optional
        Function that is called with the number of touches that are drawn.

    Yields
    ------
    first, block, drawn
        The arrays of `TouchSampler.shapes` and the `GRADES`; the last axis is the touch. Their memory is used again
        for later blocks: copy what is needed after the next block is requested.
    """
    workers = cores(workers) if n_touches >= SHARED_FROM else 1
    lag = 0 if workers == 1 else 1
    shapes = {**sampler.shapes(CHAINS, plan.draws_a_chain), **dict.fromkeys(GRADES, ())}
    one = sum(int(np.prod(shape)) for shape in shapes.values())
    empty = np.empty if workers == 1 or not may_fork() else shared_empty
    memory = [empty((one * largest,)) for _ in range(min(1 + 2 * lag, -(-n_touches // largest)))]
    start = plan.first_round
    rounds = (start, start) if sampler.redraws_together else (start, LAST_ROUND)
    done = 0

    def draw_piece(
        piece: tuple[int, int, IndexArray, Any, IndexArray, bool],
    ) -> list[tuple[IndexArray, Drawn]]:
        place, t, rows, touches, numbers, again = piece
        drawn = draw_groups(sampler, touches, plan, numbers, (start + 1, LAST_ROUND) if again else rounds)
        if again:
            return [(rows[some], values) for some, values in drawn]
        out = arrays(memory[place], shapes, t)
        for some, values_by_name in drawn:
            at = rows[some]
            # numpy writes to a slice several times as fast as to numbered columns
            columns = slice(at[0], at[-1] + 1) if at[-1] - at[0] == len(at) - 1 else at
            for name, values in values_by_name.items():
                out[name][..., columns] = values
        return []

    def begin(numbered: tuple[int, tuple[int, Any]]) -> Drawing:
        number, (first, block) = numbered
        touches = unknown(block)
        return submitted(Drawing(first, block, touches, number % len(memory), (), iter(())), None)

    def submitted(drawing: Drawing, poor: IndexArray | None) -> Drawing:
        t, again = drawing.touches.n_touches, poor is not None
        pieces = sampler.pieces(np.arange(t) if poor is None else poor, again=again)
        work = [(drawing.place, t, rows, drawing.touches.select(rows), drawing.first + rows, again) for rows in pieces]
        return replace(drawing, pieces=pieces, results=spread(work))

    def again(drawing: Drawing) -> Drawing:
        """Wait for the first draws of a block, and begin to draw the poor ones again."""
        nonlocal done
        for piece, _ in zip(drawing.pieces, drawing.results, strict=True):
            done += len(piece)
            if progress is not None:
                progress(done)
        grade = arrays(memory[drawing.place], shapes, drawing.touches.n_touches)["grade"]
        return submitted(drawing, np.flatnonzero(grade == 0) if sampler.redraws_together else np.arange(0))

    def complete(drawing: Drawing) -> tuple[int, Any, Drawn]:
        out = arrays(memory[drawing.place], shapes, drawing.touches.n_touches)
        for groups in drawing.results:
            for rows, drawn in groups:
                # Chains replace poor importance weights even if they are poor too: their grades are more reliable.
                better = (drawn["grade"] > 0) | (drawn["ess_bulk"] > out["ess_bulk"][rows]) | (start == 0)
                for name, values in drawn.items():
                    out[name][..., rows[better]] = values[..., better]
        return drawing.first, drawing.block, out

    with spread_out(draw_piece, workers) as spread:
        begun = map(begin, enumerate(blocks))
        yield from map(complete, _late(map(again, _late(begun, lag)), lag))


def arrays(memory: FloatArray, shapes: Mapping[str, tuple[int, ...]], t: int) -> Drawn:
    """Return arrays (*shape, t) by name, one after the other in `memory`."""
    out, begin = {}, 0
    for name, shape in shapes.items():
        end = begin + int(np.prod(shape)) * t
        out[name] = memory[begin:end].reshape(*shape, t)
        begin = end
    return out


def _late(items: Iterator[Drawing], lag: int) -> Iterator[Drawing]:
    """Yield each item when `lag` more have been taken."""
    held: deque[Drawing] = deque()
    for item in items:
        held.append(item)
        if len(held) > lag:
            yield held.popleft()
    yield from held


def draw_groups(
    sampler: TouchSampler[Any], touches: Any, plan: DrawPlan, numbers: IndexArray, rounds: tuple[int, int]
) -> Iterator[tuple[IndexArray, Drawn]]:
    """Rows and results of each group of touches, drawn from the first to the last of `rounds`."""
    for group in sampler.groups(touches, np.arange(len(numbers))):
        drawn = _sample(group, plan, numbers[group.rows], rounds)
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
    demands = Demands(ess_bulk=plan.least_ess, rhat=plan.largest_rhat)
    return sample_blocks(log_density, proposal, demands=demands, first_round=rounds[0], rounds=rounds[1], **common)


def _grades(drawn: BlockDraws | ImportanceDraws) -> tuple[NDArray[Any], ...]:
    """Grades of the draws, in the order of `GRADES`."""
    if isinstance(drawn, ImportanceDraws):
        # Weighted draws are independent: their size is that of the weights, and there are no chains to compare.
        one = np.ones(len(drawn.ess))
        return drawn.ess, one, one, drawn.pareto_k, 0 * one, drawn.grade
    return drawn.worst_ess, drawn.worst_rhat, drawn.acceptance, drawn.pareto_k, drawn.rounds, drawn.grade
