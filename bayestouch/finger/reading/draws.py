"""Draws of many touches, piece by piece and on all cores."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.chain.noise import Noise
from bayestouch.finger.reading.alternatives import propose_alternatives, search_prior
from bayestouch.finger.reading.modes import find_modes, with_whitener
from bayestouch.finger.reading.profile import profile_proposal
from bayestouch.finger.reading.reader import (
    CalibratedFinger,
    FingerPosterior,
    IndenterPriors,
    TouchReadings,
    full_whitener,
    noise_whitener,
)
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.parallel.processes import cores, may_fork, shared_empty, spread_out
from bayestouch.priors.radius import RadiusOfTips
from bayestouch.progress import Progress
from bayestouch.sampling import BlockDraws, BlockProposal, Demands, ImportanceDraws, importance_blocks, sample_blocks

Drawn = dict[str, FloatArray]

METHODS = ("emcee", "importance")
CHAINS = 4
# Touches of a piece: so many that emcee's own work for a step is little beside theirs; and of those drawn again, which
# take many steps, few enough that every core has some.
PIECE, PIECE_AGAIN = 512, 128
# Fewer touches take no longer than starting other processes does.
SHARED_FROM = 256
#: What is drawn, (chain, draw, t), and the grades that go with it, (t,).
DRAWN = ("r_c", "R", "theta_c", "P")
GRADES = ("ess_bulk", "rhat", "acceptance", "pareto_k", "round", "grade")
#: Log probability of each tip, and of what is none of them, where the prior has tips: (k, t).
TIPS = "tip_log_probability"


@dataclass(frozen=True, eq=False)
class DrawTask:
    """Everything it takes to draw touches of one sensor.

    Attributes
    ----------
    chain, priors, table, noise
        The calibrated finger, priors of touches, its reading table, noise.
    reading_covariance : callable or None
        Covariance (t, m, m) of the readings that the calibration leaves uncertain, from R (mm), θ_c (rad) and
        P (N/m) of the touches; None takes the calibration as exact.
    method : {"emcee", "importance"}
        How to draw.
    draws : int
        Draws a touch, over all chains.
    seed : int
        Seed; a touch's draws depend on it and on the touch's number alone.
    least_ess : float
        Effective sample size that every parameter of a touch must reach; below it the touch is drawn again.
    """

    chain: CalibratedFinger
    priors: IndenterPriors
    table: ReadingTable
    noise: Noise
    reading_covariance: Callable[[FloatArray, FloatArray, FloatArray], FloatArray] | None
    method: str
    draws: int
    seed: int
    least_ess: float = 400.0

    @property
    def draws_a_chain(self) -> int:
        """Draws of each of the `CHAINS` chains."""
        return -(-self.draws // CHAINS)


def draw_all(
    task: DrawTask,
    touches: TouchReadings,
    workers: int | None = None,
    progress: Progress | None = None,
    first: int = 0,
) -> Drawn:
    """Draws and grades of all touches, by public name; the last axis is the touch.

    Pieces are drawn side by side, see `bayestouch.parallel.processes`. The few touches whose draws are poor at
    first are drawn again together, wherever they are in the table.

    Parameters
    ----------
    task : DrawTask
        Sensor, priors and options.
    touches : TouchReadings
        The touches.
    workers : int, optional
        How many draw at once; as many as there are cores by default. The result does not depend on it.
    progress : callable, optional
        Called with the share of the work done.
    first : int
        Number of the first touch.

    Returns
    -------
    dict
        ``R``, ``r_c`` (mm), ``theta_c`` (degree), ``P`` (N/m): (chain, draw, t); grades: (t,); `TIPS`: (k, t).
    """
    t = touches.n_touches
    workers = cores(workers) if t >= SHARED_FROM else 1
    empty = np.empty if workers == 1 or not may_fork() else shared_empty
    out: Drawn = {name: empty((CHAINS, task.draws_a_chain, t)) for name in DRAWN}
    out |= {name: empty((t,)) for name in GRADES}
    if isinstance(task.priors.radius, RadiusOfTips):
        out[TIPS] = empty((task.priors.radius.n_alternatives, t))
    # Round 0 is importance sampling.
    start = 0 if task.method == "importance" else 1

    def draw(piece: tuple[IndexArray, bool]) -> tuple[IndexArray, Drawn]:
        rows, again = piece
        drawn = draw_touches(task, touches.select(rows), first + rows, (start + 1, 3) if again else (start, start))
        if again:
            return rows, drawn
        for name, values in drawn.items():
            out[name][..., rows[0] : rows[-1] + 1] = values
        return rows, {}

    with spread_out(draw, workers) as spread:
        for rows, _ in spread([(rows, False) for rows in _pieces(np.arange(t), PIECE)]):
            if progress is not None:
                progress((rows[-1] + 1) / t)
        poor = np.flatnonzero(out["grade"] == 0)
        for rows, drawn in spread([(rows, True) for rows in _pieces(poor, PIECE_AGAIN)]):
            # Chains replace poor weights even where they are poor themselves: they at least tell what they missed.
            better = (drawn["grade"] > 0) | (drawn["ess_bulk"] > out["ess_bulk"][rows]) | (start == 0)
            for name, values in drawn.items():
                out[name][..., rows[better]] = values[..., better]
    return out


def _pieces(rows: IndexArray, largest: int) -> list[IndexArray]:
    """Rows in pieces of about the same size, an even number of them; the pieces do not depend on who draws them."""
    return [piece for piece in np.array_split(rows, 2 * -(-len(rows) // (2 * largest)) or 1) if len(piece)]


def draw_touches(task: DrawTask, touches: TouchReadings, numbers: IndexArray, rounds: tuple[int, int]) -> Drawn:
    """Draws and grades of some touches, numbered in ascending order, from the first to the last of `rounds`."""
    search = replace(task.priors, radius=search_prior(task.priors.radius, task.chain.outer_radius_mm))
    posterior = FingerPosterior(task.chain, touches, search, noise_whitener(task.noise, touches), task.table)
    mode, hessian = find_modes(posterior)
    covariance_of = task.reading_covariance if touches.context is None else touches.context.covariance
    if covariance_of is not None:
        covariance = covariance_of(posterior.radius(mode[:, 0]), mode[:, 1], mode[:, 2])
        posterior = with_whitener(posterior, full_whitener(task.noise, touches, covariance))
        mode, hessian = find_modes(posterior, mode)
    posterior = replace(posterior, priors=task.priors)
    indenter, tips = posterior.indenter, isinstance(task.priors.radius, RadiusOfTips)
    proposal: BlockProposal
    if tips:
        proposal, log_probability = propose_alternatives(posterior, mode, hessian)
    else:
        proposal = profile_proposal(posterior, mode, hessian)
    drawn = _draw(task, posterior, proposal, numbers, rounds)
    radius, indenter_radius = indenter.indenter_radius(drawn.draws[..., 0])
    out = {
        "r_c": indenter_radius,
        "R": radius,
        "theta_c": np.degrees(drawn.draws[..., 1]),
        "P": drawn.draws[..., 2],
        **dict(zip(GRADES, _grades(drawn), strict=True)),
    }
    if tips:
        unsure = np.isnan(log_probability[0])
        log_probability[:, unsure] = indenter.log_shares(drawn.draws[:, :, unsure, 0])
        out[TIPS] = log_probability
    return out


def _draw(
    task: DrawTask, posterior: FingerPosterior, proposal: BlockProposal, numbers: IndexArray, rounds: tuple[int, int]
) -> BlockDraws | ImportanceDraws:
    """Draw coordinates of the touches."""

    def log_density(x: FloatArray, blocks: IndexArray) -> FloatArray:
        return posterior.log_density(x, np.searchsorted(numbers, blocks))

    common: dict[str, Any] = {
        "walkers": CHAINS,
        "draws": task.draws_a_chain,
        "seed": task.seed,
        "blocks": numbers,
    }
    if rounds == (0, 0):
        return importance_blocks(log_density, proposal, proposals=task.draws, least_ess=task.least_ess, **common)
    # R-hat of chains that are right scatters by as many hundredths as there are chains for each hundred draws.
    demands = Demands(ess_bulk=task.least_ess, rhat=1 + max(0.02, 3 / task.draws_a_chain))
    return sample_blocks(log_density, proposal, demands=demands, first_round=rounds[0], rounds=rounds[1], **common)


def _grades(drawn: BlockDraws | ImportanceDraws) -> tuple[NDArray[Any], ...]:
    """In the order of `GRADES`."""
    if isinstance(drawn, ImportanceDraws):
        # Weighted draws are independent: their size is that of the weights, and there is no chain to compare.
        one = np.ones(len(drawn.ess))
        return drawn.ess, one, one, drawn.pareto_k, 0 * one, drawn.grade
    return drawn.worst_ess, drawn.worst_rhat, drawn.acceptance, drawn.pareto_k, drawn.rounds, drawn.grade
