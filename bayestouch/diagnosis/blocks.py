"""Blocks of touches that are held out together: neighbours in time, and neighbours in place."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import IntArray
from bayestouch.model.fitting import Fitted

# Number of folds; blocks are assigned to them in turn.
FOLDS = 8
# Number of touches in a block. Blocks are contiguous in time, so that no neighbour in place or time reveals what is
# held out.
BLOCK = 8
SCAN_BLOCKS = 30
# Number of blocks of places, shared among the coordinates, and the fewest from which a standard error is known.
PLACE_BLOCKS, LEAST_BLOCKS = 24, 6
# Distinct coordinates in a block: fewer would leave neighbours of every held-out place in the fit.
LEAST_PLACES = 3


def time_blocks(fitted: Fitted) -> IntArray:
    """Block of each touch, (t,): touches that are contiguous in time."""
    observed = fitted.model.known
    n_touches = observed.n_touches
    size = max(1, min(BLOCK, n_touches // (2 * FOLDS)))
    if fitted.model.time_is_place:
        # In a scan the place changes slowly: use blocks as long as those that are held out.
        size = max(2, n_touches // SCAN_BLOCKS)
    rank = np.empty(n_touches, dtype=np.int64)
    rank[np.argsort(observed.touch_time_s, kind="stable")] = np.arange(n_touches)
    return np.asarray(rank // size)


def place_blocks(fitted: Fitted) -> IntArray | None:
    """Block of places of each touch, (t,): intervals of each coordinate; None if the touches have too few places."""
    axes = fitted.model.poses(fitted.vector).place
    most = round(PLACE_BLOCKS ** (1 / len(axes)))
    block = np.zeros(fitted.model.known.n_touches, dtype=np.int64)
    for axis in axes:
        values, rank = np.unique(np.round(axis, 6), return_inverse=True)
        count = max(min(most, len(values) // LEAST_PLACES), 1)
        block = block * count + rank * count // len(values)
    return block if len(np.unique(block)) >= LEAST_BLOCKS else None
