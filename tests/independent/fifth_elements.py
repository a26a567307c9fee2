"""Forms of the body and of the elements in the fifth blind study. None is in an earlier registry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import j0

from .blind_waves import felt_by
from .effects import Effect
from .elements import turn_deg
from .finger import MODES, Recording


def pooled_resin(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Resin that did not cure ran down and pooled against a fold of the mould: softer and softer, then hard at once.

    The share is value (1 + x/16°) from x = -16° to 0 and none beyond the fold, which is blurred over 0.7°; x is the
    angle from the fold, on a side that is drawn. A liquid comes to rest as a wedge.
    """
    x = (r.commanded - rng.uniform(-12, 12)) * rng.choice([-1, 1])
    deep = np.clip(1 + x / 16, 0, 1) / (1 + np.exp(np.clip(x / 0.7, -50, 50)))
    return replace(r, signal=r.signal * (1 + value * deep[r.touch])[:, None])


def cures_on(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A spot that was mixed badly is soft at first, and cures on during the measurement until it is as the rest.

    The share is value sech²(x/7°) exp(-1.5 t/T), x the angle from the spot, t the time and T the whole time. First-
    order kinetics of a cure at room temperature.
    """
    x = (r.commanded - rng.uniform(-15, 15)) / 7
    soft = (1 / np.cosh(np.clip(x, -50, 50)) ** 2)[r.touch] * np.exp(-1.5 * r.time / r.time[-1])
    return replace(r, signal=r.signal * (1 + value * soft)[:, None])


def round_coils(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are flat coils of one turn, and feel along the wire: most at the two sides of the ring.

    They were wound on two rods in turn, of 0.55 and 1.35 times `value` mm, first either; each wave is weighed with the
    Bessel function J_0(q), q = k times the radius of the coil over r_s.
    """
    wide = (np.arange(len(r.peak)) + rng.integers(2)) % 2 == 0
    radius = value / 2 * np.where(wide, 1.35, 0.55)
    return felt_by(r, j0(np.arange(MODES)[:, None] * radius / r.finger.depth))


def sensitive_leads(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The leads of the elements, which all go out to one side, feel too, less and less along them: exp(-s/l).

    l is from 0.5 to 1.5 times `value` mm; an element's angle is the middle of what it feels. The mean of exp(i k φ) is
    exp(-i q)/(1 - i q), q = k l/r_s. Doped rubber diffuses along a lead.
    """
    length = value * rng.permutation(np.linspace(0.5, 1.5, len(r.peak)))
    q = np.arange(MODES)[:, None] * length / r.finger.depth
    mean = np.exp(-1j * q) / (1 - 1j * q)
    return felt_by(r, mean.real, rng.choice([-1, 1]) * mean.imag)


def leaky_switches(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Switches of the multiplexer that are off let some current through, each its own amount, into any reading.

    Each element reads Σ v_j y_j of all others, too, v_j from 0 to 2 times `value`. Feedthrough of analogue switches
    (Horowitz and Hill, The Art of Electronics, 2015, chapter 3).
    """
    leak = value * rng.permutation(np.linspace(0.0, 2.0, len(r.peak)))
    coupling = np.outer(leak, np.ones(len(r.peak)))
    np.fill_diagonal(coupling, 0.0)
    return replace(r, signal=r.signal + r.signal @ coupling)


def round_cable(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Wires lie in a round cable, one in the middle and six about it, and so on, in any order: neighbours there couple.

    `value` where wires lie side by side, and value/d³ where they are d diameters apart. Wires between two others shield
    them from each other (Ott, Electromagnetic Compatibility Engineering, 2009).
    """
    m = len(r.peak)
    i, j = (each.ravel() for each in np.mgrid[-6:7, -6:7])
    x, y = i + j / 2, j * np.sqrt(3) / 2
    place = rng.permutation(np.argsort(np.round(x**2 + y**2, 6), kind="stable")[:m])
    apart = np.hypot(x[place][:, None] - x[place], y[place][:, None] - y[place]) + np.eye(m)
    return replace(r, signal=r.signal + value * r.signal @ (apart**-3 - np.eye(m)))


def hurried_scans(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The controller is interrupted now and then, and hurries through the next scan: channels have less time to settle.

    Of the step from the channel before, 2.5 times `value` is left in one scan out of four, and half of `value` in the
    others. Interrupts of a microcontroller that also writes the data.
    """
    scan = r.signal.ravel()
    step = np.diff(scan, prepend=scan[0]).reshape(r.signal.shape)
    share = value * np.where(rng.random(len(r.time)) < 0.25, 2.5, 0.5)
    return replace(r, signal=r.signal - share[:, None] * step)


def straddling_filter(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The converter averages over a window of time that begins before the switch and ends after the next one.

    `value` is the share of the channel before, and half of it that of the channel after. Sinc filters of converters
    that are not started anew when a multiplexer switches.
    """
    scan = r.signal.ravel()
    before, after = np.append(scan[:1], scan[:-1]), np.append(scan[1:], scan[-1:])
    read = scan + value * (before - scan) + value / 2 * (after - scan)
    return replace(r, signal=read.reshape(r.signal.shape))


def glint(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Tips are polished and the room is lit from above: light that they mirror falls on elements at 20° to either side.

    value exp(-((|x| - 20°)/8°)²/2) of the peak, x the angle from element to tip, times 0.3 + 0.7 r_c/(6 mm + r_c): wide
    tips are larger mirrors. At any load. Law of reflection.
    """
    bright = np.exp(-0.5 * ((np.abs(turn_deg(r)) - 20) / 8) ** 2)
    radius = np.minimum(r.tip, 1e9)
    mirror = 0.3 + 0.7 * radius / (6 + radius)
    return replace(r, signal=r.signal + value * r.peak * (mirror[:, None] * bright)[r.touch])


def hall_chips(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are Hall chips that feel the field along the surface, and tips are magnets: opposite on either side.

    value/0.86 times 3 h d/(h² + d²)^2.5 h³ of the peak, d the chord to the tip with its sign, h = 8 mm; chips are
    turned by normal angles of sd 15° and feel the field across, h³ (2 h² - d²)/(h² + d²)^2.5, too. Field of a dipole
    (Jackson, Classical Electrodynamics, 1999, section 5.6). At any load.
    """
    d = 2 * r.finger.body.outer * np.sin(np.radians(turn_deg(r)) / 2) / 8
    along, across = 3 * d * (1 + d**2) ** -2.5, (2 - d**2) * (1 + d**2) ** -2.5
    turned = np.radians(15) * rng.standard_normal(len(r.peak))
    felt = rng.choice([-1, 1]) * (np.cos(turned) * along + np.sin(turned) * across) / 0.86
    return replace(r, signal=r.signal + value * r.peak * felt[r.touch])


EFFECTS = (
    Effect("soft_spot", "pooled resin", "after", 0.1, 0.9, pooled_resin),
    Effect("soft_spot", "cures on", "after", 0.1, 0.9, cures_on),
    Effect("aperture", "round coils", "after", 2.0, 5.0, round_coils),
    Effect("aperture", "sensitive leads", "after", 0.7, 3.0, sensitive_leads),
    Effect("crosstalk", "leaky switches", "after", 0.02, 0.3, leaky_switches),
    Effect("crosstalk", "round cable", "after", 0.03, 0.4, round_cable),
    Effect("channel_lag", "hurried scans", "after", 0.03, 0.4, hurried_scans),
    Effect("channel_lag", "straddling filter", "after", 0.03, 0.4, straddling_filter),
    Effect("proximity", "glint", "after", 0.02, 0.5, glint),
    Effect("proximity", "Hall chips", "after", 0.02, 0.5, hall_chips),
)
