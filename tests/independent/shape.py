"""What a finger that was made by hand has in its shape: a surface out of round."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .effects import Effect
from .finger import Recording

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
