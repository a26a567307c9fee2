"""Forms of the readout and of what time does in the third blind study. None is in an earlier registry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_readout import held
from .blind_waves import half_width
from .effects import Effect
from .finger import Recording


def fringes(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """An interferometer reads the element, and its two signals are not quite alike: y + v peak sin(3 π x)/(3 π).

    x = y/peak, `value` is v. Periodic error of interferometers, with a period of two thirds of the peak here
    (Heydemann, 1981, doi:10.1364/AO.20.003382).
    """
    turn = 3 * np.pi * r.signal / r.peak
    return replace(r, signal=r.signal + value * r.peak * np.sin(turn) / (3 * np.pi))


def logarithmic_elements(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements of filled rubber bend over with a logarithm, each with a curve of its own: peak ln(1 + v_e x)/v_e.

    x = y/peak, v_e from 0 to 2 times `value`; the curve is odd in x. Mixing varies from element to element, and
    resistance falls as an exponential of the pressure.
    """
    bend = value * rng.permutation(np.linspace(0.02, 2.0, len(r.peak)))
    x = r.signal / r.peak
    return replace(r, signal=r.peak * np.sign(x) * np.log1p(bend * np.abs(x)) / bend)


def current_limit(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """One supply with a current limit feeds all elements: when they take more together, all read less in proportion.

    y min(1, L/S), S the sum over the elements of what is positive, L the largest S times exp(-v), v = `value`. Foldback
    of laboratory supplies (Horowitz and Hill, The Art of Electronics, 2015, chapter 9).
    """
    total = np.maximum(r.signal, 0).sum(axis=1)
    limit = total.max() * np.exp(-value)
    return replace(r, signal=r.signal * np.minimum(1, limit / np.maximum(total, 1e-9))[:, None])


def hard_stop(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Foam between the plates of an element is pressed flat: above a level it gives way less and less, then no more.

    y = A + w tanh((y - A)/w) above A, w = 0.3 A, A the largest signal of the element times exp(-v u_e), v = `value`;
    u_e is from 0.2 to 1.8, as sheets of foam differ in thickness. Densification of foams (Gibson and Ashby, Cellular
    Solids, 1997, chapter 5).
    """
    level = np.abs(r.signal).max(axis=0) * np.exp(-value * rng.uniform(0.2, 1.8, len(r.peak)))
    room = 0.3 * level
    over = np.maximum(r.signal - level, 0)
    return replace(r, signal=np.minimum(r.signal, level) + room * np.tanh(over / room))


def open_door(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Somebody opens the door three times: cold air moves the zeros away, and they come back within minutes.

    Each time s after an opening the course is (s/τ) exp(1 - s/τ), τ = 90 s: two lags in series. Elements follow by
    shares of mean ±0.5 and sd 1, `value` of the peak.
    """
    since = r.time[:, None] - rng.uniform(0.0, 0.9, 3) * r.time[-1]
    late = np.maximum(since, 0) / 90
    course = (late * np.exp(1 - late)).sum(axis=1)
    share = value * (0.5 * rng.choice([-1, 1]) + rng.standard_normal(len(r.peak)))
    return replace(r, signal=r.signal + share * r.peak * course[:, None])


def slow_beat(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Sampling beats with the mains: zeros follow a slow sine, and each channel lags the one before in the scan.

    value √2 sin(2π t/660 s + 0.6 e + φ) of the peak, e the number of the channel. Aliasing of a frequency near a
    multiple of the rate of sampling (Horowitz and Hill, The Art of Electronics, 2015, chapter 13).
    """
    turn = 2 * np.pi * r.time[:, None] / 660 + 0.6 * np.arange(len(r.peak)) + rng.uniform(-np.pi, np.pi)
    return replace(r, signal=r.signal + value * r.peak * np.sqrt(2) * np.sin(turn))


def mode_hops(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A laser feeds all elements, and hops between modes: all gains jump together, by normal amounts of sd `value`.

    It stays in a mode for 4 min on average, and each new mode has a power of its own. Diode lasers do this when their
    temperature changes (Wieman and Hollberg, 1991, doi:10.1063/1.1142305).
    """
    step = np.diff(r.time, prepend=r.time[0])
    mode = np.cumsum(rng.random(len(r.time)) < -np.expm1(-step / 240.0))
    power = rng.standard_normal(len(r.time))[mode]
    return replace(r, signal=r.signal * (1 + value * power)[:, None])


def tired_elements(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements tire as they are strained: gains fall with the sum of all that each has read so far.

    1 - v D_e/D, D_e the sum of |y|/peak over all samples before, D its mean over the elements at the end, v = `value`.
    Fatigue of conducting rubber, linear in the damage (Miner, 1945, doi:10.1115/1.4009458).
    """
    dose = np.cumsum(np.abs(r.signal) / r.peak, axis=0)
    return replace(r, signal=r.signal * (1 - value * dose / dose[-1].mean()))


def creep_of_pores(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The rubber is a gel whose liquid flows from under the tip: the wider the contact, the longer it takes.

    1 + v (1 - exp(-t/τ)), τ = 0.08 s + 0.6 s (a/3 mm)², a the half-width of the contact, v = `value`. Poroelastic
    relaxation goes with a²/D (Hu, Zhao, Vlassak and Suo, 2010, doi:10.1063/1.3370354).
    """
    time = 0.08 + 0.6 * (half_width(r.finger, r.press) / 3) ** 2
    course = -np.expm1(-held(r) / time[r.touch])
    return replace(r, signal=r.signal * (1 + value * course)[:, None])


def creep_of_bond(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The bond to the core flows like a viscous liquid under some elements: readings grow in proportion to the time.

    1 + v_e t/1 s, v_e from 0 to 2 times `value`, as thick as the primer lies. Steady flow of Maxwell's body (Ferry,
    Viscoelastic Properties of Polymers, 1980).
    """
    flow = value * rng.permutation(np.linspace(0.0, 2.0, len(r.peak)))
    return replace(r, signal=r.signal * (1 + np.outer(held(r), flow)))


def thixotropy(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A touch breaks up the filler's network around an element, which reads more until the network has grown again.

    y (1 + v B), B the sum of x exp(-s/15 s) over earlier touches, x = |y|/peak at their end, s the time since then,
    v = `value`. Recovery after strain of filled rubber (Payne, 1962, doi:10.1002/app.1962.070061906).
    """
    last, end = r.signal[r.n_samples - 1 :: r.n_samples], r.time[r.n_samples - 1 :: r.n_samples]
    since = r.time[:, None] - end
    weight = np.where(since > 0, np.exp(-np.maximum(since, 0) / 15), 0.0)
    return replace(r, signal=r.signal * (1 + value * weight @ (np.abs(last) / r.peak)))


def spreading_dent(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The dent of a touch is wider than the touch, and heals by a stretched exponential, exp(-√(s/6 s)).

    Each touch leaves `value` of its last readings, averaged over the elements with a bell of sd 10°, so that neighbours
    keep it, too. Kohlrausch's law of recovery (Ferry, Viscoelastic Properties of Polymers, 1980).
    """
    angle = r.finger.angle
    bell = np.exp(-0.5 * ((angle[:, None] - angle) / 10) ** 2)
    last, end = r.signal[r.n_samples - 1 :: r.n_samples] / r.peak, r.time[r.n_samples - 1 :: r.n_samples]
    since = r.time[:, None] - end
    weight = np.where(since > 0, np.exp(-np.sqrt(np.maximum(since, 0) / 6)), 0.0)
    return replace(r, signal=r.signal + value * r.peak * (weight @ last @ (bell / bell.sum(axis=0))))


EFFECTS = (
    Effect("gain_nonlinearity", "fringes", "after", 0.2, 2.0, fringes),
    Effect("gain_nonlinearity", "logarithmic, by element", "after", 0.2, 2.0, logarithmic_elements),
    Effect("saturation", "current limit", "after", 0.2, 2.0, current_limit),
    Effect("saturation", "hard stop", "after", 0.2, 2.0, hard_stop),
    Effect("baseline_drift", "open door", "after", 0.02, 0.5, open_door),
    Effect("baseline_drift", "slow beat", "after", 0.02, 0.5, slow_beat),
    Effect("gain_drift", "mode hops", "after", 0.03, 0.3, mode_hops),
    Effect("gain_drift", "tired elements", "after", 0.1, 0.6, tired_elements),
    Effect("creep", "of pores", "after", 0.05, 0.6, creep_of_pores),
    Effect("creep", "of the bond", "after", 0.05, 0.5, creep_of_bond),
    Effect("memory", "thixotropy", "after", 0.05, 0.5, thixotropy),
    Effect("memory", "spreading dent", "after", 0.05, 0.5, spreading_dent),
)
