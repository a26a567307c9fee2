"""Forms of the noise in the second blind study. `value` is near the sd that they add, in units of the plain noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .effects import Effect
from .finger import Recording


def motor_runs(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A motor beside the rig runs during a third of the touches: then all elements share a normal error.

    `value` is its sd over all touches, in units of the plain noise. Radiated interference comes and goes with its
    source (Ott, Electromagnetic Compatibility Engineering, 2009).
    """
    runs = np.sqrt(3) * (rng.random(len(r.tip)) < 1 / 3)[r.touch]
    shared = rng.standard_normal(len(r.time)) * runs
    return replace(r, error=r.error + value * r.noise_sd * shared[:, None])


def two_boards(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are read by two boards with a supply each: one half shares an error of sd 0.6, the other of sd 1.3.

    Both times `value` and the plain noise; the boards share 30 % of the variance by the ground between them.
    """
    m = len(r.peak)
    own, ground = rng.standard_normal((len(r.time), 2)), rng.standard_normal((len(r.time), 1))
    boards = (np.sqrt(0.7) * own + np.sqrt(0.3) * ground) * [0.6, 1.3]
    return replace(r, error=r.error + value * r.noise_sd * boards[:, np.arange(m) * 2 // m])


def avalanches(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Conducting paths in filled rubber break in groups: Laplace noise of sd 3 x², x = |y|/peak, at strong signals.

    `value` times that and the plain noise. Crackling noise of fractured networks (Sethna, Dahmen and Myers, 2001,
    doi:10.1038/35065675).
    """
    x = np.abs(r.signal) / r.peak
    crackle = rng.laplace(scale=np.sqrt(0.5), size=r.signal.shape)
    return replace(r, error=r.error + value * r.noise_sd * 3 * x**2 * crackle)


def light_and_lamp(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """An optical element: shot noise of its light, variance 2 x, and flicker of its own lamp, variance (2 x)².

    x = |y|/peak, the sum of both times `value` and the plain noise. Schottky's formula, beside intensity noise in
    proportion to the light.
    """
    x = np.abs(r.signal) / r.peak
    sd = np.sqrt(2 * x + (2 * x) ** 2)
    return replace(r, error=r.error + value * r.noise_sd * sd * rng.standard_normal(r.signal.shape))


def wrong_address(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The multiplexer now and then takes the channel that follows: a reading goes towards that of its neighbour.

    A share 0.004 n² of the readings, n the next integer above `value`; they take `value`/n of the difference. Address
    lines that change while the converter still samples do this.
    """
    n = np.ceil(value)
    wrong = rng.random(r.signal.shape) < 0.004 * n**2
    other = np.roll(r.signal, -1, axis=1)
    return replace(r, error=r.error + wrong * (other - r.signal) * value / n)


def discharges(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The rig discharges now and then: one sample in 120 is off in half of its elements, by exponential amounts.

    The mean amount is 8 times `value` and the plain noise; the sign is that of the discharge, the same in all of these
    elements (IEC 61000-4-2 describes the pulse).
    """
    hit = (rng.random(len(r.time)) < 1 / 120) * rng.choice([-1.0, 1.0], len(r.time))
    half = rng.random(r.signal.shape) < 0.5
    amount = rng.exponential(8 * r.noise_sd, r.signal.shape)
    return replace(r, error=r.error + value * hit[:, None] * half * amount)


EFFECTS = (
    Effect("common_mode_noise", "motor runs", "error", 1.0, 10.0, motor_runs),
    Effect("common_mode_noise", "two boards", "error", 1.0, 10.0, two_boards),
    Effect("signal_dependent_noise", "avalanches", "error", 1.0, 10.0, avalanches),
    Effect("signal_dependent_noise", "light and lamp", "error", 1.0, 10.0, light_and_lamp),
    Effect("outliers", "wrong address", "error", 1.0, 6.0, wrong_address),
    Effect("outliers", "discharges", "error", 1.0, 10.0, discharges),
)
