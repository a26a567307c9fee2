"""Effects of the noise. `value` is near the standard deviation that they add, in units of the plain noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from .effects import Effect
from .finger import Recording


def autoregressive_common_mode(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """All elements share an error that half survives to the next sample."""
    shared = lfilter([np.sqrt(1 - 0.25)], [1, -0.5], rng.standard_normal(len(r.time)))
    return replace(r, error=r.error + value * r.noise_sd * np.asarray(shared)[:, None])


def root_of_signal(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """An error that grows with the square root of the signal, not in proportion."""
    size = 3 * np.sqrt(np.abs(r.signal) / r.peak)
    return replace(r, error=r.error + value * r.noise_sd * size * rng.standard_normal(r.signal.shape))


def contaminated(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """One reading in a hundred is off, with a Student's t of 3 degrees of freedom."""
    wrong = rng.random(r.signal.shape) < 0.01
    return replace(r, error=r.error + wrong * value * 6 * r.noise_sd * rng.standard_t(3, r.signal.shape))


def rare(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A few readings, more of them the larger `value`, are off by ten times the noise."""
    wrong = rng.random(r.signal.shape) < 0.01 * value**2
    return replace(r, error=r.error + wrong * 10 * r.noise_sd * rng.standard_normal(r.signal.shape))


EFFECTS = (
    Effect(
        "common_mode_noise",
        "autoregressive",
        "error",
        1.0,
        10.0,
        autoregressive_common_mode,
        in_catalogue=False,
        reason="the catalogue's shared error is new in every sample",
    ),
    Effect(
        "signal_dependent_noise",
        "square root",
        "error",
        1.0,
        10.0,
        root_of_signal,
        in_catalogue=True,
        reason="the catalogue's power of the signal at 0.5, one of its probe values; only sizes by element differ",
    ),
    Effect(
        "outliers",
        "Student",
        "error",
        1.0,
        10.0,
        contaminated,
        in_catalogue=False,
        reason="the catalogue's wrong readings are normal",
    ),
    Effect(
        "outliers",
        "rare",
        "error",
        1.0,
        10.0,
        rare,
        in_catalogue=True,
        reason="two normal distributions, as in the catalogue; only sizes by element differ",
    ),
)
