"""True loads of touches read with effects, from acting loads (see `bayestouch.pad.corrected`)."""

from __future__ import annotations

import numpy as np
from scipy.special import softmax

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.known_touches import prior_of_loads
from bayestouch.pad.reading.reader import PadReader
from bayestouch.sampling.pareto import systematic_resample
from bayestouch.sampling.streams import BlockStreams

# Purpose number of the random streams, see `BlockStreams`.
PURPOSE = 14


def true_load_prior(effects: PadEffects, acting: FloatArray) -> tuple[float, float]:
    """Mean and standard deviation (N) of true loads, see `prior_of_loads`, from the acting loads of a calibration."""
    return prior_of_loads(effects.pressing(acting[np.isfinite(acting)]))


def with_true_loads(
    posterior: dict[str, FloatArray],
    effects: PadEffects,
    reader: PadReader,
    calibrated: FloatArray,
    measured: FloatArray,
    numbers: IntArray,
    seed: int,
) -> dict[str, FloatArray]:
    """Draws with true loads, for a prior that is normal in the true load.

    The prior of the sampler is normal in the acting load. Where the acting load levels off, true loads far above those
    of the calibration would have the same acting load. Draws of touches without a measured load are therefore resampled
    with weights for a prior that is normal in the true load (sampling importance resampling).

    Parameters
    ----------
    posterior : dict of (chain, draw, t) arrays
        Draws by name; ``P`` is the acting load.
    effects, reader
        Effects and reader of the calibration.
    calibrated : (n,) array
        Acting loads of the calibration, N.
    measured : (t,) array
        Acting loads of the touches, N; NaN not measured.
    numbers : (t,) int array
        Number of touches before each in the table. The random numbers of a touch depend only on it and on the seed.
    seed : int
        Seed of the resampling.
    """
    acting = posterior["P"]
    out = {**posterior, "P": effects.pressing(acting)}
    if not reader.load_measured:
        return out
    mean, sd = true_load_prior(effects, calibrated)
    log = np.log(np.maximum(effects.pressing_slope(acting), 1e-300)) - 0.5 * ((out["P"] - mean) / sd) ** 2
    log = log + 0.5 * ((acting - reader.load) / reader.load_sd) ** 2
    shape, unknown = acting.shape[:2], np.flatnonzero(np.isnan(measured))
    streams = BlockStreams(seed, numbers[unknown], PURPOSE)
    weights = softmax(np.moveaxis(log[..., unknown], -1, 0).reshape(len(unknown), acting[..., 0].size), axis=1)
    for t, chosen in zip(unknown, systematic_resample(weights, weights.shape[1], streams.uniform(1)), strict=True):
        for draws in out.values():
            draws[..., t] = draws[..., t].ravel()[chosen].reshape(shape)
    return out
