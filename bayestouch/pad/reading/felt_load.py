"""Acting loads of touches on a pad, from the loads that its elements felt (see `PadTouches`)."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray, FloatOrArray, IntArray
from bayestouch.pad.reading.reader import PadTouches
from bayestouch.sampling.streams import BlockStreams

# Purpose number of the random streams, see `BlockStreams`.
PURPOSE = 8


def acting_given_felt(load_sd: FloatOrArray, load_scatter: float) -> tuple[FloatOrArray, FloatOrArray]:
    """Share ``kept`` and sd of an acting load given the felt load f: its mean is ``load + kept (f - load)``.

    Its prior is normal with the mean ``load`` and the standard deviation `load_sd`.
    """
    kept = load_sd**2 / (load_sd**2 + load_scatter**2)
    return kept, load_scatter * kept**0.5


def acting_loads(felt: FloatArray, touches: PadTouches, numbers: IntArray, seed: int) -> FloatArray:
    """Draws (chain, draw, t) of acting loads from draws of felt loads, which are independent of all else.

    Parameters
    ----------
    felt : (chain, draw, t) array
        Draws of the felt loads.
    touches : PadTouches
        The touches, with the priors of their loads.
    numbers : (t,) int array
        Numbers of the touches. The random numbers of a touch depend only on its number and on the seed.
    seed : int
        Seed of the run.
    """
    if touches.load_scatter == 0:
        return felt
    kept, sd = acting_given_felt(touches.load_sd, touches.load_scatter)
    # Numbers in a table may be negative, those of streams may not.
    streams = BlockStreams(seed, numbers.astype(np.uint64), PURPOSE)
    standard = np.moveaxis(streams.normal(*felt.shape[:2]), 0, -1)
    # No load is below zero.
    return np.abs(touches.load + kept * (felt - touches.load) + sd * standard)
