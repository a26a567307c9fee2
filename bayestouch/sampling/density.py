"""Log densities of many blocks, called in pieces of bounded size."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.sampling.proposals import BlockProposal
from bayestouch.sampling.streams import BlockStreams

# Log density of points x (B, n, d) of the blocks numbered (B,): (B, n), -inf outside the support, never NaN.
LogDensity = Callable[[FloatArray, IndexArray], FloatArray]
# The same for blocks that are fixed, (B, n, d) -> (B, n).
BlockDensity = Callable[[FloatArray], FloatArray]

#: Most points in one call of a log density: bounds its memory, and suits the cache.
POINTS_A_CALL = 1 << 13


def of_blocks(
    log_density: LogDensity,
    numbers: IndexArray,
    *,
    points_a_call: int = POINTS_A_CALL,
    called: Callable[[int], None] | None = None,
) -> BlockDensity:
    """Log density of all points of the blocks `numbers`, whatever their number.

    Parameters
    ----------
    log_density : callable
        See `LogDensity`.
    numbers : (B,) int array
        Which blocks.
    points_a_call : int
        Most points in one call.
    called : callable, optional
        Told the number of points after each call.

    Raises
    ------
    ValueError
        From the function returned: the log density is NaN at some point, or has the wrong shape.
    """

    def evaluate(x: FloatArray) -> FloatArray:
        values = np.empty(x.shape[:2])
        for rows, columns in _pieces(x.shape[0], x.shape[1], points_a_call):
            piece = log_density(x[rows, columns], numbers[rows])
            if np.shape(piece) != values[rows, columns].shape:
                raise ValueError(f"log density: expected {values[rows, columns].shape}, got {np.shape(piece)}")
            values[rows, columns] = piece
            if called is not None:
                called(piece.size)
        if np.isnan(values.min(initial=0.0)):  # the least value is NaN where any is
            block, point = np.argwhere(np.isnan(values))[0]
            raise ValueError(f"log density is NaN in block {numbers[block]} at {x[block, point]}")
        return values

    return evaluate


def weighed(
    log_density: LogDensity,
    proposal: BlockProposal,
    numbers: IndexArray,
    streams: BlockStreams,
    n: int,
    *,
    points_a_call: int = POINTS_A_CALL,
    called: Callable[[int], None] | None = None,
) -> Iterator[tuple[slice, FloatArray, FloatArray, FloatArray]]:
    """Draw n points of each proposal and evaluate both densities, some blocks at a time.

    All that is done to a point is done while it is in the cache, which is three times as quick as one thing after the
    other for all points.

    Parameters
    ----------
    log_density, numbers, points_a_call, called
        As `of_blocks`.
    proposal, streams
        Of the blocks, in their order.
    n : int
        Points a block.

    Yields
    ------
    slice, (b, n, d) array, (b, n) array, (b, n) array
        Which blocks, their points, log density and log density of the proposal.
    """
    some = max(1, points_a_call // max(n, 1))
    for first in range(0, proposal.n_blocks, some):
        part = slice(first, min(first + some, proposal.n_blocks))
        density = of_blocks(log_density, numbers[part], points_a_call=points_a_call, called=called)
        x, log_q = proposal.select(np.arange(part.start, part.stop)).draw(streams.select(part), n)
        yield part, x, density(x), log_q


def _pieces(n_blocks: int, n: int, points: int) -> Iterator[tuple[slice, slice]]:
    """Whole blocks while one fits, parts of a block where not."""
    some, step = max(1, points // max(n, 1)), min(n, points)
    for first in range(0, n_blocks, some):
        for start in range(0, n, max(step, 1)):
            yield slice(first, first + some), slice(start, start + step)
