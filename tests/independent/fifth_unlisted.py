"""Causes of the fifth blind study that no catalogue lists; none is in an earlier registry or in `shape`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_readout import held
from .blind_waves import spectrum, waves
from .effects import Effect
from .finger import MODES, Recording


def swivelling_tips(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Tips hang in a joint that is not tight, and blunt ones swivel down the flank on which they land.

    The place is value tanh((θ - θ_0)/8°) r_c/(5 mm + r_c) degree further, θ_0 within 5° of the middle: edges have no
    lever, flats have the longest one. Statics of a swivel foot.
    """
    radius = np.minimum(r.tip, 1e9)
    moved = np.tanh((r.commanded - rng.uniform(-5, 5)) / 8) * radius / (5 + radius)
    return replace(r, press=replace(r.press, angle=r.press.angle + value * moved))


def coarse_scale(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Loads are read from a kitchen scale that shows steps of `value` N/m, from a zero that is anywhere in a step.

    Its electronics average for a second, so that all samples of a touch have the same load.
    """
    zero = rng.random()
    read = (np.round(r.read_load / value + zero) - zero) * value
    return replace(r, read_load=read)


def slipped_scan(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The clocks of switch and converter part for some time: readings then have `value` of the channel that follows.

    It lasts for 12 % of the time, and begins at any time; the last channel has that of the first one. Before and after
    all is right.
    """
    since = r.time / r.time[-1] - rng.uniform(0, 0.65)
    spell = ((since >= 0) & (since < 0.12))[:, None]
    other = np.roll(r.signal, -1, axis=1)
    return replace(r, signal=r.signal + value * spell * (other - r.signal))


def patch_of_tape(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A piece of tape, 16° wide, sticks to the rubber: what presses on it is spread as a normal bell, sd `value` mm.

    Waves are weighed with exp(-q²/2), q = k sd/r_b; the borders are blurred over 1.5°, within 12° of the middle. No
    load is lost.
    """
    x = np.abs(r.commanded - rng.uniform(-12, 12))
    on = 1 / (1 + np.exp((x - 8) / 1.5))
    q = np.arange(MODES) * value / r.finger.body.outer
    change = waves(r.finger, r.press, spectrum(r.finger, r.press) * np.expm1(-0.5 * q**2))
    return replace(r, signal=r.signal + (on[:, None] * change)[r.touch])


def sliding_on(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The tip slides on while a touch is held: by value (1 - exp(-t/0.5 s)) degree to one side, which is drawn.

    To first order in the movement; the slope of the signal is taken over half a degree to each side.
    """
    finger, press = r.finger, r.press
    ahead, behind = (finger.signal(replace(press, angle=press.angle + side)) for side in (0.5, -0.5))
    moved = -value * rng.choice([-1, 1]) * np.expm1(-held(r) / 0.5)
    return replace(r, signal=r.signal + moved[:, None] * (ahead - behind)[r.touch])


def mottled_rubber(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The filler was badly stirred: what each element feels of a touch goes up and down with its place, in its own way.

    y (1 + v f_e(θ)), f_e a random function of unit variance and a normal correlation of length 7°, another one for each
    element, v = `value`: the rubber between a touch and an element is that of no other pair.
    """
    apart = (r.commanded[:, None] - np.arange(-120, 121, 3.5)) / 7
    bell = np.exp(-(apart**2))
    course = bell @ rng.standard_normal((bell.shape[1], len(r.peak))) / np.sqrt((bell**2).sum(axis=1))[:, None]
    return replace(r, signal=r.signal * (1 + value * course)[r.touch])


def pressed_together(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Two neighbours lie so near that a touch between them presses them together, and a part of the current is lost.

    Both lose value √(x_1 x_2) of their peak, x = y/peak where it is positive: little unless both are strained. Which
    two is drawn, but none at an end.
    """
    first = 1 + rng.integers(len(r.peak) - 3)
    two = slice(first, first + 2)
    x = np.maximum(r.signal[:, two] / r.peak[two], 0)
    signal = r.signal.copy()
    signal[:, two] -= value * np.sqrt(x.prod(axis=1))[:, None] * r.peak[two]
    return replace(r, signal=signal)


def sagging_microsteps(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The motor makes its small steps too small, and then one that is too large: the place follows a saw tooth.

    value (s - 1/2) degree, s from 0 to 1 within each 7.2°, four whole steps of a motor of 200, from any angle on. The
    currents of the two windings are not a sine and a cosine.
    """
    s = (r.commanded / 7.2 + rng.uniform()) % 1 - 0.5
    return replace(r, press=replace(r.press, angle=r.press.angle + value * s))


def stray_grains(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Grains of sand come between tip and rubber in one touch in five: `value` of the load goes through one of them.

    It lies within 8° of the middle of the touch, and presses as an edge; the rest of the load presses as before.
    """
    hit = (rng.random(len(r.tip)) < 1 / 5)[:, None]
    beside = replace(r.press, angle=r.press.angle + rng.uniform(-8, 8, len(r.tip)))
    shares = spectrum(r.finger, r.press)
    grain = waves(r.finger, beside, np.ones_like(shares)) - waves(r.finger, r.press, shares)
    return replace(r, signal=r.signal + value * np.where(hit, grain, 0.0)[r.touch])


def soft_primer(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The primer on the core stayed soft, and lets the rubber above it slide: waves about as long as the layer grow.

    Each wave is weighed with 1 + v q² exp(1 - q²), v = `value`, q = k h/(2 r_b), h the thickness: those far longer are
    held by the core as a whole, those far shorter do not reach it.
    """
    q = np.arange(MODES) * (r.finger.body.outer - r.finger.body.core) / (2 * r.finger.body.outer)
    more = spectrum(r.finger, r.press) * q**2 * np.exp(1 - q**2)
    return replace(r, signal=r.signal + value * waves(r.finger, r.press, more)[r.touch])


EFFECTS = tuple(
    Effect(*each, listed=False)
    for each in (
        ("swivelling_tips", "", "before", 0.3, 5.0, swivelling_tips),
        ("coarse_scale", "", "before", 10.0, 80.0, coarse_scale),
        ("slipped_scan", "", "after", 0.05, 1.0, slipped_scan),
        ("patch_of_tape", "", "after", 0.5, 3.0, patch_of_tape),
        ("sliding_on", "", "after", 0.3, 4.0, sliding_on),
        ("mottled_rubber", "", "after", 0.02, 0.4, mottled_rubber),
        ("pressed_together", "", "after", 0.05, 0.9, pressed_together),
        ("sagging_microsteps", "", "before", 0.5, 5.0, sagging_microsteps),
        ("stray_grains", "", "after", 0.05, 0.6, stray_grains),
        ("soft_primer", "", "after", 0.05, 0.6, soft_primer),
    )
)
