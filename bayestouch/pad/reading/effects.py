"""True loads of touches read with effects, from acting loads (see `bayestouch.pad.corrected`)."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.reading.reader import PadReader


def true_load_prior(effects: PadEffects, acting: FloatArray) -> tuple[float, float]:
    """Mean and standard deviation (N) of the true loads of a calibration, from its acting loads."""
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
    rng = np.random.default_rng([seed, 5])
    shape = acting.shape[:2]
    for t in np.flatnonzero(np.isnan(measured)):
        weight = np.exp(log[..., t] - log[..., t].max()).ravel()
        chosen = rng.choice(weight.size, weight.size, p=weight / weight.sum())
        for draws in out.values():
            draws[..., t] = draws[..., t].ravel()[chosen].reshape(shape)
    return out
