"""Forms of the body and of the elements in the third blind study. None is in an earlier registry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_waves import felt_by
from .effects import Effect
from .elements import turn_deg
from .finger import MODES, Recording


def oil_drop(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A drop of oil swells the rubber where it fell, and spreads: a bell that grows wider and lower with time.

    The share is value (5°/w) exp(-(x/w)²/2), x the angle from the drop, w² = (5°)² + (10°)² t/T, T the whole time:
    diffusion from a point (Crank, The Mathematics of Diffusion, 1975, chapter 2). `value` is the share at first.
    """
    x = (r.commanded - rng.uniform(-15, 15))[r.touch]
    wide = np.sqrt(25 + 100 * r.time / r.time[-1])
    more = 5 / wide * np.exp(-0.5 * (x / wide) ** 2)
    return replace(r, signal=r.signal * (1 + value * more)[:, None])


def plug_with_halo(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A sprue was filled with softer rubber: readings over it are more, and less in a halo where the rubber is drawn.

    The share is value (1 - x²) exp(-x²/2), x = (θ - θ_0)/7°. Around an inclusion that shrank as it cured the strain has
    the other sign than in it (Eshelby, 1957, doi:10.1098/rspa.1957.0133).
    """
    x = (r.commanded - rng.uniform(-15, 15)) / 7
    more = (1 - x**2) * np.exp(-0.5 * x**2)
    return replace(r, signal=r.signal * (1 + value * more[r.touch])[:, None])


def straight_strips(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are straight strips in a round layer: their ends lie nearer to the surface than their middles.

    Lengths are from 0.6 to 1.4 times `value` mm. At the distance x from its middle a strip is at the radius
    √(r_s² + x²) and at the angle atan(x/r_s) beside it; it feels the mean at 12 places. A chord of a circle.
    """
    finger = r.finger
    length = value * rng.permutation(np.linspace(0.6, 1.4, len(r.peak)))
    signal = np.zeros((len(r.tip), len(r.peak)))
    for s in (np.arange(12) + 0.5) / 12 - 0.5:
        x = s * length
        angle, depth = finger.angle + np.degrees(np.arctan(x / finger.depth)), np.hypot(finger.depth, x)
        signal += replace(finger, angle=angle, depth=depth).signal(r.press) / 12
    return replace(r, signal=r.signal + (signal - finger.signal(r.press))[r.touch])


def uneven_mix(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are strips of filled rubber, `value` mm long, in which the filler is unevenly mixed.

    Each of six parts has a weight of its own, log-normal with sd 0.8; an element's angle is the middle of its response.
    Conduction near the percolation threshold depends on the filler to a high power (Kirkpatrick, 1973,
    doi:10.1103/RevModPhys.45.574).
    """
    share = np.exp(0.8 * rng.standard_normal((len(r.peak), 6)))
    share /= share.sum(axis=1, keepdims=True)
    s = (np.arange(6) + 0.5) / 6
    along = value * (s - share @ s[:, None]) / r.finger.depth[:, None]
    # each part is a running mean over its own length
    k = np.arange(MODES)[:, None]
    part = np.sinc(k * value / 6 / r.finger.depth / (2 * np.pi))
    turn = k[:, :, None] * along
    return felt_by(r, part * (np.cos(turn) * share).sum(axis=2), part * (np.sin(turn) * share).sum(axis=2))


def crossbar(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are wired as a crossbar with rows of four: current takes ways round through those on the same lines.

    Each reads `value` of the others in its row, and half of that from those in its column. Sneak paths of resistive
    arrays without diodes (Saxena, Bhan and Aggrawal, 2009, on resistive sensor arrays).
    """
    at = np.arange(len(r.peak))
    row, column = (np.equal.outer(line, line) & ~np.eye(len(at), dtype=bool) for line in (at // 4, at % 4))
    return replace(r, signal=r.signal + value * r.signal @ (row + 0.5 * column))


def shadowed_gratings(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are gratings along one fibre: those that come first take light from those behind when they are strained.

    Each reads y (1 - v S), S the sum of x = |y|/peak of all elements before it in the table, v = `value`. Shadowing of
    gratings in series (Kersey and others, Fiber Grating Sensors, 1997, doi:10.1109/50.618377).
    """
    x = np.abs(r.signal) / r.peak
    before = np.cumsum(x, axis=1) - x
    return replace(r, signal=r.signal * (1 - value * before))


def interleaved(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The multiplexer reads channels 1, 3, 5 ... and then 2, 4, 6 ...: what is left is of the second neighbour.

    The share `value` of the step from the channel that was read before, one step back alone. Scan lists are set so in
    order to keep neighbours apart in time.
    """
    m = len(r.peak)
    order = np.concatenate([np.arange(0, m, 2), np.arange(1, m, 2)])
    scan = r.signal[:, order].ravel()
    step = np.diff(scan, prepend=scan[0]).reshape(r.signal.shape)
    signal = r.signal.copy()
    signal[:, order] -= value * step
    return replace(r, signal=signal)


def slow_to_fall(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The sample-and-hold charges through a diode and falls through a resistor: it rises at once, and falls slowly.

    After a higher channel the share `value` of the step down is left, and of that again in the next one. Peak detectors
    do this (Horowitz and Hill, The Art of Electronics, 2015, chapter 4).
    """
    scan = r.signal.ravel()
    out, kept = np.empty_like(scan), scan[0]
    for i, each in enumerate(scan):
        kept = each + value * max(kept - each, 0.0)
        out[i] = kept
    return replace(r, signal=out.reshape(r.signal.shape))


def line_over_ground(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Tips are long bars at a voltage, over a grounded core: elements feel ln(1 + 4 h²/(a² + d²)), at any load.

    d is the chord from the element to the tip, a = 3 mm the size of the bar, h = 6 mm its height; scaled to `value` of
    the peak right below. A line charge and its image (Jackson, Classical Electrodynamics, 1999, section 2.1).
    """
    chord = 2 * r.finger.body.outer * np.sin(np.radians(np.abs(turn_deg(r))) / 2)
    near = np.log1p(4 * 6.0**2 / (3.0**2 + chord**2)) / np.log1p(4 * 6.0**2 / 3.0**2)
    return replace(r, signal=r.signal + value * r.peak * near[r.touch])


def eddy_currents(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Tips are of metal, and elements are small coils: eddy currents take from their field, most under blunt tips.

    1/(1 + (d/8 mm)²)³, d the chord from element to tip: out as a dipole and back, the sixth power of the distance. The
    amount is `value` of the peak times 0.15 + 0.85 r_c/(8 mm + r_c). At any load.
    """
    chord = 2 * r.finger.body.outer * np.sin(np.radians(np.abs(turn_deg(r))) / 2)
    radius = np.minimum(r.tip, 1e9)
    metal = 0.15 + 0.85 * radius / (8 + radius)
    near = metal[:, None] * (1 + (chord / 8) ** 2) ** -3.0
    return replace(r, signal=r.signal - value * r.peak * near[r.touch])


EFFECTS = (
    Effect("soft_spot", "oil drop", "after", 0.1, 0.9, oil_drop),
    Effect("soft_spot", "plug with halo", "after", 0.1, 0.9, plug_with_halo),
    Effect("aperture", "straight strips", "after", 2.0, 5.0, straight_strips),
    Effect("aperture", "uneven mix", "after", 2.0, 6.0, uneven_mix),
    Effect("crosstalk", "crossbar", "after", 0.02, 0.4, crossbar),
    Effect("crosstalk", "shadowed gratings", "after", 0.02, 0.4, shadowed_gratings),
    Effect("channel_lag", "interleaved", "after", 0.03, 0.4, interleaved),
    Effect("channel_lag", "slow to fall", "after", 0.03, 0.6, slow_to_fall),
    Effect("proximity", "line over ground", "after", 0.02, 0.5, line_over_ground),
    Effect("proximity", "eddy currents", "after", 0.02, 0.5, eddy_currents),
)
