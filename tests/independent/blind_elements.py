"""Blind forms of the body and of the elements. Formulas differ from those of `elements` and `catalogue_forms`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import erf

from .blind_waves import felt_by
from .effects import Effect
from .elements import turn_deg
from .finger import MODES, Recording


def patch(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A patch of other rubber, 20° wide, with borders blurred over 3°: erf((θ + 10)/w) - erf((θ - 10)/w).

    A repair that was cast later: its response is the share `value` larger. Borders are blurred by diffusion (Crank, The
    Mathematics of Diffusion, 1975, section 2.2).
    """
    away, blur = r.commanded - rng.uniform(-15, 15), 3.0 * np.sqrt(2)
    inside = (erf((away + 10) / blur) - erf((away - 10) / blur)) / 2
    return replace(r, signal=r.signal * (1 + value * inside[r.touch])[:, None])


def skewed_cure(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Rubber that cured less beside a vent of the mould: steep on one side (5°), slow on the other (20°).

    The share is value exp(-|x|/w) (1 + |x|/w), x the angle from the vent, w of the side: smooth at the vent.
    """
    away = (r.commanded - rng.uniform(-15, 15)) * rng.choice([-1, 1])
    x = np.abs(away) / np.where(away < 0, 5.0 / 2, 20.0 / 2)
    return replace(r, signal=r.signal * (1 + value * (np.exp(-x) * (1 + x))[r.touch])[:, None])


def tapered_aperture(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are strips `value` mm long that taper to a point: weight 2 s along s from 0 to 1, all one way round.

    The centre of the weight, s = 2/3, lies at the angle of the element. A strip that is narrow at one end carries most
    of its resistance there. Sampled at 24 places.
    """
    s = (np.arange(24) + 0.5) / 24
    side, share = rng.choice([-1, 1]), s / s.sum()
    k = np.arange(MODES)[:, None] / r.finger.depth
    along = side * value * (s - (share * s).sum())
    return felt_by(r, np.cos(k[:, :, None] * along) @ share, np.sin(k[:, :, None] * along) @ share)


def uneven_apertures(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements of unequal width, from 0.4 to 1.6 times `value` mm, that feel most at their ends: 1 + (2 s)², |s| < 1/2.

    Sampled at 32 places of the width. A gauge that was stretched over its glue spots.
    """
    width = value * rng.permutation(np.linspace(0.4, 1.6, len(r.peak)))
    s = (np.arange(32) + 0.5) / 64
    weight = (1 + (2 * s) ** 2) / (1 + (2 * s) ** 2).sum()
    k = np.arange(MODES)[:, None] * width / r.finger.depth
    return felt_by(r, np.cos(k[:, :, None] * s) @ weight)


def ribbon(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A flat cable: each wire gets `value`/n² of the signal of the n-th wire beside it, by wires of unequal distance.

    Mutual capacitance of a pair of wires over ground falls with the square of the distance (Ott, Electromagnetic
    Compatibility Engineering, 2009). Coupling is symmetric, log-normal with sd 0.3.
    """
    m = len(r.peak)
    apart = np.abs(np.arange(m)[:, None] - np.arange(m)) + np.eye(m)
    uneven = rng.standard_normal((m, m))
    coupling = np.exp(0.3 * (uneven + uneven.T) / np.sqrt(2)) / apart**2 * (1 - np.eye(m))
    return replace(r, signal=r.signal + value * r.signal @ coupling)


def twisted_pairs(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Wires in pairs: the first leaks into the second and back, `value` each; the next pair gets a quarter of it."""
    m = len(r.peak)
    coupling = np.zeros((m, m))
    for i in range(m - 1):
        coupling[i, i + 1] = coupling[i + 1, i] = 1.0 if i % 2 == 0 else 0.25
    return replace(r, signal=r.signal + value * r.signal @ coupling)


def dielectric_absorption(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The hold capacitor remembers: value (1/n) of the n-th channel before, up to twelve, and gives up as much itself.

    Charge that soaked into a dielectric comes back in proportion to 1/t (Curie and von Schweidler; Horowitz and Hill,
    The Art of Electronics, 2015).
    """
    scan = r.signal.ravel()
    weight = 1 / np.arange(1, 13)
    left = np.convolve(scan, np.concatenate([[0.0], weight]))[: len(scan)] - weight.sum() * scan
    return replace(r, signal=(scan + value * left).reshape(r.signal.shape))


def slewing(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The amplifier slews: what is left of a step from channel to channel grows with its size, |step|^1.5.

    Limited slew rate before linear settling (Horowitz and Hill, 2015). Of a step as high as a peak, the
    share `value` is left.
    """
    scan = r.signal.ravel()
    step = np.diff(scan, prepend=scan[0])
    left = step * np.sqrt(np.abs(step) / r.peak.mean())
    return replace(r, signal=(scan - value * left).reshape(r.signal.shape))


def plate_in_air(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The probe is a point charge over a plate: h³/(h² + d²)^1.5, d the chord from element to probe, h = 5 mm.

    Image charges (Jackson, Classical Electrodynamics, 1999, section 2.2). At any load.
    """
    chord = 2 * r.finger.body.outer * np.sin(np.radians(np.abs(turn_deg(r))) / 2)
    near = (1 + (chord / 5.0) ** 2) ** -1.5
    return replace(r, signal=r.signal + value * r.peak * near[r.touch])


def shadow(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The tip shades the element from the light of the room: cos⁴ of the angle up to 90°, and wide tips shade more.

    Irradiance behind an obstacle, cos⁴ law (Smith, Modern Optical Engineering, 2008). Tips: (4 mm + r_c)/(20 mm + r_c).
    """
    near = np.clip(np.cos(np.radians(turn_deg(r))), 0, None) ** 4
    wide = np.where(np.isinf(r.tip), 1.0, (4 + np.minimum(r.tip, 1e9)) / (20 + np.minimum(r.tip, 1e9)))
    return replace(r, signal=r.signal + value * r.peak * (near * wide[:, None])[r.touch])


EFFECTS = (
    Effect("soft_spot", "patch", "after", 0.1, 0.9, patch),
    Effect("soft_spot", "skewed cure", "after", 0.1, 0.9, skewed_cure),
    Effect("aperture", "tapered", "after", 2.0, 6.0, tapered_aperture),
    Effect("aperture", "uneven, at the ends", "after", 2.0, 5.0, uneven_apertures),
    Effect("crosstalk", "ribbon", "after", 0.05, 0.5, ribbon),
    Effect("crosstalk", "twisted pairs", "after", 0.05, 0.5, twisted_pairs),
    Effect("channel_lag", "dielectric absorption", "after", 0.03, 0.3, dielectric_absorption),
    Effect("channel_lag", "slewing", "after", 0.03, 0.6, slewing),
    Effect("proximity", "plate in air", "after", 0.02, 0.5, plate_in_air),
    Effect("proximity", "shadow", "after", 0.02, 0.9, shadow),
)
