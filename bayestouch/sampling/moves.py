"""Moves for emcee that advance the walkers of many independent posteriors in one step.

The walkers of one block do not interact with those of another block.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from emcee.moves import Move
from numpy.typing import NDArray

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.errors import InputError, shown
from bayestouch.sampling.density import POINTS_A_CALL
from bayestouch.sampling.pareto import pareto_shape, shape_that_counts
from bayestouch.sampling.proposals import BlockProposal, RenewableProposal
from bayestouch.sampling.streams import BlockStreams


def require_moves(moves: object) -> None:
    """Raise an error unless `emcee.EnsembleSampler` takes these moves: one, or a list, with weights or without.

    Raises
    ------
    InputError
        They are something else.
    """
    listed = moves if isinstance(moves, list | tuple) else [moves]
    alone = [each[0] if isinstance(each, tuple) and each else each for each in listed]
    if not alone or not all(isinstance(each, Move) for each in alone):
        expected = "a move of emcee, such as emcee.moves.StretchMove(), or a list of moves"
        raise InputError(f"moves: expected {expected}, got {shown(moves)}")


class IndependenceMove(Move):  # type: ignore[misc]  # emcee has no types
    """Independence move: each walker gets a point from the proposal of its block, which is accepted or rejected.

    Proposals do not depend on the state; therefore those of all steps are drawn at the first step, and the model that
    emcee passes to the move evaluates them in one call. Walkers are independent chains. Walker ``w B + b`` is the
    w-th walker of block b. The first step accepts any point of finite density, because a walker starts without a
    point (log density ``-inf``).

    Parameters
    ----------
    proposal : BlockProposal
        One distribution for each of B blocks.
    streams : BlockStreams
        Random numbers of the blocks.
    steps : int
        Number of steps; more are not possible.
    """

    def __init__(self, proposal: BlockProposal, streams: BlockStreams, steps: int) -> None:
        self._proposal, self._streams, self._steps = proposal, streams, steps
        self._step = 0
        #: Pareto shape of the ratios of posterior to proposal, (B,), see `shape_that_counts`.
        self.pareto_k: FloatArray = np.full(proposal.n_blocks, np.nan)

    def propose(self, model: Any, state: Any) -> tuple[Any, BoolArray]:
        """Make one step; emcee calls this."""
        n_walkers, d = state.coords.shape
        shape = n_walkers // self._proposal.n_blocks, self._proposal.n_blocks
        if self._step == 0:
            self._prepare(model, shape[0])
        s = self._step
        accepted = self._bars[:, s] > self._weight
        np.copyto(self._weight, self._weights[:, s], where=accepted)
        np.copyto(state.log_prob.reshape(shape), self._log_probs[:, s], where=accepted)
        coords = state.coords.T.reshape(d, *shape)
        np.copyto(coords, self._points[:, :, s], where=accepted)
        state.coords = coords.reshape(d, n_walkers).T
        self._step += 1
        self._accepted += accepted
        return state, accepted.reshape(n_walkers)

    def acceptance(self) -> FloatArray:
        """Return the fraction of accepted proposals so far, (B,)."""
        return np.asarray(self._accepted.mean(axis=0) / self._step)

    def _prepare(self, model: Any, walkers: int) -> None:
        blocks, d, steps = self._proposal.n_blocks, self._proposal.dimension, self._steps
        n = walkers * steps
        flat, log_q = np.empty((d, n, blocks)), np.empty((blocks, n))
        for part in self._parts(n):
            x, log_q[part] = self._proposal.select(np.arange(part.start, part.stop)).draw(self._streams.select(part), n)
            flat[:, :, part] = x.transpose(2, 1, 0)
        points = flat.reshape(d, walkers, steps, blocks)
        log_p = self._evaluate(model, points).reshape(n, blocks)
        weights, bars = np.empty((n, blocks)), np.empty((n, blocks))
        for part in self._parts(n):
            log_weights = log_p[:, part].T - log_q[part]
            self.pareto_k[part] = shape_that_counts(log_weights, pareto_shape(log_weights))
            weights[:, part] = log_weights.T
            # log u < new weight - old weight, where -log u is a standard exponential number.
            log_weights += self._streams.select(part).exponential(n)
            bars[:, part] = log_weights.T
        self._points = points
        self._log_probs, self._weights, self._bars = (a.reshape(walkers, steps, blocks) for a in (log_p, weights, bars))
        self._weight = np.full((walkers, blocks), -np.inf)
        self._accepted = np.zeros((walkers, blocks))

    def _evaluate(self, model: Any, points: FloatArray) -> FloatArray:
        """Log density of the proposals of all steps, (walkers * steps * B,), from points (d, walkers, steps, B)."""
        log_p, _ = model.compute_log_prob_fn(points.reshape(len(points), -1).T)
        return np.asarray(log_p)

    def _parts(self, n: int) -> Iterator[slice]:
        """Some blocks at a time, whose n points each stay in the cache."""
        some = max(1, POINTS_A_CALL // n)
        for first in range(0, self._proposal.n_blocks, some):
            yield slice(first, min(first + some, self._proposal.n_blocks))


class RenewalMove(Move):  # type: ignore[misc]  # emcee has no types
    """Move that draws a part of the coordinates anew from a proposal, given the others: a Metropolis-Hastings step.

    Parameters
    ----------
    proposal : RenewableProposal
        Distribution of one block.
    streams : BlockStreams
        Random numbers of the block.
    """

    def __init__(self, proposal: RenewableProposal, streams: BlockStreams) -> None:
        self._proposal, self._streams = proposal, streams

    def propose(self, model: Any, state: Any) -> tuple[Any, BoolArray]:
        """Make one step; emcee calls this."""
        x = state.coords[None]
        new = self._proposal.renewed(self._streams, x)
        log_p, _ = model.compute_log_prob_fn(new[0])
        # The ratio of the proposal's densities is that of drawing one from the other.
        before, after = (self._proposal.log_density(each)[0] for each in (x, new))
        accepted = np.asarray(log_p - after + self._streams.exponential(len(x[0]))[0] > state.log_prob - before)
        state.coords = np.where(accepted[:, None], new[0], state.coords)
        state.log_prob = np.where(accepted, log_p, state.log_prob)
        return state, accepted


class _GroupMove(Move):  # type: ignore[misc]  # emcee has no types
    """Move the walkers of each ensemble: even walkers by the positions of the odd ones, then the reverse.

    Parameters
    ----------
    streams : BlockStreams
        Random numbers of the B blocks.
    ensembles : int
        Number of independent ensembles in each block. Walker ``w B + b`` is the w-th walker of block b; walkers of the
        same ensemble follow each other.
    """

    _AHEAD = 64  # number of steps for which random numbers are drawn at once

    def __init__(self, streams: BlockStreams, ensembles: int) -> None:
        self._streams, self._ensembles = streams, ensembles
        self._numbers: FloatArray = np.empty((0, 0))
        self._step = 0

    def propose(self, model: Any, state: Any) -> tuple[Any, BoolArray]:
        """Make one step; emcee calls this."""
        n_walkers, d = state.coords.shape
        blocks = len(self._streams)
        shape = (self._ensembles, n_walkers // (blocks * self._ensembles), blocks)
        # (block, ensemble, member)
        x = state.coords.reshape(*shape, d).transpose(2, 0, 1, 3).copy()
        log_p = state.log_prob.reshape(shape).transpose(2, 0, 1).copy()
        accepted = np.zeros(log_p.shape, dtype=bool)
        numbers = self._next_numbers(shape[1] // 2)
        for half in (0, 1):
            mine, others = slice(half, None, 2), slice(1 - half, None, 2)
            u = numbers[:, half]
            proposed, log_factor = self._move(x[:, :, mine], x[:, :, others], u[..., 1:])
            new, _ = model.compute_log_prob_fn(proposed.transpose(1, 2, 0, 3).reshape(-1, d))
            new = new.reshape(shape[0], -1, blocks).transpose(2, 0, 1)
            better = new + log_factor - np.log1p(-u[..., 0]) > log_p[:, :, mine]
            np.copyto(x[:, :, mine], proposed, where=better[..., None])
            np.copyto(log_p[:, :, mine], new, where=better)
            accepted[:, :, mine] = better
        state.coords = x.transpose(1, 2, 0, 3).reshape(n_walkers, d)
        state.log_prob = log_p.transpose(1, 2, 0).reshape(n_walkers)
        return state, accepted.transpose(1, 2, 0).reshape(n_walkers)

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
