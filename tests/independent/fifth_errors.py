"""Forms of the noise in the fifth blind study. `value` is near the sd that they add, in units of the plain noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .effects import Effect
from .finger import Recording


def ground_along_the_row(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements share a ground wire in which a noisy current flows: the farther along it, the more each one sees.

    A normal error, anew in each sample, by gains from 0.3 to 1.6 from one end of the row to the other, times `value`
    and the plain noise. Common impedance (Ott, Electromagnetic Compatibility Engineering, 2009, chapter 2).
    """
    seen = np.linspace(0.3, 1.6, len(r.peak))[:: rng.choice([-1, 1])]
    return replace(r, error=r.error + value * r.noise_sd * np.outer(rng.standard_normal(len(r.time)), seen))


def operator_nearby(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The operator stands nearer or farther in each touch, and moves a little: all elements pick up the same from that.

    A normal error of each touch, sd 0.7, and one of each sample, sd 0.7, the same for all elements, times `value` and
    the plain noise. A body couples to wires by its capacitance.
    """
    stands, moves = rng.standard_normal(len(r.tip))[r.touch], rng.standard_normal(len(r.time))
    return replace(r, error=r.error + value * r.noise_sd * 0.7 * (stands + moves)[:, None])


def jitter(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The moment of sampling jitters while a channel still settles: noise goes with the step from the channel before.

    sd 3 |y_i - y_{i-1}|/peak in the order of the table, scan after scan, times `value` and the plain noise. Aperture
    jitter is noise in proportion to the slope (Horowitz and Hill, The Art of Electronics, 2015, chapter 13).
    """
    x = (r.signal / r.peak).ravel()
    step = np.abs(np.diff(x, prepend=x[0])).reshape(r.signal.shape)
    return replace(r, error=r.error + value * r.noise_sd * 3 * step * rng.standard_normal(r.signal.shape))


def crackling_touches(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Rubber crackles in some touches and is quiet in others: noise in proportion to the signal, of a size of its own.

    sd 3 x^0.75 c, x = |y|/peak, c log-normal with sd 0.6 over the touches, times `value` and the plain noise. Filler
    that breaks up differs from touch to touch.
    """
    loud = np.exp(0.6 * rng.standard_normal(len(r.tip)))[r.touch]
    sd = 3 * (np.abs(r.signal) / r.peak) ** 0.75 * loud[:, None]
    return replace(r, error=r.error + value * r.noise_sd * sd * rng.standard_normal(r.signal.shape))


def bit_slips(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The clock of a serial line gains or loses a pulse: a reading is doubled or halved.

    A share 0.003 n² of the readings, n the next integer above `value`; they take `value`/n of the way to 2 y or y/2,
    as often to the one as to the other. Shift registers do this.
    """
    n = np.ceil(value)
    slip = rng.random(r.signal.shape) < 0.003 * n**2
    wrong = rng.choice([1.0, -0.5], r.signal.shape)
    return replace(r, error=r.error + slip * wrong * r.signal * value / n)


def spells(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A plug is loose, and outliers come in spells, when somebody walks by: three of them, each 4 % of the time.

    In a spell one reading in eight is off, by normal amounts of sd 8 times `value` and the plain noise. Fretting of
    contacts.
    """
    since = r.time[:, None] / r.time[-1] - rng.uniform(0, 0.7, 3)
    bad = ((since >= 0) & (since < 0.04)).any(axis=1)[:, None] & (rng.random(r.signal.shape) < 1 / 8)
    return replace(r, error=r.error + bad * value * 8 * r.noise_sd * rng.standard_normal(r.signal.shape))


EFFECTS = (
    Effect("common_mode_noise", "ground along the row", "error", 1.0, 10.0, ground_along_the_row),
    Effect("common_mode_noise", "operator nearby", "error", 1.0, 10.0, operator_nearby),
    Effect("signal_dependent_noise", "jitter", "error", 1.0, 10.0, jitter),
    Effect("signal_dependent_noise", "crackling touches", "error", 1.0, 10.0, crackling_touches),
    Effect("outliers", "bit slips", "error", 1.0, 6.0, bit_slips),
    Effect("outliers", "spells", "error", 1.0, 10.0, spells),
)
