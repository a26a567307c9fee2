"""Evaluation of log densities of many blocks, with a limited number of points per call."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.sampling.proposals import BlockProposal
from bayestouch.sampling.streams import BlockStreams

# Function of points x (B, n, d) and block numbers (B,): log density (B, n), -inf outside the support, never NaN.
LogDensity = Callable[[FloatArray, IndexArray], FloatArray]
# The same for fixed blocks, (B, n, d) -> (B, n).
BlockDensity = Callable[[FloatArray], FloatArray]
# The same for walkers of all blocks, (n B, d) -> (n B,); walker i belongs to block i % B.
WalkerDensity = Callable[[FloatArray], FloatArray]

#: Maximum number of points in one call of a log density; limits the memory and suits the cache.
POINTS_A_CALL = 1 << 13


def of_blocks(
    log_density: LogDensity,
    numbers: IndexArray,
    *,
    points_a_call: int = POINTS_A_CALL,
    called: Callable[[int], None] | None = None,
) -> BlockDensity:
    """Return the log density of the blocks `numbers` as a function of any number of points.

    Parameters
    ----------
    log_density : callable
        See `LogDensity`.
    numbers : (B,) int array
        Numbers of the blocks.
    points_a_call : int
        Maximum number of points in one call.
    called : callable, optional
        Called with the number of points after each evaluation.

    Raises
    ------
    ValueError
        Raised by the returned function: the log density is NaN at some point, or has the wrong shape.
    """

    def evaluate(x: FloatArray) -> FloatArray:
        values = np.empty(x.shape[:2])
        for rows, columns in _pieces(x.shape[0], x.shape[1], points_a_call):
            # Each coordinate is contiguous in memory, which a likelihood needs to be fast.
            points = np.ascontiguousarray(np.swapaxes(x[rows, columns], 1, 2))
            piece = log_density(np.swapaxes(points, 1, 2), numbers[rows])
            if np.shape(piece) != values[rows, columns].shape:
                raise ValueError(f"log density: expected {values[rows, columns].shape}, got {np.shape(piece)}")
            values[rows, columns] = piece
            if called is not None:
                called(piece.size)
        if np.isnan(values.min(initial=0.0)):  # the minimum is NaN if any value is
            block, point = np.argwhere(np.isnan(values))[0]
            raise ValueError(f"log density is NaN in block {numbers[block]} at {x[block, point]}")
        return values

    return evaluate


def by_walker(density: BlockDensity, blocks: int) -> WalkerDensity:
    """Return a density of blocks as the density of walkers, as emcee wants it.

    Parameters
    ----------
    density : callable
        Of points (B, n, d).
    blocks : int
        Number of blocks B.

    Returns
    -------
    callable
        Log density (n B,) of points (n B, d); point ``i`` belongs to block ``i % B``.
    """

    def evaluate(x: FloatArray) -> FloatArray:
        points = x.T.reshape(x.shape[1], -1, blocks)
        return density(points.transpose(2, 1, 0)).T.reshape(-1)

    return evaluate


def weighed(
    log_density: LogDensity,
    proposal: BlockProposal,
    numbers: IndexArray,
    streams: BlockStreams,
    n: int,
) -> Iterator[tuple[slice, FloatArray, FloatArray, FloatArray]]:
    """Yield n points of each proposal with both log densities, some blocks at a time.

    All steps for a point are done while it is in the cache, which is three times as fast as each step for all points.

    Parameters
    ----------
    log_density, numbers
        As `of_blocks`.
    proposal, streams
        Proposal and random numbers of the blocks, in their order.
    n : int
        Number of points per block.

    Yields
    ------
    slice, (b, n, d) array, (b, n) array, (b, n) array
        Slice of the blocks, their points, log density and log density of the proposal.
    """
    some = max(1, POINTS_A_CALL // max(n, 1))
    for first in range(0, proposal.n_blocks, some):
        part = slice(first, min(first + some, proposal.n_blocks))
        density = of_blocks(log_density, numbers[part])
        x, log_q = proposal.select(np.arange(part.start, part.stop)).draw(streams.select(part), n)
        yield part, x, density(x), log_q


def _pieces(n_blocks: int, n: int, points: int) -> Iterator[tuple[slice, slice]]:
    """Yield slices of blocks and points: several whole blocks, or parts of a block that is too large."""
    some, step = max(1, points // max(n, 1)), min(n, points)
    for first in range(0, n_blocks, some):
        for start in range(0, n, max(step, 1)):
            yield slice(first, first + some), slice(start, start + step)
