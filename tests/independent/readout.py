"""Effects of the readout."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .effects import Effect
from .finger import Recording


def tanh_compression(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Readings bend over as tanh, `value` of the way at the peak."""
    return replace(r, signal=r.peak * np.tanh(value * r.signal / r.peak) / value)


def exponential_expansion(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Readings grow as an exponential: a capacitor whose gap closes."""
    return replace(r, signal=r.peak * np.expm1(value * r.signal / r.peak) / value)


def power_law(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Readings go as a power of the signal, 1 + `value`."""
    share = r.signal / r.peak
    return replace(r, signal=r.peak * np.sign(share) * np.abs(share) ** (1 + value))


def soft_saturation(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Readings level off, by an eighth-power mean, at a limit that the largest signal reaches `value` times."""
    limit = np.abs(r.signal).max() / value
    return replace(r, signal=r.signal / (1 + (np.abs(r.signal) / limit) ** 8) ** (1 / 8))


def random_walk(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Each zero walks at random; `value` is its share of the peak after an hour."""
    steps = np.sqrt(np.diff(r.time, prepend=0.0) / 3600)[:, None] * rng.standard_normal(r.signal.shape)
    return replace(r, signal=r.signal + value * r.peak * np.cumsum(steps, axis=0))


def warm_up(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The electronics warm up: each zero settles exponentially within 15 min, by a share of its own."""
    share = value * rng.uniform(-1, 1, len(r.peak))
    return replace(r, signal=r.signal + share * r.peak * np.exp(-r.time / 900)[:, None])


def exponential_gain(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """All gains fall towards a lower value within 20 min."""
    return replace(r, signal=r.signal * (1 + value * np.exp(-r.time / 1200))[:, None])


def swinging_gains(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The gain of every second element swings with the air conditioning, every quarter of an hour."""
    signal = r.signal.copy()
    signal[:, ::2] *= (1 + value * np.sin(2 * np.pi * r.time / 900 + rng.uniform(0, 2 * np.pi)))[:, None]
    return replace(r, signal=signal)


def logarithmic_creep(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Readings grow with the logarithm of the time held."""
    held = r.time - r.time[r.touch * r.n_samples]
    return replace(r, signal=r.signal * (1 + value * np.log1p(held / 0.3))[:, None])


def two_exponentials(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """What earlier touches left fades with 6 s and with 40 s."""
    last = r.signal[r.n_samples - 1 :: r.n_samples]
    end = r.time[r.n_samples - 1 :: r.n_samples]
    left = np.zeros_like(r.signal)
    for share, fade in ((0.6, 6.0), (0.4, 40.0)):
        kept = np.zeros((len(end), r.signal.shape[1]))
        for touch in range(1, len(end)):
            kept[touch] = (kept[touch - 1] + last[touch - 1]) * np.exp(-(end[touch] - end[touch - 1]) / fade)
        left += share * kept[r.touch] * np.exp((end[r.touch] - r.time) / fade)[:, None]
    return replace(r, signal=r.signal + value * left)


EFFECTS = (
    Effect(
        "gain_nonlinearity",
        "tanh",
        "after",
        0.5,
        2.0,
        tanh_compression,
        in_catalogue=False,
        reason="the catalogue has a power of the reading",
    ),
    Effect(
        "gain_nonlinearity",
        "exponential",
        "after",
        0.3,
        2.0,
        exponential_expansion,
        in_catalogue=False,
        reason="the catalogue has a power of the reading",
    ),
    Effect(
        "gain_nonlinearity",
        "power law",
        "after",
        0.1,
        0.6,
        power_law,
        in_catalogue=False,
        reason="the catalogue has the signal plus a power of it; this form is a power alone",
    ),
    Effect(
        "saturation",
        "soft",
        "after",
        1.0,
        4.0,
        soft_saturation,
        in_catalogue=True,
        reason="the catalogue's formula with `knee` 8 (a value that the search tries), one limit for all elements",
    ),
    Effect(
        "baseline_drift",
        "random walk",
        "after",
        0.02,
        0.2,
        random_walk,
        in_catalogue=False,
        reason="the catalogue's zeros wander smoothly",
    ),
    Effect(
        "baseline_drift",
        "warm-up",
        "after",
        0.05,
        0.5,
        warm_up,
        in_catalogue=True,
        reason="a smooth course, which the catalogue's random function of time follows",
    ),
    Effect(
        "gain_drift",
        "exponential",
        "after",
        0.1,
        0.8,
        exponential_gain,
        in_catalogue=True,
        reason="a smooth course, which the catalogue's random function of time follows",
    ),
    Effect(
        "gain_drift",
        "every second element",
        "after",
        0.05,
        0.9,
        swinging_gains,
        in_catalogue=True,
        reason="a smooth course for each element, which the catalogue's random functions of time follow",
    ),
    Effect(
        "creep",
        "logarithmic",
        "after",
        0.03,
        0.5,
        logarithmic_creep,
        in_catalogue=False,
        reason="the catalogue's creep is one exponential",
    ),
    Effect(
        "memory",
        "two exponentials",
        "after",
        0.1,
        0.4,
        two_exponentials,
        in_catalogue=False,
        reason="the catalogue has three exponentials about one time",
    ),
)
