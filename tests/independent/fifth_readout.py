"""Forms of the readout and of what time does in the fifth blind study. None is in an earlier registry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import erfc

from .blind_readout import held
from .blind_waves import spectrum, waves
from .effects import Effect
from .finger import MODES, Recording


def filter_line(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Light passes a filter with one line in its flank: readings are too large where the element's light crosses it.

    y (1 + v exp(-((x - 0.6)/0.12)²/2)), x = y/peak, v = `value`. Edge filters that read gratings are not straight
    (Kersey and others, Fiber Grating Sensors, 1997, doi:10.1109/50.618377).
    """
    x = r.signal / r.peak
    return replace(r, signal=r.signal * (1 + value * np.exp(-0.5 * ((x - 0.6) / 0.12) ** 2)))


def grains_that_meet(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Grains in an element meet at a strain of its own, and from there on conduct as the load of their contacts grows.

    y + v peak (x - x_e)^1.5 above x_e, x = y/peak, x_e from 0.1 to 0.8 over the elements, in random order, v = `value`.
    Contact of spheres (Hertz; Johnson, Contact Mechanics, 1985, chapter 4).
    """
    meet = rng.permutation(np.linspace(0.1, 0.8, len(r.peak)))
    over = np.maximum(r.signal / r.peak - meet, 0)
    return replace(r, signal=r.signal + value * r.peak * over**1.5)


def slow_recovery(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """One amplifier reads all channels and clips, and after that needs time: the next two channels read too little.

    min(y, L) less 0.5 and 0.25 of what was clipped one and two channels before, L the largest signal times exp(-v), one
    for all, v = `value`. Overload recovery (Horowitz and Hill, The Art of Electronics, 2015, chapter 5).
    """
    scan = r.signal.ravel()
    level = np.abs(scan).max() * np.exp(-value)
    over = np.maximum(scan - level, 0)
    late = 0.5 * np.append(0.0, over[:-1]) + 0.25 * np.append([0.0, 0.0], over[:-2])
    return replace(r, signal=(scan - over - late).reshape(r.signal.shape))


def limited_in_pairs(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Two elements each share one current source that gives no more than it can: then both read less in proportion.

    y min(1, L/S), S what is positive of the two, L the largest S of the pair times exp(-v u), u from 0.4 to 1.6 over
    the pairs, v = `value`. Parts with two channels in one case.
    """
    m = len(r.peak)
    pair = np.arange(m) // 2
    total = np.stack([np.maximum(r.signal[:, pair == p], 0).sum(axis=1) for p in range(pair[-1] + 1)], axis=1)
    limit = total.max(axis=0) * np.exp(-value * rng.permutation(np.linspace(0.4, 1.6, pair[-1] + 1)))
    less = np.minimum(1, limit / np.maximum(total, 1e-9))
    return replace(r, signal=r.signal * less[:, pair])


def zeroed_anew(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The operator sets all readings to zero every 45 touches, while the rubber is still at rest in part only.

    Zeros change each time by normal amounts of their own, sd `value` of the peak. A zero that is taken from one reading
    keeps what was wrong with it.
    """
    times = np.arange(len(r.tip)) // 45
    zero = value * rng.standard_normal((times[-1] + 1, len(r.peak)))
    return replace(r, signal=r.signal + r.peak * zero[times][r.touch])


def heat_along_the_layer(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A hand held one side of the finger, and the heat goes along the layer: near zeros move soon, far ones late.

    value erfc(d/√(4 D t)) of the peak, d the arc from the first element plus 2 mm, D = 0.1 mm²/s that of silicone, t
    the time; side and sign are drawn. Half-space at a fixed temperature (Crank, The Mathematics of Diffusion, 1975).
    """
    angle = rng.choice([-1, 1]) * r.finger.angle
    arc = 2 + np.radians(angle - angle.min()) * r.finger.body.outer
    warm = erfc(arc / np.sqrt(0.4 * np.maximum(r.time, 1e-6))[:, None])
    return replace(r, signal=r.signal + value * rng.choice([-1, 1]) * r.peak * warm)


def compressor(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A compressor on the same mains runs for 200 s out of 660 s, and the supply of all elements is low meanwhile.

    1 - value while it runs, from a random time on. Without a regulator the voltage of a bridge follows its supply.
    """
    runs = (r.time / 660 + rng.uniform()) % 1 < 200 / 660
    return replace(r, signal=r.signal * (1 - value * runs)[:, None])


def come_loose(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements come loose from the rubber one by one, and from then on feel only a part of its strain.

    1 - v u_e/(1 + exp(-(t - t_e)/15 s)), t_e anywhere in the time, u_e from 0 to 2, in random order, v = `value`.
    Peeling of a glued joint starts late and ends soon.
    """
    begins = rng.uniform(0.1, 0.9, len(r.peak)) * r.time[-1]
    lost = 1 / (1 + np.exp(-np.clip((r.time[:, None] - begins) / 15, -50, 50)))
    share = value * rng.permutation(np.linspace(0.0, 2.0, len(r.peak)))
    return replace(r, signal=r.signal * (1 - share * lost))


def creep_of_new_rubber(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """New rubber creeps most in its first touches, and is run in after some hundred.

    1 + v (0.15 + 0.85 exp(-n/70)) (1 - exp(-t/0.3 s)), v = `value`, n the touches before, t the time since the touch
    began. Conditioning before a test of rubber (ISO 7743).
    """
    share = value * (0.15 + 0.85 * np.exp(-np.arange(len(r.tip)) / 70))
    return replace(r, signal=r.signal * (1 - share[r.touch] * np.expm1(-held(r) / 0.3))[:, None])


def creep_to_the_sides(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Rubber flows from under the tip to its sides: near elements come to feel less, those beside it more.

    The share value (1 - exp(-t/0.4 s)) of the load comes to lie as a bell of sd 2 mm about its place, t the time since
    the touch began: waves of it are weighed with exp(-q²/2), q = k 2 mm/r_b.
    """
    q = np.arange(MODES) * 2.0 / r.finger.body.outer
    spread = waves(r.finger, r.press, spectrum(r.finger, r.press) * np.expm1(-0.5 * q**2))
    return replace(r, signal=r.signal - value * np.expm1(-held(r) / 0.4)[:, None] * spread[r.touch])


def late_warmth(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A touch leaves warmth on the surface, which takes its time to reach the elements: most after a quarter minute.

    Each touch leaves value (s/15 s) exp(1 - s/15 s) of its last readings, s the time since then. Diffusion of heat
    through a layer, in two steps.
    """
    last, end = r.signal[r.n_samples - 1 :: r.n_samples], r.time[r.n_samples - 1 :: r.n_samples]
    late = np.maximum(r.time[:, None] - end, 0) / 15
    return replace(r, signal=r.signal + value * (late * np.exp(1 - late)) @ last)


def bulge_beside(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Rubber that a touch pushed aside stands up beside its dent for a while, and both go back together.

    Each touch leaves value exp(-s/12 s) of its last readings x = y/peak, less 0.5 of those of the elements within some
    15° (a bell, less the element itself). Rubber keeps its volume.
    """
    angle = r.finger.angle
    bell = np.exp(-0.5 * ((angle[:, None] - angle) / 15) ** 2) * (1 - np.eye(len(angle)))
    kernel = np.eye(len(angle)) - 0.5 * bell
    last, end = r.signal[r.n_samples - 1 :: r.n_samples] / r.peak, r.time[r.n_samples - 1 :: r.n_samples]
    since = r.time[:, None] - end
    weight = np.where(since > 0, np.exp(-np.maximum(since, 0) / 12), 0.0)
    return replace(r, signal=r.signal + value * r.peak * (weight @ last @ kernel))


EFFECTS = (
    Effect("gain_nonlinearity", "filter line", "after", 0.2, 1.0, filter_line),
    Effect("gain_nonlinearity", "grains that meet", "after", 0.2, 2.0, grains_that_meet),
    Effect("saturation", "slow recovery", "after", 0.2, 2.0, slow_recovery),
    Effect("saturation", "in pairs", "after", 0.2, 2.0, limited_in_pairs),
    Effect("baseline_drift", "zeroed anew", "after", 0.02, 0.5, zeroed_anew),
    Effect("baseline_drift", "heat along the layer", "after", 0.02, 0.5, heat_along_the_layer),
    Effect("gain_drift", "compressor", "after", 0.05, 0.6, compressor),
    Effect("gain_drift", "come loose", "after", 0.05, 0.45, come_loose),
    Effect("creep", "of new rubber", "after", 0.05, 0.6, creep_of_new_rubber),
    Effect("creep", "to the sides", "after", 0.05, 0.8, creep_to_the_sides),
    Effect("memory", "late warmth", "after", 0.05, 0.4, late_warmth),
    Effect("memory", "bulge beside", "after", 0.1, 0.6, bulge_beside),
)
