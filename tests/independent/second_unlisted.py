"""Causes of the second blind study that no catalogue lists; none is in `blind_unlisted`, `unlisted` or `shape`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_waves import spectrum, waves
from .effects import Effect
from .finger import MODES, Recording


def backlash(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The drive has play of `value` degree: the finger is half of it behind, on the side from which it was turned.

    Tooth flanks change with the direction of the last turn; a touch at the same angle as the one before keeps its side.
    """
    turn = np.sign(np.diff(r.commanded, prepend=r.commanded[0] - 1))
    for i in np.flatnonzero(turn == 0):
        turn[i] = turn[i - 1]
    return replace(r, press=replace(r.press, angle=r.press.angle - value / 2 * turn))


def loose_element(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Two elements lie loose in a pocket of the rubber, and lie elsewhere in each touch: normal, sd `value` degree.

    To first order in the displacement; the slope of the signal is taken over half a degree to each side.
    """
    finger = r.finger
    ahead, behind = (replace(finger, angle=finger.angle + side).signal(r.press) for side in (0.5, -0.5))
    loose = np.zeros(len(r.peak))
    loose[rng.permutation(len(r.peak) - 2)[:2] + 1] = 1.0
    moved = value * rng.standard_normal((len(r.tip), len(r.peak))) * loose
    return replace(r, signal=r.signal + (moved * (ahead - behind))[r.touch])


def wrong_bit_weights(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The converter's capacitors have wrong sizes: its second and third bits count too much or too little.

    Full scale is 1.25 times the largest signal; the second bit adds `value` of the peak with a sign that is drawn, the
    third half of it with the other sign. Steps in the curve of a converter by successive approximation.
    """
    code = np.clip(r.signal / (1.25 * np.abs(r.signal).max()), 0, 1)
    second, third = (np.floor(code * parts) % 2 for parts in (4, 8))
    wrong = rng.choice([-1, 1]) * (second - 0.5 * third)
    return replace(r, signal=r.signal + value * r.peak * wrong)


def ringing_arm(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The arm swings after it came down: the load is 1 + value cos(2π 1.7 Hz t) exp(-t/0.5 s) times its mean.

    The force sensor has a slow filter, and reads the mean alone. Free vibration of a mass on a damped spring.
    """
    held = r.time - r.time[r.touch * r.n_samples]
    swing = np.cos(2 * np.pi * 1.7 * held) * np.exp(-held / 0.5)
    return replace(r, signal=r.signal * (1 + value * swing)[:, None])


def cable_twist(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The cable of the finger is twisted as the finger turns, and the zero of each wire follows: N_e sin(θ + φ_e).

    Normal N_e, sd `value` of the peak, φ_e any. Capacitance and microphonic charge of a cable change with its twist.
    """
    m = len(r.peak)
    size, phase = value * rng.standard_normal(m), rng.uniform(-np.pi, np.pi, m)
    zero = size * np.sin(np.radians(r.commanded)[:, None] + phase)
    return replace(r, signal=r.signal + (zero * r.peak)[r.touch])


def trapped_air(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Flats and blunt tips (r_c above 10 mm) trap air: a share of their load is carried by a cushion 6 mm wide.

    `value` of the load, with uniform pressure. Air in the pores of a smooth rubber flows out slowly.
    """
    k = np.arange(MODES)
    cushion = np.sinc(k * 6.0 / r.finger.body.outer / (2 * np.pi))
    blunt = (r.tip > 10)[:, None]
    shares = np.where(blunt, cushion - spectrum(r.finger, r.press), 0.0)
    return replace(r, signal=r.signal + value * waves(r.finger, r.press, shares)[r.touch])


def uneven_speed(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Touches are made by hand, some fast and some slow: rubber is stiffer under the fast ones, by normal shares.

    All elements read 1 + value N of their signal, N anew for each touch; the load is read right. Viscoelastic moduli
    grow with the rate (Ferry, Viscoelastic Properties of Polymers, 1980).
    """
    share = value * rng.standard_normal(len(r.tip))
    return replace(r, signal=r.signal * (1 + share)[r.touch][:, None])


def radial_cut(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The rubber has a cut between two elements: what presses on one side is felt less on the other, by `value`.

    Over 2° on each side of the cut the change is gradual. A cut passes pressure, as long as it is closed, but no
    tension.
    """
    inner = np.sort(r.finger.angle)[1:-1]
    gap = rng.integers(len(inner) - 1)
    at = (inner[gap] + inner[gap + 1]) / 2
    across = -np.outer(np.tanh((r.commanded - at) / 2), np.tanh((r.finger.angle - at) / 2))
    return replace(r, signal=r.signal * (1 - value * np.maximum(across, 0))[r.touch])


def sticking_guide(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The guide of the force sensor sticks: it reads `value` N/m less where the load grew from touch to touch.

    And as much more where it fell; changes of less than 10 N/m stick in part. Coulomb's friction.
    """
    change = np.diff(r.press.load, prepend=r.press.load[0])
    return replace(r, read_load=r.read_load - value * np.tanh(change / 10)[r.touch])


def stiff_skin(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A coat of lacquer on the rubber spreads what presses: each wave is weighed with 1/(1 + (k l/r_b)³).

    `value` is l, mm: the length over which a plate on an elastic half-space bends (Timoshenko and Woinowsky-Krieger,
    Theory of Plates and Shells, 1959, chapter 8). The coat is thicker on one side, where it ran: l is 1 ± 0.3 times it.
    """
    lean = 1 + 0.3 * rng.choice([-1, 1]) * np.sin(np.radians(r.commanded))
    q = np.arange(MODES) * (value * lean / r.finger.body.outer)[:, None]
    shares = spectrum(r.finger, r.press) * (1 / (1 + q**3) - 1)
    return replace(r, signal=r.signal + waves(r.finger, r.press, shares)[r.touch])


EFFECTS = tuple(
    Effect(*each, listed=False)
    for each in (
        ("backlash", "", "before", 0.3, 4.0, backlash),
        ("loose_element", "", "after", 0.5, 6.0, loose_element),
        ("wrong_bit_weights", "", "after", 0.02, 0.3, wrong_bit_weights),
        ("ringing_arm", "", "after", 0.05, 0.5, ringing_arm),
        ("cable_twist", "", "after", 0.02, 0.4, cable_twist),
        ("trapped_air", "", "after", 0.05, 0.8, trapped_air),
        ("uneven_speed", "", "after", 0.02, 0.4, uneven_speed),
        ("radial_cut", "", "after", 0.1, 0.9, radial_cut),
        ("sticking_guide", "", "before", 5.0, 60.0, sticking_guide),
        ("stiff_skin", "", "after", 0.4, 2.5, stiff_skin),
    )
)
