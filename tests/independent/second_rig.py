"""Forms of the rig and of the contact in the second blind study. None is in `blind_rig`, `rig` or `shape`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_rig import _no_hollow
from .blind_waves import edges_with, half_width, indentation, spectrum, waves
from .catalogue_finger import finite_strain
from .contact import contact_table
from .effects import Effect
from .finger import MODES, Recording


def turned_beside_axis(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The finger is clamped beside the axis of the turntable, and tips point at this axis: asin(e sin(θ - φ)).

    Sine rule in the triangle of axis, centre of the finger and contact, exactly. `value` is the largest error, degree;
    it is that of every tip.
    """
    beside = np.sin(np.radians(value)) * np.sin(np.radians(r.commanded) - rng.uniform(-np.pi, np.pi))
    return replace(r, press=replace(r.press, angle=r.press.angle + np.degrees(np.arcsin(beside))))


def play_in_the_clamp(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """An eccentric finger that has play in its clamp: gravity puts it on the one or the other side of the play.

    The error is value (sin(θ - φ) + 0.4 tanh(sin(θ - φ)/0.2)), degree: the moment of its weight changes its sign twice
    in a turn, and friction rounds the change (Slocum, Precision Machine Design, 1992, on backlash).
    """
    turn = np.sin(np.radians(r.commanded) - rng.uniform(-np.pi, np.pi))
    error = value * (turn + 0.4 * np.tanh(turn / 0.2))
    return replace(r, press=replace(r.press, angle=r.press.angle + error))


def stretched_cable(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The cable of the force sensor pulls at it, `value` N/m in the middle, more on the side where it is stretched.

    The pull is that of a weak spring over the travel of the arm: value (1 + 0.5 θ/90°), the side is drawn.
    """
    pull = value * (1 + 0.5 * rng.choice([-1, 1]) * r.commanded / 90)
    return replace(r, read_load=r.read_load + pull[r.touch])


def zero_under_contact(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The operator set the force sensor to zero while a tip lay on the rubber: it reads `value` N/m too little.

    It was done anew before the touches that are to be read, with a lighter contact: there it is 0.85 of it.
    """
    first = np.arange(len(r.tip)) < r.parts[0]
    return replace(r, read_load=r.read_load - value * np.where(first, 1.0, 0.85)[r.touch])


def friction_of_the_guide(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The guide of the arm takes the side force P sin(θ - φ), and its friction takes load from the sensor.

    Amontons' law: the sensor reads P (1 - v |sin(θ - φ)|), v = `value`; the play of the guide rounds |s| to
    √(s² + 0.01). φ is within 30°.
    """
    side = np.sin(np.radians(r.commanded - rng.uniform(-30, 30)))
    share = value * np.sqrt(side**2 + 0.01)
    return replace(r, read_load=r.read_load * (1 - share[r.touch]))


def load_beside_the_axis(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The force passes beside the axis of the finger, and the sensor takes the part along its own axis.

    It reads P √(1 - (v sin(θ - φ))²), v = `value` the distance over the radius, φ = 35° or -35°: a wave of two periods
    in a turn. Plane statics, without friction.
    """
    side = value * np.sin(np.radians(r.commanded - rng.choice([-35.0, 35.0])))
    return replace(r, read_load=r.read_load * np.sqrt(1 - side**2)[r.touch])


def nicked_edge(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A nick with a burr on each side: the edge presses along two lines, `value` mm apart.

    They have 65 and 35 % of the load, and its centre is where the edge was. Burrs of a ground blade have two ridges
    (Gillespie, Deburring and Edge Finishing Handbook, 1999).
    """
    finger, edge = r.finger, r.tip == 0
    apart = np.degrees(value / finger.body.outer) * rng.choice([-1, 1])
    one, other = (finger.signal(replace(r.press, angle=r.press.angle + x * apart)) for x in (0.35, -0.65))
    change = np.where(edge[:, None], 0.65 * one + 0.35 * other - finger.signal(r.press), 0.0)
    return replace(r, signal=r.signal + change[r.touch])


def taped_edge(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Tape of `value` mm over the edge, so that it does not cut the rubber, spreads its load: 2 t³/(π (x² + t²)²).

    Flamant's stress below a line load (Johnson, Contact Mechanics, 1985, section 2.2); it weighs each wave with
    (1 + q) exp(-q), q = k t/r_b.
    """
    q = np.tile(np.arange(MODES) * value / r.finger.body.outer, (len(r.tip), 1))
    return edges_with(r, (1 + q) * np.exp(-q))


def unequal_polish(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Each tip has a friction of its own, as it was polished: `value` times a log-normal factor with sd 0.5.

    All drag to the same side, which is drawn. Friction of rubber varies that much with the roughness of steel (Persson,
    2001, doi:10.1063/1.1388626).
    """
    tips, which = np.unique(r.tip, return_inverse=True)
    share = value * rng.choice([-1, 1]) * np.exp(0.5 * rng.standard_normal(len(tips)))[which]
    return replace(r, press=replace(r.press, tangential=r.press.tangential + share))


def talc_rubs_off(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The finger was powdered with talc, which touches rub off: friction grows from a quarter to its full value.

    The share of shear load is value (1 - 0.75 exp(-n/80)), n the touches before. Its side is drawn.
    """
    used = 1 - 0.75 * np.exp(-np.arange(len(r.tip)) / 80)
    share = value * rng.choice([-1, 1]) * used
    return replace(r, press=replace(r.press, tangential=r.press.tangential + share))


def halves_that_do_not_meet(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The halves of the mould did not meet: the surface has a step at their joint, which was sanded smooth.

    Its height goes as tanh x, x = (θ - θ_0)/9°; its curvature is δκ = value sech²(x) tanh(x)/0.385, 1/mm: hollow on the
    one side of the joint, bent on the other. θ_0 is within 12° of the middle.
    """
    x = (r.press.angle - rng.uniform(-12, 12)) / 9 * rng.choice([-1, 1])
    course = np.tanh(x) / np.cosh(np.minimum(np.abs(x), 50)) ** 2 / 0.385
    return replace(r, press=replace(r.press, hump=_no_hollow(r, value * course)))


def flat_from_storage(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The finger lay on one side in its box: the rubber has a flat there, 30° wide, with shoulders beside it.

    Compression set (ISO 815). δκ = -value (exp(-x⁴) - 0.5 exp(-((|x| - 1.6)/0.4)²)), 1/mm, x = (θ - θ_0)/15°; θ_0 is
    within 20° of the middle.
    """
    x = (r.press.angle - rng.uniform(-20, 20)) / 15
    course = 0.5 * np.exp(-(((np.abs(x) - 1.6) / 0.4) ** 2)) - np.exp(-(x**4))
    return replace(r, press=replace(r.press, hump=_no_hollow(r, value * course)))


def stiffening(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Chains near their full length make the rubber stiffer: Gent's law, beside what large strain does otherwise.

    μ/(1 - J/J_m), J = 4 e², e the indentation over the thickness: as if the load were less. Gent (1996),
    doi:10.5254/1.3538357; J_m = 4. `value` is the share of both changes; the other is of the finite-element table.
    """
    finger, thick = r.finger, r.finger.body.outer - r.finger.body.core
    strain = indentation(finger, r.press) / thick
    less = np.clip(value * strain**2, 0, 0.8)
    change = finger.signal(replace(r.press, load=r.press.load * (1 - less))) - finger.signal(r.press)
    return replace(r, signal=r.signal + (change + finite_strain(finger, r.press, value))[r.touch])


def sinking_surface(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The surface comes nearer to the elements as it sinks, and rubber that rises beside a tip widens its contact.

    Elements are woven into a cloth on the core and keep their radius. The layer is thinner by value/4 of the
    indentation. The half-width is larger by the share value e, e the indentation over the thickness (Sabin and
    Kaloni, 1983, on a rigid indenter in second-order elasticity); an edge has no width.
    """
    finger, body = r.finger, r.finger.body
    deep = indentation(finger, r.press)
    table, wide = (
        contact_table(body, MODES),
        half_width(finger, r.press) * (1 + value * deep / (body.outer - body.core)),
    )
    # the contact of this width under another load has the spectrum
    kappa = np.exp(np.interp(np.log(np.maximum(wide, 1e-9)), np.log(table.half_width), np.log(table.kappa)))
    wider = table.spectrum(np.where(r.press.tip == 0, 0.0, kappa))
    change = waves(finger, r.press, wider - spectrum(finger, r.press))
    step = 0.1
    nearer = replace(finger, body=replace(body, outer=body.outer - step)).signal(r.press) - finger.signal(r.press)
    change += (value / 4 * deep / step)[:, None] * nearer
    return replace(r, signal=r.signal + change[r.touch])


EFFECTS = (
    Effect("prober_eccentricity", "beside the axis", "before", 0.3, 5.0, turned_beside_axis),
    Effect("prober_eccentricity", "play in the clamp", "before", 0.3, 5.0, play_in_the_clamp),
    Effect("load_offset", "stretched cable", "before", 5.0, 80.0, stretched_cable),
    Effect("load_offset", "zero under contact", "before", 5.0, 80.0, zero_under_contact),
    Effect("load_misalignment", "friction of the guide", "before", 0.1, 0.6, friction_of_the_guide),
    Effect("load_misalignment", "beside the axis", "before", 0.3, 0.8, load_beside_the_axis),
    Effect("blunt_edge", "nicked", "after", 0.5, 4.0, nicked_edge),
    Effect("blunt_edge", "taped", "after", 0.3, 3.0, taped_edge),
    Effect("tangential_load", "unequal polish", "before", 0.1, 1.0, unequal_polish),
    Effect("tangential_load", "talc", "before", 0.1, 1.0, talc_rubs_off),
    Effect("surface_profile", "step at the joint", "before", 0.01, 0.05, halves_that_do_not_meet),
    Effect("surface_profile", "flat from storage", "before", 0.01, 0.05, flat_from_storage),
    Effect("finite_strain", "stiffening", "after", 0.3, 1.5, stiffening),
    Effect("finite_strain", "sinking surface", "after", 0.5, 3.0, sinking_surface),
)
