"""Blind forms of the noise. `value` is near the standard deviation that they add, in units of the plain noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .effects import Effect
from .finger import Recording


def mains_hum(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """All elements share a sine of the mains, of a new phase in every touch; aliased to 1.3 Hz, and its third harmonic.

    Ott, Electromagnetic Compatibility Engineering (2009), on ground loops.
    """
    phase = rng.uniform(0, 2 * np.pi, len(r.tip))[r.touch]
    turn = 2 * np.pi * 1.3 * r.time + phase
    hum = np.sqrt(2) * (np.sin(turn) + 0.4 * np.sin(3 * turn)) / np.sqrt(1.16)
    return replace(r, error=r.error + value * r.noise_sd * hum[:, None])


def supply_spikes(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A switching supply disturbs all elements at once, Laplace-distributed, by gains from 0.5 to 1.5."""
    gain = rng.permutation(np.linspace(0.5, 1.5, len(r.peak)))
    spikes = rng.laplace(scale=np.sqrt(0.5), size=len(r.time))
    return replace(r, error=r.error + value * r.noise_sd * np.outer(spikes, gain))


def hopping(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Contacts in conductive rubber: noise that grows with the signal and levels off, sd 3 x/(0.3 + x), x = |y|/peak.

    Number fluctuations that saturate when all paths are closed (Hooge, 1994, doi:10.1109/16.333808).
    """
    x = np.abs(r.signal) / r.peak
    sd = 3 * x / (0.3 + x)
    return replace(r, error=r.error + value * r.noise_sd * sd * rng.standard_normal(r.signal.shape))


def coarse_range(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """An amplifier with two ranges: above 30 % of the peak the coarse one adds noise of equal steps, uniform."""
    steps = np.sqrt(12) * rng.uniform(-0.5, 0.5, r.signal.shape)
    return replace(r, error=r.error + 3 * value * r.noise_sd * np.where(np.abs(r.signal) > 0.3 * r.peak, steps, 0.0))


def dropouts(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A plug loses contact: now and then a reading falls to a value between 0 and its own, so that errors go one way.

    A share 0.004 n² of the readings, n the next integer above `value`; they lose up to `value`/n of themselves.
    """
    n = np.ceil(value)
    lost = rng.random(r.signal.shape) < 0.004 * n**2
    return replace(r, error=r.error - lost * r.signal * rng.uniform(0.2, 1.0, r.signal.shape) * value / n)


def lost_bits(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A bit is lost: one reading in 150 is off by 2, 4, 8, or 16 times `value` and the noise, up or down."""
    wrong = rng.random(r.signal.shape) < 1 / 150
    bit = 2.0 ** rng.integers(1, 5, r.signal.shape) * rng.choice([-1, 1], r.signal.shape)
    return replace(r, error=r.error + wrong * value * r.noise_sd * bit)


EFFECTS = (
    Effect("common_mode_noise", "mains hum", "error", 1.0, 10.0, mains_hum),
    Effect("common_mode_noise", "supply spikes", "error", 1.0, 10.0, supply_spikes),
    Effect("signal_dependent_noise", "hopping", "error", 1.0, 10.0, hopping),
    Effect("signal_dependent_noise", "coarse range", "error", 1.0, 10.0, coarse_range),
    Effect("outliers", "dropouts", "error", 1.0, 6.0, dropouts),
    Effect("outliers", "lost bits", "error", 1.0, 10.0, lost_bits),
)
