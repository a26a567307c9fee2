"""Forms of the noise in the fourth blind study. `value` is near the sd that they add, in units of the plain noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_readout import held
from .effects import Effect
from .finger import Recording


def noisy_excitation(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The voltage that drives all elements is noisy: they share a normal error, larger where an element reads more.

    (0.6 + 2 x) times `value` and the plain noise, x = y/peak: a part that goes with the reading, and one with the
    element's resistance at rest. A bridge multiplies its excitation (Doebelin, Measurement Systems, 2003).
    """
    size = 0.6 + 2 * r.signal / r.peak
    return replace(r, error=r.error + value * r.noise_sd * size * rng.standard_normal(len(r.time))[:, None])


def hum_along_the_scan(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """All wires pick up hum, and channels are read one after the other, each at a later phase of it.

    √2 sin(ψ + 0.35 e), ψ any, anew in each sample, e the number of the channel, times `value` and the plain noise: the
    first and the last channel may differ in sign. Mains pick-up without synchronous sampling.
    """
    turn = rng.uniform(-np.pi, np.pi, len(r.time))[:, None] + 0.35 * np.arange(len(r.peak))
    return replace(r, error=r.error + value * r.noise_sd * np.sqrt(2) * np.sin(turn))


def multiplication(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Detectors multiply their carriers, and noise grows out of all proportion with the signal: sd exp(2.5 x) - 1.

    x = |y|/peak, at most 1.2, times `value` and the plain noise. Excess noise of avalanche multiplication (McIntyre,
    1966, doi:10.1109/T-ED.1966.15651).
    """
    x = np.minimum(np.abs(r.signal) / r.peak, 1.2)
    return replace(r, error=r.error + value * r.noise_sd * np.expm1(2.5 * x) * rng.standard_normal(r.signal.shape))


def settling_contacts(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Contacts between particles shift as rubber is strained, and come to rest while the touch is held.

    sd 6 x (0.2 + 0.8 exp(-t/0.3 s)) times a strength of each element, from 0.5 to 1.5, `value` and the plain noise;
    x = |y|/peak, t the time since the touch began.
    """
    strength = rng.permutation(np.linspace(0.5, 1.5, len(r.peak)))
    sd = 6 * np.abs(r.signal) / r.peak * strength * (0.2 + 0.8 * np.exp(-held(r) / 0.3))[:, None]
    return replace(r, error=r.error + value * r.noise_sd * sd * rng.standard_normal(r.signal.shape))


def flipped_sign(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The bit of the sign is read wrongly now and then: a reading goes towards its opposite.

    A share 0.002 n² of the readings, n the next integer above `value`; they take `value`/n of the way from y to -y.
    Errors on a serial line.
    """
    n = np.ceil(value)
    wrong = rng.random(r.signal.shape) < 0.002 * n**2
    return replace(r, error=r.error - 2 * wrong * r.signal * value / n)


def bursts(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Charge jumps onto one wire in the course of a touch, and leaks away: its next samples are off, too.

    It meets one element in one touch out of 60, from a random sample on, by normal amounts of sd 15 times `value` and
    the plain noise; each sample keeps 60 % of the one before. Touches begin anew.
    """
    shape = len(r.tip), len(r.peak)
    amount = (rng.random(shape) < 1 / 60) * rng.standard_normal(shape)
    since = r.sample[:, None] - rng.integers(0, r.n_samples, shape)[r.touch]
    left = np.where(since >= 0, 0.6 ** np.maximum(since, 0), 0.0)
    return replace(r, error=r.error + 15 * value * r.noise_sd * amount[r.touch] * left)


EFFECTS = (
    Effect("common_mode_noise", "excitation", "error", 1.0, 10.0, noisy_excitation),
    Effect("common_mode_noise", "hum along the scan", "error", 1.0, 10.0, hum_along_the_scan),
    Effect("signal_dependent_noise", "multiplication", "error", 1.0, 10.0, multiplication),
    Effect("signal_dependent_noise", "settling contacts", "error", 1.0, 10.0, settling_contacts),
    Effect("outliers", "flipped sign", "error", 1.0, 6.0, flipped_sign),
    Effect("outliers", "bursts", "error", 1.0, 10.0, bursts),
)
