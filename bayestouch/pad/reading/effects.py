"""Loads of touches that a calibration with effects has read: from loads as they act to true loads."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.reading.reader import PadReader


def true_load_prior(effects: PadEffects, acting: FloatArray) -> tuple[float, float]:
    """Mean and standard deviation of a calibration's true loads, from its loads as they act."""
    load = effects.pressing(acting[np.isfinite(acting)])
    return float(load.mean()), float(load.std())


def with_true_loads(
    posterior: dict[str, FloatArray],
    effects: PadEffects,
    reader: PadReader,
    calibrated: FloatArray,
    measured: FloatArray,
    seed: int,
) -> dict[str, FloatArray]:
    """Draws with true loads, under a prior that is normal in the true load.

    The sampler's prior is normal in the load as it acts. Where that flattens out, loads far beyond all that was ever
    pressed act like those that were: draws of touches without a measured load are drawn again by their weight under a
    prior that is normal in the load itself (sampling, importance resampling).

    Parameters
    ----------
    posterior : dict of (chain, draw, t) arrays
        Draws by name, ``P`` as it acts.
    effects, reader
        Of the calibration.
    calibrated : (n,) array
        Its loads as they act.
    measured : (t,) array
        Loads of the touches as they act; NaN not measured.
    seed : int
    """
    acting = posterior["P"]
    out = {**posterior, "P": effects.pressing(acting)}
    if not reader.load_measured:
        return out
    mean, sd = true_load_prior(effects, calibrated)
    log = np.log(np.maximum(effects.pressing_slope(acting), 1e-300)) - 0.5 * ((out["P"] - mean) / sd) ** 2
    log = log + 0.5 * ((acting - reader.load) / reader.load_sd) ** 2
    rng = np.random.default_rng([seed, 5])
    shape = acting.shape[:2]
    for t in np.flatnonzero(np.isnan(measured)):
        weight = np.exp(log[..., t] - log[..., t].max()).ravel()
        chosen = rng.choice(weight.size, weight.size, p=weight / weight.sum())
        for draws in out.values():
            draws[..., t] = draws[..., t].ravel()[chosen].reshape(shape)
    return out
