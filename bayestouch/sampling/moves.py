"""Moves for emcee that advance the walkers of many independent posteriors in one step.

The walkers of one block do not interact with those of another block.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from emcee.moves import Move
from numpy.typing import NDArray

from bayestouch.array_types import BoolArray, FloatArray, IndexArray
from bayestouch.sampling.density import POINTS_A_CALL, BlockDensity, LogDensity, weighed
from bayestouch.sampling.pareto import pareto_shape
from bayestouch.sampling.proposals import BlockProposal
from bayestouch.sampling.streams import BlockStreams


class IndependenceMove(Move):  # type: ignore[misc]  # emcee has no types
    """Independence move: each walker gets a point from the proposal of its block, which is accepted or rejected.

    Proposals do not depend on the state; therefore those of all steps are drawn and evaluated at the first step.
    Walkers are independent chains. Walker ``w B + b`` is the w-th walker of block b. The first step accepts any point
    of finite density, because a walker starts without a point (log density ``-inf``).

    Parameters
    ----------
    proposal : BlockProposal
        One distribution for each of B blocks.
    streams : BlockStreams
        Random numbers of the blocks.
    log_density : callable
        See `LogDensity`.
    numbers : (B,) int array
        Numbers of the blocks.
    steps : int
        Number of steps; more are not possible.
    points_a_call, called
        As `weighed`.
    """

    def __init__(
        self,
        proposal: BlockProposal,
        streams: BlockStreams,
        log_density: LogDensity,
        numbers: IndexArray,
        steps: int,
        *,
        points_a_call: int = POINTS_A_CALL,
        called: Callable[[int], None] | None = None,
    ) -> None:
        self._proposal, self._streams, self._steps = proposal, streams, steps
        self._weighed = partial(weighed, log_density, proposal, numbers, points_a_call=points_a_call, called=called)
        self._step = 0
        #: Pareto shape of the ratios of posterior to proposal, (B,).
        self.pareto_k: FloatArray = np.full(proposal.n_blocks, np.nan)

    def propose(self, model: Any, state: Any) -> tuple[Any, BoolArray]:
        """Make one step; emcee calls this."""
        if self._step == 0:
            self._prepare(len(state.coords))
        s = self._step
        accepted = self._bars[s] > self._weight
        np.copyto(self._weight, self._weights[s], where=accepted)
        np.copyto(state.log_prob, self._log_probs[s], where=accepted)
        np.copyto(state.coords.T, self._points[s], where=accepted)
        self._step += 1
        self._accepted += accepted
        return state, accepted

    def acceptance(self) -> FloatArray:
        """Return the fraction of accepted proposals so far, (B,)."""
        return np.asarray(self._accepted.reshape(-1, self._proposal.n_blocks).mean(axis=0) / self._step)

    def _prepare(self, n_walkers: int) -> None:
        blocks, d, steps = self._proposal.n_blocks, self._proposal.dimension, self._steps
        walkers = n_walkers // blocks
        n = walkers * steps
        points = np.empty((steps, d, walkers, blocks))
        log_probs, weights, bars = (np.empty((steps, walkers, blocks)) for _ in range(3))
        for part, x, log_p, log_q in self._weighed(self._streams, n):

            def by_step(values: FloatArray) -> FloatArray:
                return values.reshape(-1, walkers, steps).T

            log_weights = log_p - log_q
            self.pareto_k[part] = pareto_shape(log_weights)
            for j in range(d):
                points[:, j, :, part] = by_step(x[..., j])
            log_probs[..., part], weights[..., part] = by_step(log_p), by_step(log_weights)
            # log u < new weight - old weight, where -log u is a standard exponential number.
            log_weights += self._streams.select(part).exponential(n)
            bars[..., part] = by_step(log_weights)
        self._points = points.reshape(steps, d, n_walkers)
        self._log_probs, self._weights, self._bars = (a.reshape(steps, n_walkers) for a in (log_probs, weights, bars))
        self._weight = np.full(n_walkers, -np.inf)
        self._accepted = np.zeros(n_walkers)


class _GroupMove(Move):  # type: ignore[misc]  # emcee has no types
    """Move the walkers of each ensemble: even walkers by the positions of the odd ones, then the reverse.

    Parameters
    ----------
    streams : BlockStreams
        Random numbers of the B blocks.
    log_density : callable
        Log density of points of the blocks.
    ensembles : int
        Number of independent ensembles in each block.
    """

    _AHEAD = 64  # number of steps for which random numbers are drawn at once

    def __init__(self, streams: BlockStreams, log_density: BlockDensity, ensembles: int) -> None:
        self._streams, self._log_density, self._ensembles = streams, log_density, ensembles
        self._numbers: FloatArray = np.empty((0, 0))
        self._step = 0

    def propose(self, model: Any, state: Any) -> tuple[Any, BoolArray]:
        """Make one step; emcee calls this."""
        n_walkers, d = state.coords.shape
        blocks = len(self._streams)
        shape = (blocks, self._ensembles, n_walkers // (blocks * self._ensembles))
        x, log_p = state.coords.reshape(*shape, d), state.log_prob.reshape(shape)
        accepted = np.zeros(shape, dtype=bool)
        numbers = self._next_numbers(shape[2] // 2)
        for half in (0, 1):
            mine, others = slice(half, None, 2), slice(1 - half, None, 2)
            u = numbers[:, half]
            proposed, log_factor = self._move(x[:, :, mine], x[:, :, others], u[..., 1:])
            new = self._log_density(proposed.reshape(blocks, -1, d)).reshape(log_p[:, :, mine].shape)
            better = new + log_factor - np.log1p(-u[..., 0]) > log_p[:, :, mine]
            np.copyto(x[:, :, mine], proposed, where=better[..., None])
            np.copyto(log_p[:, :, mine], new, where=better)
            accepted[:, :, mine] = better
        state.coords, state.log_prob = x.reshape(n_walkers, d), log_p.reshape(n_walkers)
        return state, accepted.reshape(n_walkers)

    def _next_numbers(self, half: int) -> FloatArray:
        """Uniform random numbers of one step, (B, 2, ensembles, half, 4)."""
        if self._step % self._AHEAD == 0:
            self._numbers = self._streams.uniform(self._AHEAD, 2, self._ensembles, half, 4)
        numbers = self._numbers[:, self._step % self._AHEAD]
        self._step += 1
        return np.asarray(numbers)

    def _move(self, x: FloatArray, others: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Proposals and the logarithm of their Hastings factor; u are three uniform random numbers per walker."""
        raise NotImplementedError


def _pick(others: FloatArray, index: NDArray[np.intp]) -> FloatArray:
    return np.take_along_axis(others, index[..., None], axis=2)


class GroupStretchMove(_GroupMove):
    """Stretch move (Goodman and Weare 2010, doi:10.2140/camcos.2010.5.65) within each ensemble, a = 2."""

    def _move(self, x: FloatArray, others: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        z = (1 + u[..., 0]) ** 2 / 2
        partner = _pick(others, (u[..., 1] * others.shape[2]).astype(np.intp))
        return partner + z[..., None] * (x - partner), (x.shape[-1] - 1) * np.log(z)


class GroupDifferenceMove(_GroupMove):
    """Differential evolution (ter Braak 2006, doi:10.1007/s11222-006-8769-1) within each ensemble.

    One step in ten uses the full difference between two walkers, which allows jumps between modes.
    """

    def _move(self, x: FloatArray, others: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        n, d = others.shape[2:]
        first = (u[..., 0] * n).astype(np.intp)
        second = (first + 1 + (u[..., 1] * (n - 1)).astype(np.intp)) % n
        # The length varies by ±20 %, so that walkers do not stay on a lattice.
        length = np.where(u[..., 2] < 0.1, 1.0, 2.38 / np.sqrt(2 * d) * (0.8 + 0.4 * (u[..., 2] - 0.1) / 0.9))
        return x + length[..., None] * (_pick(others, first) - _pick(others, second)), np.zeros(x.shape[:-1])
