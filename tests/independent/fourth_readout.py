"""Forms of the readout and of what time does in the fourth blind study. None is in an earlier registry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_readout import held
from .effects import Effect
from .finger import Recording


def percolation(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements of filled rubber conduct little until their particles meet, then much, then no more: an S-shaped curve.

    (1 - v) x + v 1.25 x |x|/(0.25 + x²) of the peak, x = y/peak, v = `value`. Conduction near the percolation threshold
    (Kirkpatrick, 1973, doi:10.1103/RevModPhys.45.574).
    """
    x = r.signal / r.peak
    bent = 1.25 * x * np.abs(x) / (0.25 + x**2)
    return replace(r, signal=r.peak * ((1 - value) * x + value * bent))


def bent_either_way(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Each element has a transistor with a curve of its own: some read more of large strains, and others less.

    y (1 + v_e x/(1 + 0.5 |x|)), x = y/peak, v_e normal with sd `value`: a bend of either sign that levels off. Spread
    of parts that were not matched.
    """
    bend = value * rng.standard_normal(len(r.peak))
    x = r.signal / r.peak
    return replace(r, signal=r.signal * (1 + bend * x / (1 + 0.5 * np.abs(x))))


def folding_back(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """An amplifier is driven beyond its input range, and its output turns round: above a level, readings fall.

    L - 0.35 (y - L) above L, the largest signal times exp(-v), one for all, v = `value`. Phase reversal of operational
    amplifiers (Horowitz and Hill, The Art of Electronics, 2015, chapter 4).
    """
    level = np.abs(r.signal).max() * np.exp(-value)
    return replace(r, signal=r.signal - 1.35 * np.maximum(r.signal - level, 0))


def heating_limiter(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Each element has a limiter that warms up under current: what it lets pass gets less while a touch is held.

    y/(1 + (|y|/L)⁶)^(1/6), L the largest signal of the element over v, times 1 - 0.3 (1 - exp(-t/0.3 s)), v = `value`,
    t the time since the touch began. Thermistors whose resistance grows with temperature.
    """
    cold = np.abs(r.signal).max(axis=0) / value
    level = cold * (1 + 0.3 * np.expm1(-held(r) / 0.3))[:, None]
    return replace(r, signal=r.signal / (1 + (np.abs(r.signal) / level) ** 6) ** (1 / 6))


def sun_in_two_windows(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The sun shines on the finger through one window and later through another: elements that face it are warmed.

    Each time it comes and goes within 40 s and stays for 0.15 of the whole time; `value` of the peak times the cosine
    of the angle between element and sun, which is 40° beside the middle. Lambert's cosine law.
    """
    end = r.time[-1]
    begins = np.array([rng.uniform(0.05, 0.3), rng.uniform(0.45, 0.6)]) * end
    s = r.time[:, None] - begins
    lit = (np.tanh(s / 40) - np.tanh((s - 0.15 * end) / 40)).sum(axis=1) / 2
    facing = np.cos(np.radians(r.finger.angle - rng.choice([-40, 40])))
    return replace(r, signal=r.signal + value * rng.choice([-1, 1]) * r.peak * np.outer(lit, facing))


def charge_amplifiers(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Charge amplifiers drift in proportion to the time, and are reset every 280 s: zeros follow a saw tooth.

    value √12 N_e (s - 1/2) of the peak, s from 0 to 1 between resets, normal N_e: the leakage of each. An integrator
    adds up its bias current (Horowitz and Hill, The Art of Electronics, 2015, chapter 4).
    """
    s = (r.time / 280 + rng.uniform()) % 1 - 0.5
    share = value * np.sqrt(12) * rng.standard_normal(len(r.peak))
    return replace(r, signal=r.signal + r.peak * np.outer(s, share))


def lamp_switched_on_anew(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A lamp feeds all elements, and is switched on anew before each table: it is too bright until it is warm.

    1 + value exp(-s/150 s), s the time since the first touch of the table. Light of diodes falls as their junctions
    warm up.
    """
    begins = r.time[:: r.n_samples][np.cumsum((0, *r.parts[:-1]))]
    since = (r.time[:, None] - begins)[np.arange(len(r.time)), np.searchsorted(begins, r.time, side="right") - 1]
    return replace(r, signal=r.signal * (1 + value * np.exp(-since / 150))[:, None])


def warmed_from_one_side(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A motor beside the finger warms the elements near it: their gains change, those of the far side hardly.

    1 + v (1 - exp(-t/700 s)) exp(-d/25°), d the angle from the element that is nearest to the motor, v = `value`. A fin
    that is heated at one end (Incropera and DeWitt, Fundamentals of Heat and Mass Transfer).
    """
    side = rng.choice([-1, 1]) * r.finger.angle
    near = rng.choice([-1, 1]) * np.exp(-(side - side.min()) / 25)
    return replace(r, signal=r.signal * (1 - value * np.outer(np.expm1(-r.time / 700), near)))


def creep_of_one_side(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The rubber cured less on one side of the finger, where it creeps most: the share goes with where it is touched.

    1 + v (1 + 0.8 sin(θ - φ)) (1 - exp(-√(t/0.4 s))), v = `value`, φ any, t the time since the touch began. Stretched
    exponential of Kohlrausch (Ferry, Viscoelastic Properties of Polymers, 1980).
    """
    share = value * (1 + 0.8 * np.sin(np.radians(r.commanded) - rng.uniform(-np.pi, np.pi)))
    course = -np.expm1(-np.sqrt(held(r) / 0.4))
    return replace(r, signal=r.signal * (1 + share[r.touch] * course)[:, None])


def creep_that_widens(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The rubber gets softer while it is pressed: it gives way more, and the contact of a blunt tip grows wider, too.

    Signals go from those of the modulus μ to those of μ/(1 + v), v = `value`, as 1 - exp(-t/0.35 s), t the time since
    the touch began. Elastic solution with the modulus of the time (Johnson, Contact Mechanics, 1985, section 6.5).
    """
    soft = replace(r.finger, modulus=r.finger.modulus / (1 + value)).signal(r.press)
    change = (soft - r.finger.signal(r.press))[r.touch]
    return replace(r, signal=r.signal - np.expm1(-held(r) / 0.35)[:, None] * change)


def recoil(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Rubber that is let go swings through: what a touch leaves changes its sign before it fades.

    Each touch leaves value (exp(-s/6 s) - 0.5 exp(-s/30 s)) of its last readings, s the time since then: a dent that
    heals, over warmth that it leaves behind (thermoelasticity; Treloar, The Physics of Rubber Elasticity, 1975).
    """
    last, end = r.signal[r.n_samples - 1 :: r.n_samples], r.time[r.n_samples - 1 :: r.n_samples]
    since = r.time[:, None] - end
    past = np.maximum(since, 0)
    weight = np.where(since > 0, np.exp(-past / 6) - 0.5 * np.exp(-past / 30), 0.0)
    return replace(r, signal=r.signal + value * weight @ last)


def dent_in_place(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A touch leaves a dent that heals slowly, and a tip that comes down in it reads less, wherever elements are.

    y (1 - v D), D the sum over earlier touches of exp(-s/25 s) exp(-(Δ/6°)²/2), s the time since they ended and Δ the
    angle to them, v = `value`. Delayed recovery of rubber (Ferry, Viscoelastic Properties of Polymers, 1980).
    """
    begin, end = r.time[:: r.n_samples], r.time[r.n_samples - 1 :: r.n_samples]
    since = begin[:, None] - end
    near = np.exp(-0.5 * ((r.commanded[:, None] - r.commanded) / 6) ** 2)
    dent = np.where(since > 0, near * np.exp(-np.maximum(since, 0) / 25), 0.0).sum(axis=1)
    return replace(r, signal=r.signal * (1 - value * dent[r.touch])[:, None])


EFFECTS = (
    Effect("gain_nonlinearity", "percolation", "after", 0.2, 1.0, percolation),
    Effect("gain_nonlinearity", "either way", "after", 0.2, 0.8, bent_either_way),
    Effect("saturation", "folding back", "after", 0.2, 2.0, folding_back),
    Effect("saturation", "heating limiter", "after", 0.8, 4.0, heating_limiter),
    Effect("baseline_drift", "sun", "after", 0.02, 0.5, sun_in_two_windows),
    Effect("baseline_drift", "charge amplifiers", "after", 0.02, 0.5, charge_amplifiers),
    Effect("gain_drift", "lamp switched on anew", "after", 0.1, 0.8, lamp_switched_on_anew),
    Effect("gain_drift", "warmed from one side", "after", 0.1, 0.8, warmed_from_one_side),
    Effect("creep", "of one side", "after", 0.05, 0.5, creep_of_one_side),
    Effect("creep", "that widens", "after", 0.05, 0.6, creep_that_widens),
    Effect("memory", "recoil", "after", 0.1, 0.6, recoil),
    Effect("memory", "dent in place", "after", 0.05, 0.4, dent_in_place),
)
