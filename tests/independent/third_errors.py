"""Forms of the noise in the third blind study. `value` is near the sd that they add, in units of the plain noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_readout import _relaxing
from .effects import Effect
from .finger import Recording


def noisy_reference(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The voltage reference of the converter flickers: all elements share noise with times of 0.3, 1.5 and 7.5 s.

    The sum of three processes of equal variance, `value` times the plain noise in all. Band-gap references have 1/f
    noise (Horowitz and Hill, The Art of Electronics, 2015, chapter 9).
    """
    shared = sum(_relaxing(r.time, each, 1, rng) for each in (0.3, 1.5, 7.5))
    return replace(r, error=r.error + value * r.noise_sd * np.asarray(shared) / np.sqrt(3))


def uneven_loops(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Wires make loops that face different ways, in a magnetic field whose direction changes from sample to sample.

    Loops face from -60° to 60°, in random order; element e gets a cos φ_e + b sin φ_e, a and b normal, so that each has
    the sd `value` times the plain noise. Faraday's law (Ott, Electromagnetic Compatibility Engineering, 2009).
    """
    face = np.radians(rng.permutation(np.linspace(-60, 60, len(r.peak))))
    field = rng.standard_normal((len(r.time), 2))
    return replace(r, error=r.error + value * r.noise_sd * field @ np.stack([np.cos(face), np.sin(face)]))


def binomial(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Contacts are open or closed by chance: noise is most at half of the peak and none at both ends.

    sd 4 √(x (1 - x)), x = |y|/peak, at most 1, times `value` and the plain noise. The binomial law of a number of
    contacts that close independently.
    """
    x = np.clip(np.abs(r.signal) / r.peak, 0, 1)
    sd = 4 * np.sqrt(x * (1 - x))
    return replace(r, error=r.error + value * r.noise_sd * sd * rng.standard_normal(r.signal.shape))


def slow_resistance_noise(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The resistance of each element fluctuates slowly: an error in proportion to the signal, of one kind for 0.6 s.

    sd 4 x, x = |y|/peak, times `value` and the plain noise, with exponential correlation in time. Noise of resistors
    goes with what drives them (Hooge, 1994, doi:10.1109/16.333808).
    """
    x = np.abs(r.signal) / r.peak
    course = _relaxing(r.time, 0.6, len(r.peak), rng)
    return replace(r, error=r.error + value * r.noise_sd * 4 * x * course)


def late_packets(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Each element has a converter of its own on a bus, and some packets are late: they hold the touch before.

    A share 0.03 n² of the first readings of touches, n the next integer above `value`; they take `value`/n of the
    difference from the last reading of the touch before. Retries of a serial bus do this.
    """
    n = np.ceil(value)
    last = r.signal[r.n_samples - 1 :: r.n_samples]
    before = np.concatenate([last[:1], last[:-1]])
    late = (rng.random(last.shape) < 0.03 * n**2)[r.touch] & (r.sample == 0)[:, None]
    return replace(r, error=r.error + late * (before[r.touch] - r.signal) * value / n)


def rail_hits(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A bond wire opens for a moment, and the input floats up to the rail, which is at 1.3 times the peak.

    A share 0.001 n² of the readings, n the next integer above `value`; they go `value`/n of the way to the rail. All
    errors go up, most those of small readings.
    """
    n = np.ceil(value)
    hit = rng.random(r.signal.shape) < 0.001 * n**2
    return replace(r, error=r.error + hit * (1.3 * r.peak - r.signal) * value / n)


EFFECTS = (
    Effect("common_mode_noise", "reference", "error", 1.0, 10.0, noisy_reference),
    Effect("common_mode_noise", "uneven loops", "error", 1.0, 10.0, uneven_loops),
    Effect("signal_dependent_noise", "binomial", "error", 1.0, 10.0, binomial),
    Effect("signal_dependent_noise", "slow resistance", "error", 1.0, 10.0, slow_resistance_noise),
    Effect("outliers", "late packets", "error", 1.0, 4.0, late_packets),
    Effect("outliers", "rail hits", "error", 1.0, 6.0, rail_hits),
)
