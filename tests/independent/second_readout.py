"""Forms of the readout and of what time does in the second blind study. None is in `blind_readout` or `readout`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_readout import _relaxing, held
from .effects import Effect
from .finger import Recording


def second_slope(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Above 40 % of the peak the response has another slope, larger by `value`: two straight lines, rounded.

    y + v w peak ln(1 + exp((x - 0.4)/w)), x = y/peak, w = 0.04. Sheets of force-sensing resistor have a second slope
    where all their asperities are in contact.
    """
    x, round_over = r.signal / r.peak, 0.04
    more = round_over * np.logaddexp(0, (x - 0.4) / round_over)
    return replace(r, signal=r.signal + value * r.peak * more)


def slack_element(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements lie slack in the rubber: small strains are not felt in full, y - v x_0 peak tanh(x/x_0), x = y/peak.

    x_0 = 0.15; `value` is the share that is lost of the smallest signals. A fibre or a foil that was not drawn straight
    takes up its slack first.
    """
    x = r.signal / r.peak
    return replace(r, signal=r.signal - value * 0.15 * r.peak * np.tanh(x / 0.15))


def falling_rail(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A battery feeds the amplifiers, and their rail falls with it: min(y, L (1.15 - 0.3 t/T)), one rail for all.

    L is the largest signal times exp(-v), v = `value`; T is the time of the whole recording. Without a regulator the
    largest output follows the supply (Horowitz and Hill, The Art of Electronics, 2015).
    """
    level = np.abs(r.signal).max() * np.exp(-value)
    rail = level * (1.15 - 0.3 * r.time / r.time[-1])
    return replace(r, signal=np.minimum(r.signal, rail[:, None]))


def unequal_rails(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Each channel has an amplifier of its own that clips hard, at levels that trimming left unequal.

    min(y, L_e), L_e the largest signal of the element times exp(-v u_e), u_e from 0 to 1, so that some clip and others
    do not; v = `value`.
    """
    share = rng.permutation(np.linspace(0.0, 1.0, len(r.peak)))
    return replace(r, signal=np.minimum(r.signal, np.abs(r.signal).max(axis=0) * np.exp(-value * share)))


def damp_comes_in(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The rubber takes up water from the air: zeros move with the root of time, each by a share of its own.

    Normal shares, `value` of the peak at the end. Diffusion into a half-space (Crank, The Mathematics of Diffusion,
    1975, chapter 3).
    """
    share = value * rng.standard_normal(len(r.peak))
    return replace(r, signal=r.signal + share * r.peak * np.sqrt(r.time / r.time[-1])[:, None])


def telegraph(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A trap in each amplifier is full or empty: its zero jumps between two levels, `value` of the peak apart.

    It stays at each for 4 min on average. Random telegraph noise, which data sheets call popcorn noise (Kirton and
    Uren, 1989, doi:10.1080/00018738900101122).
    """
    step = np.diff(r.time, prepend=r.time[0])[:, None]
    jumps = rng.random(r.signal.shape) < -np.expm1(-step / 240.0)
    level = (np.cumsum(jumps, axis=0) + rng.integers(0, 2, len(r.peak))) % 2
    return replace(r, signal=r.signal + value * r.peak * (level - 0.5))


def plugged_anew(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The plug of the sensor was taken out once: since then contacts have other resistances, and gains are others.

    At a time between 25 and 75 % of all, gains change by normal shares, sd `value`, with a mean of half of that.
    """
    since = r.time > rng.uniform(0.25, 0.75) * r.time[-1]
    share = value * (0.5 * rng.choice([-1, 1]) + rng.standard_normal(len(r.peak)))
    return replace(r, signal=r.signal * (1 + np.outer(since, share)))


def warm_rubber(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Draught in the room changes the temperature of the rubber, and gains follow, each with a coefficient of its own.

    The course is a random one of correlation time 8 min, sd `value`; coefficients are from 0.5 to 1.5. Newton's law of
    cooling under air of random temperature.
    """
    course = _relaxing(r.time, 480.0, 1, rng)
    coefficient = rng.permutation(np.linspace(0.5, 1.5, len(r.peak)))
    return replace(r, signal=r.signal * (1 + value * course * coefficient))


def creep_of_large_strain(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Rubber creeps more where it is strained more: 1 + v x (1 - exp(-t/0.6 s)), x = |y|/peak, v = `value`.

    Nonlinear creep, whose compliance grows with the strain (Findley, Lai and Onaran, Creep and Relaxation of Nonlinear
    Viscoelastic Materials, 1976).
    """
    course = -np.expm1(-held(r) / 0.6)[:, None]
    return replace(r, signal=r.signal * (1 + value * np.abs(r.signal) / r.peak * course))


def creep_of_glue(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The glue of each element creeps by itself: 1 - v_e (1 - exp(-t/τ_e)), so that its reading falls while it is held.

    v_e from 0.2 to 1.8 times `value`, τ_e from 0.15 to 1.5 s. Creep of strain gauges that are glued (Hoffmann, An
    Introduction to Measurements using Strain Gages, 1989).
    """
    m = len(r.peak)
    share = value * rng.permutation(np.linspace(0.2, 1.8, m))
    time = rng.permutation(np.geomspace(0.15, 1.5, m))
    return replace(r, signal=r.signal * (1 + share * np.expm1(-held(r)[:, None] / time)))


def set_of_large_strain(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Large strains leave far more than small ones: each touch leaves v y²/peak, which fades with 15 s.

    y is its last reading, v = `value`. Recoverable set of filled rubber grows faster than its strain (Mullins, 1969,
    doi:10.5254/1.3539210).
    """
    last, end = r.signal[r.n_samples - 1 :: r.n_samples], r.time[r.n_samples - 1 :: r.n_samples]
    since = r.time[:, None] - end
    weight = np.where(since > 0, np.exp(-np.maximum(since, 0) / 15), 0.0)
    return replace(r, signal=r.signal + value * weight @ (last * np.abs(last) / r.peak))


def set_by_the_last_touch(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Dry friction in the rubber holds what the last touch left, however long, until the next one wipes it out.

    `value` of the last reading at the first sample of the next touch; each sample of that touch takes 30 % of it away.
    Friction elements of Preisach and Prandtl have no time of their own.
    """
    last = r.signal[r.n_samples - 1 :: r.n_samples]
    before = np.concatenate([np.zeros_like(last[:1]), last[:-1]])
    return replace(r, signal=r.signal + value * before[r.touch] * (0.7**r.sample)[:, None])


EFFECTS = (
    Effect("gain_nonlinearity", "second slope", "after", 0.2, 2.0, second_slope),
    Effect("gain_nonlinearity", "slack", "after", 0.3, 1.0, slack_element),
    Effect("saturation", "falling rail", "after", 0.2, 2.0, falling_rail),
    Effect("saturation", "unequal rails", "after", 0.2, 2.0, unequal_rails),
    Effect("baseline_drift", "damp", "after", 0.02, 0.5, damp_comes_in),
    Effect("baseline_drift", "telegraph", "after", 0.02, 0.5, telegraph),
    Effect("gain_drift", "plugged anew", "after", 0.05, 0.5, plugged_anew),
    Effect("gain_drift", "warm rubber", "after", 0.03, 0.3, warm_rubber),
    Effect("creep", "of large strain", "after", 0.05, 0.6, creep_of_large_strain),
    Effect("creep", "of glue", "after", 0.05, 0.5, creep_of_glue),
    Effect("memory", "of large strain", "after", 0.1, 0.8, set_of_large_strain),
    Effect("memory", "by the last touch", "after", 0.1, 0.8, set_by_the_last_touch),
)
