"""Forms of the rig and of the contact in the fourth blind study. None is in an earlier registry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_rig import _no_hollow
from .blind_waves import edges_with, indentation
from .catalogue_finger import finite_strain
from .effects import Effect
from .finger import MODES, Recording


def gear_and_pinion(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The finger sits on a gear, and both the gear and the pinion that drives it run out of true.

    The error is value (sin(θ - φ) + 0.5 sin(2.5 θ - ψ)), degree: the pinion turns 2.5 times as fast. Transmission error
    of eccentric gears.
    """
    turn, phase = np.radians(r.commanded), rng.uniform(-np.pi, np.pi, 2)
    error = np.sin(turn - phase[0]) + 0.5 * np.sin(2.5 * turn - phase[1])
    return replace(r, press=replace(r.press, angle=r.press.angle + value * error))


def loosening_clamp(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The clamp works loose under the touches, and the finger comes to turn further beside its axis.

    The error is value (1 - 0.6 exp(-n/120)) sin(θ - φ), degree, n the touches before. Joints that are loaded again and
    again settle, most at first.
    """
    size = value * (1 - 0.6 * np.exp(-np.arange(len(r.tip)) / 120))
    error = size * np.sin(np.radians(r.commanded) - rng.uniform(-np.pi, np.pi))
    return replace(r, press=replace(r.press, angle=r.press.angle + error))


def return_spring(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A spring that lifts the arm pulls at the force sensor, more the deeper the tip has sunk into the rubber.

    It reads P + value (1 + 0.3 (d/d_m - 1)), d the indentation of the touch and d_m its mean over all: a long spring
    that is stretched already. The side of the pull is drawn. Hooke's law.
    """
    deep = indentation(r.finger, r.press)
    pull = value * rng.choice([-1, 1]) * (0.7 + 0.3 * deep / deep.mean())
    return replace(r, read_load=r.read_load + pull[r.touch])


def tared_anew(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The force sensor is set to zero every 40 touches while the operator leans on the bench: never quite as before.

    The zero is value (1 + 0.12 N) for each 40 touches, N normal, N/m. A repeated setting has a bias and a spread.
    """
    times = np.arange(len(r.tip)) // 40
    zero = value * (1 + 0.12 * rng.standard_normal(times[-1] + 1))[times]
    return replace(r, read_load=r.read_load + zero[r.touch])


def unequal_holders(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Tips hang on holders of unequal length, and long ones give the side force a longer lever.

    The sensor reads P (1 + v w sin(θ - φ)), v = `value`, w from 0.5 to 1.5 over the tips, in random order, φ within
    30°. Statics of a lever.
    """
    tips, which = np.unique(r.tip, return_inverse=True)
    lever = rng.permutation(np.linspace(0.5, 1.5, len(tips)))[which]
    share = value * rng.choice([-1, 1]) * lever * np.sin(np.radians(r.commanded - rng.uniform(-30, 30)))
    return replace(r, read_load=r.read_load * (1 + share[r.touch]))


def string_round_a_post(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A string brings the load round a post, and turning the arm winds it up: P exp(v (θ - θ_0)), θ in rad.

    v = `value` is the coefficient of friction, θ_0 within 15°; the side is drawn. Friction of a rope on a capstan
    (Euler and Eytelwein).
    """
    wound = value * rng.choice([-1, 1]) * np.radians(r.commanded - rng.uniform(-15, 15))
    return replace(r, read_load=r.read_load * np.exp(wound)[r.touch])


def worn_flank(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The edge is rubbed round on one flank, and leans as the arm goes round the finger: one side meets the worn flank.

    Its radius is value/(1 + exp(-(θ - θ_0)/8°)) mm, or from the other side, θ_0 within 10° of the middle. Archard's
    law of wear: a blade that is always wiped the same way slides on one flank.
    """
    side = rng.choice([-1, 1]) * (r.commanded - rng.uniform(-10, 10))
    radius = value / (1 + np.exp(-side / 8))
    return replace(r, press=replace(r.press, tip=np.where(r.tip == 0, radius, r.press.tip)))


def crumbs(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Crumbs of rubber stick to the edge, and are wiped off every 25 touches of it: it grows blunt again and again.

    Its load is spread as a normal bell, of sd `value` mm just before it is wiped, in proportion to the touches since:
    each wave is weighed with exp(-q²/2), q = k sd/r_b.
    """
    edge = r.tip == 0
    since = (np.cumsum(edge) + rng.integers(25)) % 25 / 24
    q = np.arange(MODES) * (value * since / r.finger.body.outer)[:, None]
    return edges_with(r, np.exp(-0.5 * q**2))


def downhill(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A weak arm lets tips go down the flank on which they land, and friction drags the rubber along to that side.

    The share of shear load is value tanh((θ - θ_0)/20°), θ_0 within 15° of the middle, at most what friction holds.
    Coulomb's law.
    """
    share = value * np.tanh((r.commanded - rng.uniform(-15, 15)) / 20)
    return replace(r, press=replace(r.press, tangential=r.press.tangential + share))


def creeping_friction(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A tip drags the rubber as it comes down, and then creeps back: the shear load fades while the touch is held.

    Its share is value (0.3 + 0.7 exp(-t/0.4 s)), t the time since the touch began; the side is drawn. Rubber on steel
    slides slowly under any load (Persson, 2001, doi:10.1063/1.1388626).
    """
    finger, press = r.finger, r.press
    dragged = finger.signal(replace(press, tangential=press.tangential + np.ones(len(r.tip)))) - finger.signal(press)
    held = r.time - r.time[r.touch * r.n_samples]
    share = value * rng.choice([-1, 1]) * (0.3 + 0.7 * np.exp(-held / 0.4))
    return replace(r, signal=r.signal + share[:, None] * dragged[r.touch])


def chatter(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The mould was turned on a lathe that chattered where the tool entered: waves that die out along the cut.

    δκ = value exp(-(θ + 30°)/60°) cos(9 θ - φ), 1/mm, or from the other end. Self-excited vibration of a tool
    (Tobias, Machine Tool Vibration, 1965).
    """
    angle = rng.choice([-1, 1]) * r.press.angle
    course = np.exp(-(angle + 30) / 60) * np.cos(9 * np.radians(angle) - rng.uniform(-np.pi, np.pi))
    return replace(r, press=replace(r.press, hump=_no_hollow(r, value * course)))


def sink_marks(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Rubber shrinks as it cures, and sinks in above each element, which does not shrink: a dent of sd 3° over each.

    δκ = value Σ a_e (x² - 1) exp(-x²/2), 1/mm, x = (θ - θ_e)/3°: the second derivative of a normal bell. Depths a_e are
    from 0.4 to 1.6. Sink marks of moulded parts.
    """
    deep = rng.permutation(np.linspace(0.4, 1.6, len(r.peak)))
    x = (r.press.angle[:, None] - r.finger.angle) / 3
    course = ((x**2 - 1) * np.exp(-0.5 * x**2)) @ deep
    return replace(r, press=replace(r.press, hump=_no_hollow(r, value * course)))


def yielding_network(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Entangled chains slip as the strain grows, and the rubber gives way: Mooney's second constant.

    As if the load were larger by the share value e/(1 + 3 e), e the indentation over the thickness, beside the share
    `value` of the finite-element table (Treloar, The Physics of Rubber Elasticity, 1975, chapter 5).
    """
    finger, thick = r.finger, r.finger.body.outer - r.finger.body.core
    strain = indentation(finger, r.press) / thick
    more = r.press.load * (1 + value * strain / (1 + 3 * strain))
    change = finger.signal(replace(r.press, load=more)) - finger.signal(r.press)
    return replace(r, signal=r.signal + (change + finite_strain(finger, r.press, value))[r.touch])


def tilting_elements(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are tilted by the rubber that flows aside, and a plate that is tilted looks thinner: by ω²/2.

    ω = h/r_s ∂e/∂θ, e the strain that an element feels and h = 3 mm; the cosine of a small angle. The rubber stretches,
    too, by the share `value` of the finite-element table, as of the tilt.
    """
    finger, step = r.finger, 0.25
    ahead, behind = (replace(finger, angle=finger.angle + side).signal(r.press) for side in (step, -step))
    slope = (ahead - behind) / finger.gain / np.radians(2 * step)
    tilt = 3.0 / finger.depth * slope
    change = finite_strain(finger, r.press, value) + value * finger.gain * tilt**2 / 2
    return replace(r, signal=r.signal + change[r.touch])


EFFECTS = (
    Effect("prober_eccentricity", "gear and pinion", "before", 0.3, 5.0, gear_and_pinion),
    Effect("prober_eccentricity", "loosening clamp", "before", 0.3, 5.0, loosening_clamp),
    Effect("load_offset", "return spring", "before", 5.0, 80.0, return_spring),
    Effect("load_offset", "tared anew", "before", 5.0, 80.0, tared_anew),
    Effect("load_misalignment", "unequal holders", "before", 0.1, 0.6, unequal_holders),
    Effect("load_misalignment", "string round a post", "before", 0.1, 0.6, string_round_a_post),
    Effect("blunt_edge", "worn flank", "before", 0.5, 4.0, worn_flank),
    Effect("blunt_edge", "crumbs", "after", 0.5, 3.0, crumbs),
    Effect("tangential_load", "downhill", "before", 0.1, 1.0, downhill),
    Effect("tangential_load", "creeping", "after", 0.1, 1.0, creeping_friction),
    Effect("surface_profile", "chatter", "before", 0.01, 0.05, chatter),
    Effect("surface_profile", "sink marks", "before", 0.01, 0.05, sink_marks),
    Effect("finite_strain", "yielding network", "after", 0.3, 1.5, yielding_network),
    Effect("finite_strain", "tilting elements", "after", 0.3, 2.0, tilting_elements),
)
