"""Blind forms of the rig and of the contact. Formulas differ from those of `rig`, `shape` and `catalogue_finger`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_waves import edges_with, half_width, indentation, thinner
from .catalogue_finger import finite_strain
from .effects import Effect
from .finger import MODES, Recording


def descent_beside_centre(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A tip comes down along a line that passes the centre of the finger at a distance e sin(θ - φ).

    The centre of a round tip is r_b + r_c away from that of the finger when they touch, so that the contact lies
    asin(e sin(θ - φ)/(r_b + r_c)) beside the commanded place: most for an edge, nowhere for a flat. `value` is the
    error of an edge, degree. Plane geometry of two circles.
    """
    outer, phase = r.finger.body.outer, rng.uniform(-np.pi, np.pi)
    share = np.where(np.isinf(r.tip), 0.0, outer / (outer + np.where(np.isinf(r.tip), 0.0, r.tip)))
    beside = np.radians(value) * np.sin(np.radians(r.commanded) - phase) * share
    return replace(r, press=replace(r.press, angle=r.press.angle + np.degrees(np.arcsin(beside))))


def bearing_cage(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """An eccentric axis on a ball bearing: value (sin(θ - φ) + 0.4 sin(0.42 θ - ψ)), degree.

    The cage of a ball bearing turns at about 0.4 of the speed of the shaft, and balls of unequal size move the axis
    with it (Slocum, Precision Machine Design, 1992).
    """
    turn, phase = np.radians(r.commanded), rng.uniform(-np.pi, np.pi, 2)
    error = np.sin(turn - phase[0]) + 0.4 * np.sin(0.42 * turn - phase[1])
    return replace(r, press=replace(r.press, angle=r.press.angle + value * error))


def weight_of_tips(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The force sensor was set to zero without a tip, and carries the weight of each, N/m: `value`, sd 10 % over tips.

    Tips differ in mass. Weight per length of a steel tip: density times section times g.
    """
    tips, which = np.unique(r.tip, return_inverse=True)
    weight = value * (1 + 0.1 * rng.standard_normal(len(tips)))[which]
    return replace(r, read_load=r.read_load + weight[r.touch])


def settling_zero(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The zero of the force sensor, `value` N/m, settles by an eighth within five minutes of switching on.

    Self-heating of strain gauges (Doebelin, Measurement Systems, 2003).
    """
    return replace(r, read_load=r.read_load + value * (1 - 0.125 * np.exp(-r.time / 300)))


def projected_load(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The axis of the force sensor is 20° off that of the load, and wobbles by `value` rad over a turn.

    It reads P cos(20° + w sin(θ - φ))/cos(20°), the projection of the load: a second harmonic comes with the first.
    """
    tilt, phase = np.radians(20.0), rng.uniform(-np.pi, np.pi)
    share = np.cos(tilt + value * np.sin(np.radians(r.commanded) - phase)) / np.cos(tilt)
    return replace(r, read_load=r.read_load * share[r.touch])


def yielding_bracket(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The sensor hangs on a bracket that bends: the misalignment cos(θ - 40°) is in proportion to the load.

    At 200 N/m the share is `value`. First-order bending of a cantilever.
    """
    share = value * np.cos(np.radians(r.commanded - rng.choice([-40.0, 40.0]))) * r.press.load / 200
    return replace(r, read_load=r.read_load * (1 + share[r.touch]))


def wedge(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The edge is an obtuse wedge: pressure arcosh(a/|x|), half-width a = `value` mm at 200 N/m, a in proportion to P.

    Johnson, Contact Mechanics (1985), section 5.2. The transform is the mean of sin(q sin u)/(q sin u) over u from 0
    to π/2, q = k a/r_b.
    """
    q = np.arange(MODES) * (value * r.press.load / 200 / r.finger.body.outer)[:, None]
    u = (np.arange(64) + 0.5) * np.pi / 128
    return edges_with(r, np.sinc(q[:, :, None] * np.sin(u) / np.pi).mean(axis=2))


def wearing_edge(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The edge wears while it is used: its radius grows with the root of the touches, up to `value` mm.

    Archard's wear law: the volume, r² times a constant, is in proportion to load and sliding distance.
    """
    edge = r.tip == 0
    used = np.cumsum(edge) / edge.sum()
    return replace(r, press=replace(r.press, tip=np.where(edge, value * np.sqrt(used), r.press.tip)))


def adhesive_friction(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Half of the shear load goes with the load, half with the width of the contact (friction by adhesion).

    Q = μ P + τ 2a: Bowden and Tabor, The Friction and Lubrication of Solids (1950). `value` is the share of a mean
    contact, the sign is drawn.
    """
    width = half_width(r.finger, r.press) / r.press.load
    share = value * rng.choice([-1, 1]) * (0.5 + 0.5 * width / width.mean())
    return replace(r, press=replace(r.press, tangential=r.press.tangential + share))


def swaying_arm(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The arm of the prober drags more on one flank of the finger than on the other: share value (1 + 0.5 sin θ)."""
    share = value * rng.choice([-1, 1]) * (1 + 0.5 * np.sin(np.radians(r.commanded)))
    return replace(r, press=replace(r.press, tangential=r.press.tangential + share))


def lobes(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A surface of four and of seven lobes, as centreless grinding leaves on a mould's core; δκ = value (...), 1/mm.

    Whitehouse, Handbook of Surface and Nanometrology (2010), on lobing. δκ = value (cos(4θ - φ) + 0.6 cos(7θ - ψ)).
    """
    turn, phase = np.radians(r.press.angle), rng.uniform(-np.pi, np.pi, 2)
    course = np.cos(4 * turn - phase[0]) + 0.6 * np.cos(7 * turn - phase[1])
    return replace(r, press=replace(r.press, hump=_no_hollow(r, value * course)))


def parting_line(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A ridge along the parting line of the mould: height h sech²((θ - θ_0)/14°), on a round surface.

    δκ = -(h + h'')/r_b² to first order; `value` is its largest size, 1/mm. θ_0 lies within 15° of the middle.
    """
    turn, width = np.radians(r.press.angle - rng.uniform(-15, 15)), np.radians(14.0)
    shape = 1 / np.cosh(turn / width) ** 2
    second = (4 * shape - 6 * shape**2) / width**2
    bend = -(shape + second) / (2 / width**2 - 1)
    return replace(r, press=replace(r.press, hump=_no_hollow(r, value * bend)))


def hencky_strain(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Strain is large: the rubber is neo-Hookean, and elements read logarithmic strain, -ln(1 - e) in place of e.

    Hencky (1928): layers whose resistance follows their present thickness read the logarithm. `value` is the share of
    both changes; that of the rubber is of the finite-element table.
    """
    finger = r.finger
    strain = np.minimum(finger.signal(r.press) / finger.gain, 0.8)
    change = finite_strain(finger, r.press, value) - value * finger.gain * (np.log1p(-strain) + strain)
    return replace(r, signal=r.signal + change[r.touch])


def compressed_layer(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The layer under the tip is thinner by half of the indentation, over the course of the load.

    First step of an updated Lagrangian (Bathe, Finite Element Procedures, 1996, chapter 6): linear elasticity on the
    geometry half-way; `value` is the share of it. Elements keep their place in the thickness.
    """
    deep = 0.5 * indentation(r.finger, r.press)
    return replace(r, signal=r.signal + thinner(r.finger, r.press, value * deep)[r.touch])


def _no_hollow(r: Recording, hump: np.ndarray) -> np.ndarray:
    """The curvature of the surface stays above half of a round one's, so that tips touch at one place."""
    return np.maximum(hump, -1 / (2 * r.finger.body.outer))


EFFECTS = (
    Effect("prober_eccentricity", "descent beside the centre", "before", 0.5, 5.0, descent_beside_centre),
    Effect("prober_eccentricity", "bearing cage", "before", 0.3, 5.0, bearing_cage),
    Effect("load_offset", "weight of tips", "before", 5.0, 80.0, weight_of_tips),
    Effect("load_offset", "settling zero", "before", 5.0, 80.0, settling_zero),
    Effect("load_misalignment", "projected", "before", 0.1, 0.6, projected_load),
    Effect("load_misalignment", "yielding bracket", "before", 0.1, 0.6, yielding_bracket),
    Effect("blunt_edge", "wedge", "after", 0.3, 2.0, wedge),
    Effect("blunt_edge", "wearing", "before", 0.5, 4.0, wearing_edge),
    Effect("tangential_load", "adhesive", "before", 0.1, 1.0, adhesive_friction),
    Effect("tangential_load", "swaying arm", "before", 0.1, 1.0, swaying_arm),
    Effect("surface_profile", "lobes", "before", 0.005, 0.05, lobes),
    Effect("surface_profile", "parting line", "before", 0.01, 0.05, parting_line),
    Effect("finite_strain", "logarithmic strain", "after", 0.3, 1.5, hencky_strain),
    Effect("finite_strain", "compressed layer", "after", 0.3, 1.5, compressed_layer),
)
