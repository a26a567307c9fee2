"""Causes of the third blind study that no catalogue lists; none is in an earlier registry or in `shape`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_waves import spectrum, waves
from .effects import Effect
from .elements import turn_deg
from .finger import MODES, Recording


def missed_steps(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The stepper motor misses steps: before one touch in 15 it stays behind by `value` degree, and never catches up.

    It is set to its mark anew before each table. Stepper motors without an encoder do not notice a step that is missed.
    """
    missed = (rng.random(len(r.tip)) < 1 / 15).astype(float)
    behind, start = np.zeros(len(r.tip)), 0
    for part in r.parts:
        behind[start : start + part] = np.cumsum(missed[start : start + part])
        start += part
    return replace(r, press=replace(r.press, angle=r.press.angle - value * rng.choice([-1, 1]) * behind))


def warm_column(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The column of the prober bends as its motor warms it: all places move by value (1 - exp(-t/500 s)) degree.

    Thermal bending of a machine frame that is heated on one side (Slocum, Precision Machine Design, 1992).
    """
    time = r.time[:: r.n_samples]
    moved = value * rng.choice([-1, 1]) * -np.expm1(-time / 500)
    return replace(r, press=replace(r.press, angle=r.press.angle + moved))


def bending_core(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The core is a thin tube that bends under the load: all elements are strained, with the cosine of the turn.

    value (P/200) cos(θ - θ_e) of the peak, and 30 % of that as cos 2(θ - θ_e), the tube going oval. Beam theory, and
    ring theory for the second part (Timoshenko, Strength of Materials, 1956).
    """
    turn = np.radians(turn_deg(r))
    wave = (np.cos(turn) + 0.3 * np.cos(2 * turn)) * (r.press.load / 200)[:, None]
    return replace(r, signal=r.signal + value * r.peak * wave[r.touch])


def wrong_steps_per_turn(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The controller has a wrong number of steps in a turn: angles are too large by the share `value`, about 0°.

    All places move away from the middle in proportion to their angle, or towards it. A belt drive whose pulley was
    replaced by one of another make does this.
    """
    share = value * rng.choice([-1, 1])
    return replace(r, press=replace(r.press, angle=r.press.angle * (1 + share)))


def cracked_wire(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The wire of one element is cracked at the clamp: as the finger turns it opens, and the reading loses `value`.

    The reading is y (1 - v/(1 + exp(-(θ - θ_0)/2°))), or on the other side of θ_0, which is within 8° of the element.
    The element is not one at an end. Contact resistance of a crack goes with the bending of the wire.
    """
    which = 1 + rng.integers(len(r.peak) - 2)
    border = r.finger.angle[which] + rng.uniform(-8, 8)
    lost = 1 / (1 + np.exp(-rng.choice([-1, 1]) * (r.commanded - border) / 2))
    signal = r.signal.copy()
    signal[:, which] *= 1 - value * lost[r.touch]
    return replace(r, signal=signal)


def slipping_tips(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Tips slip now and then as they come down: one touch in four lies beside its place, by an exponential amount.

    Its mean is `value` degree; tips slip away from the middle, down the flank of the finger. Coulomb's friction holds
    the others.
    """
    slips = rng.random(len(r.tip)) < 1 / 4
    amount = rng.exponential(value, len(r.tip)) * np.sign(r.commanded)
    return replace(r, press=replace(r.press, angle=r.press.angle + slips * amount))


def overload_stop(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The overload stop of the force sensor touches too early: of what is above 195 N/m it takes the share `value`.

    The sensor reads P - v w ln(1 + exp((P - 195)/w)), w = 4 N/m, as a stop that is not quite plane. Springs in
    parallel.
    """
    taken = value * 4 * np.logaddexp(0, (r.press.load - 195) / 4)
    return replace(r, read_load=r.read_load - taken[r.touch])


def shielding_elements(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are stiff and carry the load of touches right above them: the others then feel less.

    y_e (1 - v Σ exp(-(x_j/2°)²/2)), x_j the angle from the touch to each other element j, v = `value`. A stiff
    inclusion draws stress to itself (Eshelby, 1957, doi:10.1098/rspa.1957.0133).
    """
    over = np.exp(-0.5 * (turn_deg(r) / 2) ** 2)
    others = over.sum(axis=1, keepdims=True) - over
    return replace(r, signal=r.signal * (1 - value * others)[r.touch])


def leaning_elements(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements lean to a side and feel some of the shear, too: normal shares, sd `value`, of q/(1 + q), q = k z/r_b.

    z is the way from the surface to the element: of a line load on a half-plane the normal stress has waves
    (1 + q) exp(-q), the shear q exp(-q) (Johnson, Contact Mechanics, 1985, section 2.2).
    """
    share = value * rng.standard_normal(len(r.peak))
    q = np.arange(MODES)[:, None] * (r.finger.body.outer - r.finger.depth) / r.finger.body.outer
    change = waves(r.finger, r.press, spectrum(r.finger, r.press), 0.0, share * q / (1 + q))
    return replace(r, signal=r.signal + change[r.touch])


def coarse_converter(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A chip in each element has a converter of few bits: readings are rounded to steps of `value` of the peak.

    Noise comes in behind it, so that means over the samples do not help; each chip rounds from a zero of its own.
    Rounding of a signal without dither (Widrow and Kollár, Quantization Noise, 2008).
    """
    step, zero = value * r.peak, rng.random(len(r.peak))
    return replace(r, signal=(np.round(r.signal / step + zero) - zero) * step)


EFFECTS = tuple(
    Effect(*each, listed=False)
    for each in (
        ("missed_steps", "", "before", 0.1, 1.5, missed_steps),
        ("warm_column", "", "before", 0.3, 5.0, warm_column),
        ("bending_core", "", "after", 0.02, 0.4, bending_core),
        ("wrong_steps_per_turn", "", "before", 0.02, 0.2, wrong_steps_per_turn),
        ("cracked_wire", "", "after", 0.2, 0.9, cracked_wire),
        ("slipping_tips", "", "before", 0.3, 4.0, slipping_tips),
        ("overload_stop", "", "before", 0.1, 0.9, overload_stop),
        ("shielding_elements", "", "after", 0.05, 0.9, shielding_elements),
        ("leaning_elements", "", "after", 0.05, 0.9, leaning_elements),
        ("coarse_converter", "", "after", 0.05, 0.4, coarse_converter),
    )
)
