"""Acting loads of touches on a pad, from the loads that its elements felt (see `PadTouches`)."""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr

from bayestouch.array_types import FloatArray, FloatOrArray, IntArray
from bayestouch.pad.reading.reader import PadTouches
from bayestouch.sampling.bounds import normal_between
from bayestouch.sampling.streams import BlockStreams

# Purpose number of the random streams, see `BlockStreams`.
PURPOSE = 8
# Mean over sd from which nothing is cut off at zero: the probability below it is 1e-9.
NEAR = 6.0


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
        Number of touches before each in the table. The random numbers of a touch depend only on it and on the seed.
    seed : int
        Seed of the run.
    """
    if touches.load_scatter == 0:
        return felt
    kept, sd = acting_given_felt(touches.load_sd, touches.load_scatter)
    streams = BlockStreams(seed, numbers, PURPOSE)
    standard = np.moveaxis(streams.normal(*felt.shape[:2]), 0, -1)
    mean = touches.load + kept * (felt - touches.load)
    acting = np.asarray(mean + sd * standard)
    # No load is below zero: near it the distribution is cut off there.
    near = mean < NEAR * sd
    if near.any():
        sd = np.broadcast_to(sd, mean.shape)[near]
        bound = -mean[near] / sd
        acting[near] = mean[near] + sd * normal_between(standard[near], bound, np.full(bound.shape, np.inf))[0]
    return acting


def cut_at_zero(mean: FloatArray, sd: FloatOrArray) -> tuple[FloatArray, FloatArray]:
    """Mean and variance of normal distributions that are cut off below zero, from mean (...) and sd before."""
    variance = np.broadcast_to(np.asarray(sd) ** 2, mean.shape)
    near = mean < NEAR * sd
    if not near.any():
        return mean, variance
    mean, variance = mean.copy(), variance.copy()
    z = mean[near] / np.sqrt(variance[near])
    # Density over the probability above zero, as logarithms: far below zero both are too small for a number.
    ratio = np.exp(-0.5 * z * z - 0.5 * np.log(2 * np.pi) - log_ndtr(z))
    mean[near] += np.sqrt(variance[near]) * ratio
    variance[near] *= np.maximum(1 - ratio * (ratio + z), 0.0)
    return mean, variance
