"""Causes of the fourth blind study that no catalogue lists; none is in an earlier registry or in `shape`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_waves import indentation, spectrum, thinner, waves
from .effects import Effect
from .elements import turn_deg
from .finger import Recording


def levers_of_tips(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Each tip is screwed to the lever of the force sensor at a place of its own, and reads a share too much or less.

    P (1 + v N), N normal for each tip, v = `value`; tips of the same radius are one tip. Law of the lever.
    """
    tips, which = np.unique(r.tip, return_inverse=True)
    share = value * rng.standard_normal(len(tips))[which]
    return replace(r, read_load=r.read_load * (1 + share[r.touch]))


def bowed_flat(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The flat is not flat: it was ground on a worn wheel, and is a round of the curvature `value`, 1/mm, all along it.

    All other tips are as the table says. Grinding marks of a soft wheel.
    """
    tip = np.where(np.isinf(r.tip), 1 / value, r.press.tip)
    return replace(r, press=replace(r.press, tip=tip))


def early_trigger(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The first sample of one touch in six is taken too early: the tip is not yet fully down.

    All elements then read less by the same share, from 0 to `value`. The force sensor's filter does not notice.
    """
    early = (rng.random(len(r.tip)) < 1 / 6) * rng.uniform(0, 1, len(r.tip))
    share = value * early[r.touch] * (r.sample == 0)
    return replace(r, signal=r.signal * (1 - share)[:, None])


def warming_load_cell(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The force sensor warms up, and reads a growing share too much or too little: P (1 + v (1 - exp(-t/400 s))).

    v = `value`, the sign is drawn. Sensitivity of strain gauges goes with temperature (Doebelin, Measurement Systems,
    2003).
    """
    share = value * rng.choice([-1, 1]) * -np.expm1(-r.time / 400)
    return replace(r, read_load=r.read_load * (1 + share))


def trembling_tip(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The bench trembles, and the tip moves to and fro on the finger from sample to sample: normal, sd `value` degree.

    To first order in the movement; the slope of the signal is taken over half a degree to each side.
    """
    finger, press = r.finger, r.press
    ahead, behind = (finger.signal(replace(press, angle=press.angle + side)) for side in (0.5, -0.5))
    moved = value * rng.standard_normal(len(r.time))
    return replace(r, signal=r.signal + moved[:, None] * (ahead - behind)[r.touch])


def wandering_elements(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The rubber flows round the core, and takes each element along at a speed of its own, to either side.

    Elements move by N_e t/T times `value` degree, N_e normal, T the whole time; to first order in the movement.
    """
    finger = r.finger
    ahead, behind = (replace(finger, angle=finger.angle + side).signal(r.press) for side in (0.5, -0.5))
    moved = value * np.outer(r.time / r.time[-1], rng.standard_normal(len(r.peak)))
    return replace(r, signal=r.signal + moved * (ahead - behind)[r.touch])


def weld_on_core(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The core has a weld along it, 16° wide, over which the layer of rubber is thinner by `value` mm.

    Thinner by value exp(-x⁴), x = (θ - θ_0)/8°, θ_0 within 20° of the middle; elements keep their share of the
    thickness.
    """
    x = (r.commanded - rng.uniform(-20, 20)) / 8
    return replace(r, signal=r.signal + thinner(r.finger, r.press, value * np.exp(-(x**4)))[r.touch])


def liquid_core(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The core is a hose with liquid in it: each touch raises its pressure, and all elements feel that alike.

    `value` of the peak times (d/d_m)², d the indentation and d_m its mean over all touches: the volume of a segment
    grows faster than its height. Pascal's law.
    """
    deep = indentation(r.finger, r.press)
    raised = value * (deep / deep.mean()) ** 2
    return replace(r, signal=r.signal + np.outer(raised[r.touch], r.peak))


def specks_on_tips(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A hard speck sticks to each round tip: `value` of the load goes through it, as through an edge, 5° to one side.

    The side is drawn for each tip. The rest of the load presses as before; edges and flats are clean.
    """
    tips, which = np.unique(r.tip, return_inverse=True)
    aside = 5 * rng.choice([-1, 1], len(tips))[which]
    hit = (np.isfinite(r.tip) & (r.tip > 0))[:, None]
    shares = spectrum(r.finger, r.press)
    beside = replace(r.press, angle=r.press.angle + aside)
    speck = waves(r.finger, beside, np.ones_like(shares)) - waves(r.finger, r.press, shares)
    return replace(r, signal=r.signal + value * np.where(hit, speck, 0.0)[r.touch])


def lopsided_elements(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements were glued on one side only: they answer more to touches on that side than on the other.

    y (1 + v_e tanh(x/5°)), x the angle from the element to the touch, v_e normal with sd `value`.
    """
    share = value * rng.standard_normal(len(r.peak)) * np.tanh(turn_deg(r) / 5)
    return replace(r, signal=r.signal * (1 + share[r.touch]))


EFFECTS = tuple(
    Effect(*each, listed=False)
    for each in (
        ("levers_of_tips", "", "before", 0.1, 0.5, levers_of_tips),
        ("bowed_flat", "", "before", 0.01, 0.1, bowed_flat),
        ("early_trigger", "", "after", 0.1, 1.0, early_trigger),
        ("warming_load_cell", "", "before", 0.05, 0.5, warming_load_cell),
        ("trembling_tip", "", "after", 0.3, 4.0, trembling_tip),
        ("wandering_elements", "", "after", 0.5, 5.0, wandering_elements),
        ("weld_on_core", "", "after", 0.1, 0.8, weld_on_core),
        ("liquid_core", "", "after", 0.02, 0.3, liquid_core),
        ("specks_on_tips", "", "after", 0.05, 0.6, specks_on_tips),
        ("lopsided_elements", "", "after", 0.05, 0.8, lopsided_elements),
    )
)
