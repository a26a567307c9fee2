"""Draws of many touches, piece by piece and on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.inference.finger_modes import find_modes, with_whitener
from bayestouch.inference.finger_profile import profile_proposal
from bayestouch.inference.finger_reader import (
    CalibratedFinger,
    FingerPosterior,
    IndenterPriors,
    TouchReadings,
    full_whitener,
    noise_whitener,
)
from bayestouch.inference.reading_table import ReadingTable
from bayestouch.noise import Noise
from bayestouch.progress import Progress
from bayestouch.sampling import importance_blocks, sample_blocks

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

METHODS = ("emcee", "importance")
CHAINS = 4
# Touches of a piece: 512 touches x 1024 draws x 3 parameters are 13 MB.
PIECE = 512
# Fewer touches than this are drawn sooner than a second process starts.
WORTH_A_PROCESS = 1024


@dataclass(frozen=True, eq=False)
class DrawTask:
    """Everything a process needs to draw touches of one sensor.

    Attributes
    ----------
    chain, priors, table, noise
        The calibrated finger, priors of touches, its reading table, noise.
    reading_covariance : callable or None
        Covariance (t, m, m) of the readings that the calibration leaves uncertain, from R (mm), θ_c (rad) and
        P (N/m) of the touches; None takes the calibration as exact. Goes to other processes.
    method : {"emcee", "importance"}
        How to draw.
    draws : int
        Draws a touch, over all chains.
    seed : int
        Seed; a touch's draws depend on it and on the touch's number alone.
    """

    chain: CalibratedFinger
    priors: IndenterPriors
    table: ReadingTable
    noise: Noise
    reading_covariance: Callable[[FloatArray, FloatArray, FloatArray], FloatArray] | None
    method: str
    draws: int
    seed: int


def draw_in_pieces(
    task: DrawTask, touches: TouchReadings, workers: int | None, progress: Progress | None
) -> list[dict[str, FloatArray]]:
    """Draw all touches; one dictionary a piece, in order. The result does not depend on the number of workers."""
    starts = range(0, touches.n_touches, PIECE)
    pieces = [(start, touches.select(np.arange(start, min(start + PIECE, touches.n_touches)))) for start in starts]
    workers = (os.cpu_count() or 1) if workers is None else workers
    done: list[dict[str, FloatArray]] = []
    if workers <= 1 or touches.n_touches < WORTH_A_PROCESS:
        for start, piece in pieces:
            done.append(draw_touches(task, piece, start))
            if progress is not None:
                progress(len(done) / len(pieces))
        return done
    from concurrent.futures import ProcessPoolExecutor

    with ProcessPoolExecutor(min(workers, len(pieces)), initializer=_receive, initargs=(task,)) as pool:
        for result in pool.map(_draw_received, pieces):
            done.append(result)
            if progress is not None:
                progress(len(done) / len(pieces))
    return done


_received: DrawTask | None = None


def _receive(task: DrawTask) -> None:
    """Keep the task in this worker process: the table goes there once, not with every piece."""
    global _received
    _received = task


def _draw_received(piece: tuple[int, TouchReadings]) -> dict[str, FloatArray]:
    assert _received is not None
    return draw_touches(_received, piece[1], piece[0])


def draw_touches(task: DrawTask, touches: TouchReadings, first: int) -> dict[str, FloatArray]:
    """Draws and grades of some touches, by public name; the last axis is the touch.

    Parameters
    ----------
    task : DrawTask
        Sensor, priors and options.
    touches : TouchReadings
        The touches.
    first : int
        Number of the first of them.

    Returns
    -------
    dict
        ``R``, ``r_c`` (mm), ``theta_c`` (degree), ``P`` (N/m): (chain, draw, t); grades: (t,).
    """
    posterior = FingerPosterior(task.chain, touches, task.priors, noise_whitener(task.noise, touches), task.table)
    mode, hessian = find_modes(posterior)
    if task.reading_covariance is not None:
        covariance = task.reading_covariance(posterior.radius(mode[:, 0]), mode[:, 1], mode[:, 2])
        posterior = with_whitener(posterior, full_whitener(task.noise, touches, covariance))
        mode, hessian = find_modes(posterior)
    drawn, grades = _draw(task, posterior, mode, hessian, first)
    radius = posterior.radius(drawn[..., 0])
    outer = task.chain.outer_radius_mm
    # R reaches r_b to the last bit for a flat; its r_c would be infinite, which means cannot hold: R stays just below.
    radius = np.minimum(radius, outer * (1 - 1e-9))
    return {
        "R": radius,
        "r_c": radius * outer / (outer - radius),
        "theta_c": np.degrees(drawn[..., 1]),
        "P": drawn[..., 2],
        **grades,
    }


def _draw(
    task: DrawTask, posterior: FingerPosterior, mode: FloatArray, hessian: FloatArray, first: int
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Coordinates (chain, draw, t, 3) and grades of the touches."""
    t = posterior.touches.n_touches
    each = -(-task.draws // CHAINS)
    proposal = profile_proposal(posterior, mode, hessian)

    def log_density(x: FloatArray, blocks: IntArray) -> FloatArray:
        return posterior.log_density(x, blocks - first)

    drawn = np.empty((CHAINS, each, t, 3))
    grades = {name: np.full(t, np.nan) for name in ("ess_bulk", "rhat", "acceptance", "pareto_k", "round", "grade")}
    left = np.arange(t)
    if task.method == "importance":
        weighted = importance_blocks(
            log_density,
            proposal,
            proposals=task.draws,
            walkers=CHAINS,
            draws=each,
            seed=task.seed,
            blocks=first + left,
        )
        drawn[:] = weighted.draws
        # Weighted draws are independent: their size is that of the weights, and there is no chain to compare.
        grades["ess_bulk"][:] = weighted.ess
        grades["rhat"][:] = 1.0
        grades["acceptance"][:] = 1.0
        grades["pareto_k"][:] = weighted.pareto_k
        grades["round"][:] = 0.0
        grades["grade"][:] = weighted.grade
        left = np.flatnonzero(~weighted.grade)
    if len(left):
        chains = sample_blocks(
            log_density, proposal.select(left), walkers=CHAINS, draws=each, seed=task.seed, blocks=first + left
        )
        drawn[:, :, left] = chains.draws
        grades["ess_bulk"][left] = chains.worst_ess
        grades["rhat"][left] = chains.worst_rhat
        grades["acceptance"][left] = chains.acceptance
        grades["pareto_k"][left] = chains.pareto_k
        grades["round"][left] = chains.rounds
        grades["grade"][left] = chains.grade
    return drawn, grades
