"""Causes of the blind study that no catalogue lists; none is in `unlisted` or in `shape`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_waves import kappa, waves
from .contact import contact_table
from .effects import Effect
from .elements import turn_deg
from .finger import MODES, Press, Recording


def universal_joint(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A bent Hooke's joint in the drive turns the finger twice too far and twice too little in a turn, `value` degree.

    tan θ' = tan θ/cos β: to first order an error β²/4 sin 2θ. Shigley, Theory of Machines and Mechanisms, on joints.
    """
    error = value * np.sin(2 * np.radians(r.commanded - rng.uniform(-45, 45)))
    return replace(r, press=replace(r.press, angle=r.press.angle + error))


def unbonded_side(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Beyond an angle the rubber lies on the core unbonded: there elements feel what is near more weakly, far more.

    E maps wider by the share `value` there; the change over the border takes 4°.
    """
    border, side = rng.uniform(2, 12), rng.choice([-1, 1])
    there = 1 / (1 + np.exp(-(side * r.commanded - border) / 4))
    near = replace(r.press, angle=r.commanded)
    narrow = np.exp(-((np.arange(MODES) / 12) ** 2))
    shares = contact_table(r.finger.body, MODES).spectrum(kappa(r.finger, near))
    change = waves(r.finger, near, shares * narrow) - waves(r.finger, near, shares)
    return replace(r, signal=r.signal + value * (there[:, None] * change)[r.touch])


def grain(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A hard grain lies in the rubber beside every third element, at 4°: what presses on it is passed on to that side.

    A dipole over the angle, x exp(-x²/2) with x = (turn - 4°)/2.5°, in proportion to the load: Eshelby's inclusion
    draws stress to itself and away from its sides.
    """
    x = (turn_deg(r) - rng.choice([-4, 4])) / 2.5
    hit = (np.arange(len(r.peak)) % 3 == 1) * (r.press.load / 200)[:, None]
    return replace(r, signal=r.signal + value * r.peak * (hit * x * np.exp(-0.5 * x**2))[r.touch])


def flash(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A flash along the mould's parting line pushes tips aside: an angle error x exp(-x²/2), x = (θ - θ_0)/5°."""
    x = (r.commanded - rng.uniform(-12, 12)) / 5
    return replace(r, press=replace(r.press, angle=r.press.angle + value * x * np.exp(-0.5 * x**2)))


def bending_arm(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The prober's arm bends under the load: the place moves by `value` degree for each 40 N/m beyond 200."""
    moved = value * (r.press.load - 200) / 40
    return replace(r, press=replace(r.press, angle=r.press.angle + moved))


def slow_force_sensor(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The force sensor's filter has not settled: it reads the share `value` of the load of the touch before."""
    before = np.concatenate([r.press.load[:1], r.press.load[:-1]])
    read = value * (before - r.press.load) * np.ones_like(r.press.load)
    return replace(r, read_load=r.read_load + read[r.touch])


def seats_of_tips(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Each tip sits in its holder a little beside the middle: an angle error for each tip, normal, `value` degree."""
    tips, which = np.unique(r.tip, return_inverse=True)
    beside = value * rng.standard_normal(len(tips))[which]
    return replace(r, press=replace(r.press, angle=r.press.angle + beside))


def pressed_leads(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Leads cross the rubber at one place: a touch there strains those of all elements, of each by its own amount.

    A bell over the place touched, sd 6°, in proportion to the load; normal amounts, `value` of the peak. Piezoresistive
    leads add their own change to that of the element.
    """
    bell = np.exp(-0.5 * ((r.commanded - rng.uniform(-25, 25)) / 6) ** 2) * r.press.load / 200
    amount = rng.standard_normal(len(r.peak))
    return replace(r, signal=r.signal + value * r.peak * np.outer(bell, amount)[r.touch])


def unipolar(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The converter takes positive voltages, and tension is compression's opposite: negative signals lose `value`."""
    return replace(r, signal=np.where(r.signal < 0, (1 - value) * r.signal, r.signal))


def softening(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Mullins' effect: a place that was pressed before is softer, by the share value (1 - exp(-n/2)) after n touches.

    Counted are earlier touches within 4°. Mullins (1969), doi:10.5254/1.3539210.
    """
    near = np.abs(r.commanded[:, None] - r.commanded) < 4
    count = np.tril(near, -1).sum(axis=1)
    return replace(r, signal=r.signal * (1 - value * np.expm1(-count / 2))[r.touch][:, None])


def range_switch(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The amplifier's upper range has another gain and zero: above 45 % of the peak readings jump by `value` of it."""
    return replace(r, signal=r.signal + value * r.peak * (r.signal > 0.45 * r.peak))


def heel(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The heel of the holder touches, too, 28° beside the tip, where tips are blunt: with `value` of the load.

    Tips of r_c above 5 mm, and flats. The heel is an edge, always on the same side.
    """
    blunt = (r.tip > 5).astype(float)
    side = r.press.angle + 28 * rng.choice([-1, 1])
    second = r.finger.signal(Press(np.zeros(len(r.tip)), side, r.press.load))
    return replace(r, signal=r.signal + value * (blunt[:, None] * second)[r.touch])


EFFECTS = tuple(
    Effect(*each, listed=False)
    for each in (
        ("universal_joint", "", "before", 0.3, 5.0, universal_joint),
        ("unbonded_side", "", "after", 0.1, 0.9, unbonded_side),
        ("grain", "", "after", 0.05, 0.9, grain),
        ("flash", "", "before", 0.3, 5.0, flash),
        ("bending_arm", "", "before", 0.2, 3.0, bending_arm),
        ("slow_force_sensor", "", "before", 0.05, 0.6, slow_force_sensor),
        ("seats_of_tips", "", "before", 0.3, 3.0, seats_of_tips),
        ("pressed_leads", "", "after", 0.02, 0.5, pressed_leads),
        ("unipolar", "", "after", 0.3, 1.0, unipolar),
        ("softening", "", "after", 0.05, 0.6, softening),
        ("range_switch", "", "after", 0.02, 0.4, range_switch),
        ("heel", "", "after", 0.05, 0.5, heel),
    )
)
