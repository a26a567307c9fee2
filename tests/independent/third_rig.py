"""Forms of the rig and of the contact in the third blind study. None is in an earlier registry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_rig import _no_hollow
from .blind_waves import edges_with, indentation
from .catalogue_finger import finite_strain
from .effects import Effect
from .finger import MODES, Recording


def three_jaws(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A chuck holds the finger beside its axis, and its three jaws are worn: value (sin(θ - φ) + 0.35 sin(3θ - ψ)).

    `value` is the size of the first wave, degree. A shaft that is held in three jaws has a third harmonic of runout
    beside the first one (Whitehouse, Handbook of Surface and Nanometrology, 2010, on roundness).
    """
    turn, phase = np.radians(r.commanded), rng.uniform(-np.pi, np.pi, 2)
    error = np.sin(turn - phase[0]) + 0.35 * np.sin(3 * turn - phase[1])
    return replace(r, press=replace(r.press, angle=r.press.angle + value * error))


def clamped_anew(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The finger was taken out after the calibration and clamped anew: its eccentricity is another one since then.

    The error is value (sin(θ - φ) + sin φ) before, degree, and 0.6 value (sin(θ - ψ) + sin ψ) since; φ and ψ are any.
    It is zero at θ = 0, where the operator turns the finger until its mark is right. Runout differs from clamping to
    clamping (Slocum, Precision Machine Design, 1992).
    """
    first = np.arange(len(r.tip)) < r.parts[0]
    phase = np.where(first, *rng.uniform(-np.pi, np.pi, 2))
    error = np.where(first, 1.0, 0.6) * (np.sin(np.radians(r.commanded) - phase) + np.sin(phase))
    return replace(r, press=replace(r.press, angle=r.press.angle + value * error))


def weight_on_the_arm(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The arm turns round the finger, and the sensor carries the weight of what is between it and the tip.

    It reads P + value cos(θ - φ), `value` the weight over the length of a tip, N/m; φ, within 20°, is the angle at
    which the arm hangs straight down. Plane statics: the part of the weight along the axis of the sensor.
    """
    weight = value * np.cos(np.radians(r.commanded - rng.uniform(-20, 20)))
    return replace(r, read_load=r.read_load + weight[r.touch])


def knocked_sensor(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The force sensor has a wrong zero, `value` N/m, and was knocked once: since then it is 15 % more or less.

    At a time between 30 and 70 % of all. Shocks shift the zero of strain gauge sensors (Doebelin, Measurement Systems,
    2003, on load cells).
    """
    since = r.time > rng.uniform(0.3, 0.7) * r.time[-1]
    return replace(r, read_load=r.read_load + value * (1 + 0.15 * rng.choice([-1, 1]) * since))


def corner_load(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The finger lies on a platform, and the force is off its middle: P (1 + v (u + 0.6 u²)), u = sin(θ - φ).

    `value` is v; φ is within 30°. Scales read a load in a corner wrongly, by a part that is even and one that is odd in
    its distance (OIML R 76, test of eccentric loading).
    """
    u = np.sin(np.radians(r.commanded - rng.uniform(-30, 30)))
    share = value * rng.choice([-1, 1]) * (u + 0.6 * u**2)
    return replace(r, read_load=r.read_load * (1 + share[r.touch]))


def tipping_foot(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The foot of the force sensor is worn, and tips from one rim to the other as the load comes from the other side.

    It reads P (1 + v tanh((θ - θ_0)/18°)), v = `value`, θ_0 within 15°: the lever arm of the load is that of the one or
    of the other rim. Plane statics of a swivel foot.
    """
    over = np.tanh((r.commanded - rng.uniform(-15, 15)) / 18)
    share = value * rng.choice([-1, 1]) * over
    return replace(r, read_load=r.read_load * (1 + share[r.touch]))


def leaning_land(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The edge is worn to a land that leans: its high corner presses most, and heavier loads press more of it.

    What presses is `value` mm wide at 200 N/m, in proportion to the load; pressure is 2 s, s from 0 to 1 at the corner,
    sampled at 16 places. The centre of a load of 200 N/m is where the edge was. A blade that is drawn to one side wears
    on one flank (Archard's law of wear), and contact under a tilted flat grows with the load.
    """
    finger, edge, side = r.finger, (r.tip == 0)[:, None], rng.choice([-1, 1])
    places = (np.arange(16) + 0.5) / 16
    share, wide = places / places.sum(), value * r.press.load / 200
    corner = value * (1 - share @ places)
    signal = np.zeros((len(r.tip), len(r.peak)))
    for s, weight in zip(places, share, strict=True):
        aside = side * np.degrees((corner - wide * (1 - s)) / finger.body.outer)
        signal += weight * finger.signal(replace(r.press, angle=r.press.angle + aside))
    return replace(r, signal=r.signal + np.where(edge, signal - finger.signal(r.press), 0.0)[r.touch])


def dropped_edge(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The blade was dropped after some of its touches: since then its end is crushed, `value` mm wide, and before not.

    It fell after 35 to 65 % of the touches of the edge. A crushed end yields until its pressure is the same everywhere:
    each wave is weighed with sin(q)/q, q = k value/(2 r_b).
    """
    edge = r.tip == 0
    crushed = edge & (np.cumsum(edge) > rng.uniform(0.35, 0.65) * edge.sum())
    q = np.arange(MODES) * value / (2 * r.finger.body.outer)
    return edges_with(r, np.where(crushed[:, None], np.sinc(q / np.pi), 1.0))


def drag_of_the_turn(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The tip does not leave the rubber while the finger turns to the next place, and drags it along.

    The share of shear load is value tanh(Δ/4°), Δ the turn since the touch before: friction builds up over a distance
    before it slides in full (Dahl, 1968, A Solid Friction Model).
    """
    turn = np.diff(r.commanded, prepend=r.commanded[0])
    share = value * np.tanh(turn / 4)
    return replace(r, press=replace(r.press, tangential=r.press.tangential + share))


def pivoted_arm(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The arm turns about a pivot, so that tips move along an arc: the deeper one sinks in, the more it drags.

    The share of shear load is value (d/d_m)^1.5, d the indentation of the touch and d_m its mean over all; the side is
    that of the pivot, which is drawn. Geometry of a lever, with rubber that sticks.
    """
    deep = indentation(r.finger, r.press)
    share = value * rng.choice([-1, 1]) * (deep / deep.mean()) ** 1.5
    return replace(r, press=replace(r.press, tangential=r.press.tangential + share))


def facets(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The mould was printed with 16 facets: flat between corners that sanding made round, a wave of sharp crests.

    δκ = value (g - m)/(1 - m), 1/mm, g = exp(3 (cos(16 (θ - θ_0)) - 1)), m its mean over a turn; `value` is its size at
    a corner. Triangles of a printed model stay to be seen on what is cast from it.
    """
    every = np.exp(3 * (np.cos(np.linspace(0, 2 * np.pi, 720, endpoint=False)) - 1)).mean()
    crest = np.exp(3 * (np.cos(16 * np.radians(r.press.angle - rng.uniform(-11, 11))) - 1))
    course = (crest - every) / (1 - every)
    return replace(r, press=replace(r.press, hump=_no_hollow(r, value * course)))


def oval(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The mould was pressed oval when it was screwed together: the surface is an ellipse of the same area.

    Its curvature less that of the circle, a b/(a² sin² x + b² cos² x)^1.5 - 1/r_b, x the parameter of the ellipse, near
    the angle from its long axis, any. a/b is such that δκ is near ±`value`, 1/mm, at the axes.
    """
    outer = r.finger.body.outer
    a = outer * (1 + value * outer / 3)
    b = outer**2 / a
    x = np.radians(r.press.angle - rng.uniform(-90, 90))
    course = a * b / (a**2 * np.sin(x) ** 2 + b**2 * np.cos(x) ** 2) ** 1.5 - 1 / outer
    return replace(r, press=replace(r.press, hump=_no_hollow(r, course)))


def green_strain(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Strain is large: the rubber is neo-Hookean, and elements read Green's strain, e - e²/2 in place of e.

    Elements whose light or field goes with the square of their length read (1 - λ²)/2, λ = 1 - e (Bathe, Finite Element
    Procedures, 1996). `value` is the share of both changes; that of the rubber is of the finite-element table.
    """
    finger = r.finger
    strain = finger.signal(r.press) / finger.gain
    change = finite_strain(finger, r.press, value) - value * finger.gain * strain**2 / 2
    return replace(r, signal=r.signal + change[r.touch])


def carried_elements(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are carried towards the core as the rubber yields, and feel the strain of the place where they come to.

    They sink by value e (r_s - r_a)/2, e the strain that they feel and r_a the core's radius: the strain below is
    half of that on average. The rubber stretches, too, by the share `value` of the finite-element table. Strain of
    Euler in place of Lagrange, to first order.
    """
    finger, step = r.finger, 0.05
    felt = finger.signal(r.press)
    out, inwards = (replace(finger, depth=finger.depth + side).signal(r.press) for side in (step, -step))
    sunk = value * felt / finger.gain * (finger.depth - finger.body.core) / 2
    change = finite_strain(finger, r.press, value) - sunk * (out - inwards) / (2 * step)
    return replace(r, signal=r.signal + change[r.touch])


EFFECTS = (
    Effect("prober_eccentricity", "three jaws", "before", 0.3, 5.0, three_jaws),
    Effect("prober_eccentricity", "clamped anew", "before", 0.3, 5.0, clamped_anew),
    Effect("load_offset", "weight on the arm", "before", 5.0, 80.0, weight_on_the_arm),
    Effect("load_offset", "knocked", "before", 5.0, 80.0, knocked_sensor),
    Effect("load_misalignment", "corner load", "before", 0.1, 0.6, corner_load),
    Effect("load_misalignment", "tipping foot", "before", 0.1, 0.6, tipping_foot),
    Effect("blunt_edge", "leaning land", "after", 0.5, 4.0, leaning_land),
    Effect("blunt_edge", "dropped", "after", 0.5, 4.0, dropped_edge),
    Effect("tangential_load", "drag of the turn", "before", 0.1, 1.0, drag_of_the_turn),
    Effect("tangential_load", "pivoted arm", "before", 0.1, 1.0, pivoted_arm),
    Effect("surface_profile", "facets", "before", 0.01, 0.05, facets),
    Effect("surface_profile", "oval", "before", 0.01, 0.05, oval),
    Effect("finite_strain", "Green's strain", "after", 0.3, 1.5, green_strain),
    Effect("finite_strain", "carried along", "after", 0.3, 2.0, carried_elements),
)
