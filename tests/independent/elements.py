"""Effects of the body and of the elements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from .effects import Effect
from .finger import Recording


def turn_deg(r: Recording) -> np.ndarray:
    """Angle from each element to each touch, -180 to 180 degrees, (t, m)."""
    return np.asarray((r.commanded[:, None] - r.finger.angle + 180) % 360 - 180)


def raised_cosine_spot(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """All elements answer more to touches within 18° of a place."""
    away = np.abs(r.commanded - rng.uniform(-15, 15)) / 18
    bump = np.where(away < 1, (1 + np.cos(np.pi * np.minimum(away, 1))) / 2, 0.0)
    return replace(r, signal=r.signal * (1 + value * bump[r.touch])[:, None])


def gaussian_spot(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The same as a narrow Gaussian, sd 5°, and less answer."""
    bump = np.exp(-0.5 * ((r.commanded - rng.uniform(-15, 15)) / 5) ** 2)
    return replace(r, signal=r.signal * (1 - value * bump[r.touch])[:, None])


def triangular_aperture(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements weigh the strain with a triangle of half-width `value` mm."""
    return replace(r, press=replace(r.press, aperture=value))


def unequal_crosstalk(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """More from the one side than from the other, and a quarter from the second neighbours."""
    sides = rng.permutation([0.75, 1.25])
    leak = np.zeros_like(r.signal)
    for reach, share in ((1, 1.0), (2, 0.25)):
        leak[:, reach:] += share * sides[0] * r.signal[:, :-reach]
        leak[:, :-reach] += share * sides[1] * r.signal[:, reach:]
    return replace(r, signal=r.signal + value * leak)


def recursive_lag(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The multiplexer's capacitor settles exponentially, and so keeps something of all channels before."""
    scan = lfilter([1 - value], [1, -value], r.signal.ravel())
    return replace(r, signal=np.asarray(scan).reshape(r.signal.shape))


def two_stage_lag(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Multiplexer and filter behind it settle alike, one after the other: 2h, 3h², 4h³ ... of the channels before."""
    scan = r.signal.ravel()
    for _ in range(2):
        scan = lfilter([1 - value / 2], [1, -value / 2], scan)
    return replace(r, signal=np.asarray(scan).reshape(r.signal.shape))


def lorentzian_proximity(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The probe's body is felt through the air, at any load, over 25° and far tails."""
    near = 1 / (1 + (turn_deg(r) / 25) ** 2)
    return replace(r, signal=r.signal + value * r.peak * near[r.touch])


def hyperbolic_proximity(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A fringe field, round near the element and exponential far from it, that presses on with the fourth root of P."""
    near = 1 / np.cosh(turn_deg(r) / 18) * ((r.press.load / 200) ** 0.25)[:, None]
    return replace(r, signal=r.signal + value * r.peak * near[r.touch])


EFFECTS = (
    Effect(
        "soft_spot",
        "raised cosine",
        "after",
        0.1,
        2.0,
        raised_cosine_spot,
        in_catalogue=True,
        reason="the catalogue's bell follows it, with tails between a parabola's and a normal bell's",
    ),
    Effect(
        "soft_spot",
        "narrow Gaussian",
        "after",
        0.1,
        0.9,
        gaussian_spot,
        in_catalogue=True,
        reason="the catalogue's bell with tails 0",
    ),
    Effect(
        "aperture",
        "triangle",
        "before",
        2.0,
        3.0,
        triangular_aperture,
        in_catalogue=False,
        reason="the catalogue's element is a running mean, a rectangle",
    ),
    Effect(
        "crosstalk",
        "unequal, second neighbours",
        "after",
        0.05,
        0.5,
        unequal_crosstalk,
        in_catalogue=False,
        reason="the catalogue's leak goes on to third neighbours and further",
    ),
    Effect(
        "channel_lag",
        "recursive",
        "after",
        0.03,
        0.6,
        recursive_lag,
        in_catalogue=True,
        reason="the catalogue's lag with `carry` equal to `share`; only the first scan of a touch differs",
    ),
    Effect(
        "channel_lag",
        "two stages",
        "after",
        0.03,
        0.6,
        two_stage_lag,
        in_catalogue=True,
        reason="the catalogue's lag follows it, with a carry of its own",
    ),
    Effect(
        "proximity",
        "Lorentzian",
        "after",
        0.02,
        0.5,
        lorentzian_proximity,
        in_catalogue=True,
        reason="the catalogue's bell with tails 1 and a load power of 0",
    ),
    Effect(
        "proximity",
        "hyperbolic",
        "after",
        0.02,
        0.5,
        hyperbolic_proximity,
        in_catalogue=True,
        reason="the catalogue's bell follows it, with tails between normal and Lorentzian; load power 0.25",
    ),
)
