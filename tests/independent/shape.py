"""What a finger and a tip that were made by hand have in their shape.

A surface out of round, a core off centre, a tip that is tilted, of finite length, or that sticks to the rubber.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from .body import Annulus, Response, solve
from .contact import contact_table
from .effects import Effect
from .finger import MODES, Finger, Press, Recording

#: Distance between the bells of a radius, and their standard deviation, degree.
BELL_EVERY, BELL_SD = 6.0, 15.0


def radius_profile(angle_deg: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Height of the surface over a circle, mm, and its first two derivatives over the angle: a sum of normal bells."""
    middles = np.arange(-180, 180, BELL_EVERY)
    turn = (angle_deg[:, None] - middles + 180) % 360 - 180
    bell, per_degree = np.exp(-0.5 * (turn / BELL_SD) ** 2), np.degrees(1) / BELL_SD
    place = turn / BELL_SD
    return bell @ heights, (-place * bell * per_degree) @ heights, ((place**2 - 1) * bell * per_degree**2) @ heights


def curvature(angle_deg: np.ndarray, heights: np.ndarray, outer: float) -> np.ndarray:
    """Curvature of the curve r(θ) less 1/r_b, 1/mm: (r² + 2 r'² - r r'')/(r² + r'²)^(3/2)."""
    height, slope, second = radius_profile(angle_deg, heights)
    r = outer + height
    return np.asarray((r**2 + 2 * slope**2 - r * second) / (r**2 + slope**2) ** 1.5 - 1 / outer)


def out_of_round(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The radius of the finger varies; `value` is the rms of the departure of its curvature over the touches, 1/mm."""
    heights, outer = rng.standard_normal(round(360 / BELL_EVERY)), r.finger.body.outer
    everywhere = np.linspace(-90, 90, 361)
    for _ in range(4):
        heights = heights * value / curvature(everywhere, heights, outer).std()
    return replace(r, press=replace(r.press, hump=curvature(r.press.angle, heights, outer)))


def core_off_centre(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The core is `value` mm off centre: under each touch an annulus of the thickness that is there.

    The elements go with the core, and the calibration finds their depths one by one. Signals are interpolated between
    three thicknesses.
    """
    finger, phase = r.finger, rng.uniform(-90, 90)
    moved = value * np.cos(np.radians(r.press.angle - phase))
    depth = finger.depth + value * np.cos(np.radians(finger.angle - phase))
    nodes = np.array([-value, 0.0, value])
    signal = np.zeros((len(r.tip), len(finger.angle)))
    for i, node in enumerate(nodes):
        others = np.delete(nodes, i)
        share = np.prod((moved[:, None] - others) / (node - others), axis=1)
        body = replace(finger.body, core=finger.body.core + node)
        signal += share[:, None] * replace(finger, body=body, depth=depth).signal(r.press)
    return replace(r, signal=signal[r.touch])


def pitched_tip(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Each tip is tilted along the finger: in the plane of the elements it presses with so many N/m more or less.

    A tilt α presses rubber of stiffness k, z mm from the middle of the tip, by k α z more, whatever the load.
    """
    tips, which = np.unique(r.tip, return_inverse=True)
    more = value * rng.standard_normal(len(tips))[which]
    return replace(r, press=replace(r.press, load=r.press.load + more))


def skewed_tip(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Each tip is turned about the normal: elements of 4 mm feel it over `value` times their length, sd over tips.

    Their middles lie 1 mm beside that of the tip.
    """
    tips, which = np.unique(r.tip, return_inverse=True)
    slope = value * rng.standard_normal(len(tips))[which]
    outer = r.finger.body.outer
    along = 1.0 + 2.0 * np.array([-0.775, 0.0, 0.775])  # Gauss points of the length
    signals = [
        weight * r.finger.signal(replace(r.press, angle=r.press.angle + np.degrees(slope * z / outer)))
        for z, weight in zip(along, (5 / 18, 8 / 18, 5 / 18), strict=True)
    ]
    return replace(r, signal=np.sum(signals, axis=0)[r.touch])


def short_tip(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Tips are `value` mm long, and the elements lie under their middle.

    What reaches them of a wave along the arc is that of a bonded flat layer under a load of this length, over that of
    an endless one. The length over which contacts widen is that of an endless tip.
    """
    share = reaching(r.finger.body, float(r.finger.depth.mean()), value)
    return replace(r, signal=_waves(r.finger, r.press, share)[r.touch])


@lru_cache(maxsize=4)
def reaching(body: Annulus, depth: float, length: float) -> np.ndarray:
    """Share of each wave of an endless load that a load of some length gives below its middle, (MODES,)."""
    # a flat layer is one on a core ten times as wide; a load of wave number k alone in the plane answers like any other
    large, modes = 10 * body.outer, np.arange(4, 640, 4)
    layer = replace(body, core=large - (body.outer - body.core), outer=large)
    strain = solve(layer, modes).strain_at(np.array([large - (body.outer - depth)]))[:, 0]
    across = np.linspace(0, modes[-1] / large, 3000)
    window = length * np.sinc(across * length / (2 * np.pi)) / np.pi
    along = np.arange(MODES) / body.outer
    known = np.concatenate([[0.0], modes / large])
    answer = np.concatenate([[strain[0] * 0], strain])

    def transfer(k: np.ndarray) -> np.ndarray:
        return np.interp(k, known, answer, right=0.0)

    total = np.trapezoid(window * transfer(np.hypot(along[:, None], across)), across, axis=1)
    endless = transfer(along)
    return np.where(np.abs(endless) > 1e-4 * np.abs(answer).max(), total / np.where(endless == 0, 1, endless), 0.0)


def sticking_tip(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Tips hold the rubber: shear tractions keep it from sliding, `value` of what would stop it (1: none slides)."""
    finger, press, k = r.finger, r.press, np.arange(MODES)
    body, outer, weight = finger.body, finger.body.outer, np.where(k == 0, 1.0, 2.0)
    normal, shear = _solved(body, "normal"), _solved(body, "shear")
    kappa = press.load / 1000 / finger.modulus / (1 / outer + 1 / np.maximum(press.tip, 1e-9))
    spectrum = contact_table(body, MODES).spectrum(np.where(press.tip == 0, 0.0, kappa))
    half = 2.1 * np.sqrt(np.maximum(2 * (1 - spectrum[:, 1]), 0))
    touch, place = np.radians(press.angle)[:, None] * k, np.radians(finger.angle) * k[:, None]
    added = np.zeros_like(spectrum)
    node = np.cos(np.pi * (np.arange(24) + 0.5) / 24)
    inside, quadrature = node[:12], np.pi / 24 * np.sqrt(1 - node**2)
    for i, a in enumerate(half):
        if a < 0.01:
            continue
        # odd tractions on the contact, their waves, and how far they move the rubber
        shapes = np.stack([node ** (2 * j + 1) * np.sqrt(1 - node**2) for j in range(4)])
        waves = (shapes * quadrature) @ np.sin(np.outer(a * node, k)) * a
        at = np.sin(np.outer(a * inside, k))
        moved, free = at @ (weight * shear.slip * waves).T, at @ (weight * normal.slip * -spectrum[i])
        added[i] = -value * np.linalg.lstsq(moved, free, rcond=1e-8)[0] @ waves
    # a traction sin kφ strains by that of sin kθ, which turns with the touch like a normal one
    strain = weight[:, None] * shear.strain_at(finger.depth)
    more = (added * np.cos(touch)) @ (strain * np.cos(place)) + (added * np.sin(touch)) @ (strain * np.sin(place))
    scale = press.load / 1000 / finger.modulus / (2 * np.pi * outer)
    # compression counts as positive, tractions outwards and towards larger angles
    return replace(r, signal=r.signal - (finger.gain * scale[:, None] * more)[r.touch])


@lru_cache(maxsize=4)
def _solved(body: Annulus, traction: str) -> Response:
    return solve(body, np.arange(MODES), traction)


def _waves(finger: Finger, press: Press, share: np.ndarray) -> np.ndarray:
    """Signal (t, m) with each wave multiplied by a share (MODES,)."""
    k, outer = np.arange(MODES), finger.body.outer
    kappa = press.load / 1000 / finger.modulus / (1 / outer + 1 / np.maximum(press.tip, 1e-9))
    spectrum = contact_table(finger.body, MODES).spectrum(np.where(press.tip == 0, 0.0, kappa)) * share
    touch, element = np.radians(press.angle)[:, None] * k, np.radians(finger.angle) * k[:, None]
    normal = np.where(k == 0, 1.0, 2.0)[:, None] * _solved(finger.body, "normal").strain_at(finger.depth)
    cosine, sine = spectrum * np.cos(touch), spectrum * np.sin(touch)
    strain = cosine @ (normal * np.cos(element)) + sine @ (normal * np.sin(element))
    scale = press.load / 1000 / finger.modulus / (2 * np.pi * outer)
    return np.asarray(finger.gain * scale[:, None] * strain)


EFFECTS = (
    Effect(
        "surface_profile",
        "bells in the radius",
        "before",
        0.0084,
        0.05,
        out_of_round,
        in_catalogue=False,
        reason="the catalogue's curvature is a spline through knots 9° apart",
    ),
)
#: What else a finger made by hand, and its tips, have: at common values, for `studies/made_by_hand.py`.
MADE_BY_HAND = (
    Effect("core_off_centre", "", "after", 0.2, 1.0, core_off_centre, listed=False),
    Effect("pitched_tip", "", "before", 5.0, 30.0, pitched_tip, listed=False),
    Effect("skewed_tip", "", "after", 0.05, 0.3, skewed_tip, listed=False),
    Effect("short_tip", "", "after", 4.0, 40.0, short_tip, listed=False),
    Effect("sticking_tip", "", "after", 1.0, 1.0, sticking_tip, listed=False),
)
