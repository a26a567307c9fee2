"""Effects of the rig and of the contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .effects import Effect
from .finger import Recording


def prober_eccentricity(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """First and second harmonic of the angle, in degrees."""
    turn, phase = np.radians(r.commanded), rng.uniform(-np.pi, np.pi, 2)
    error = np.sin(turn - phase[0]) + 0.3 * np.sin(2 * turn - phase[1])
    return replace(r, press=replace(r.press, angle=r.press.angle + value * error))


def load_offset(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """N/m, breathing by a tenth over half an hour.

    Gains take up the steady part: of what they leave, a tenth is about as much as the rest, a third would be a drift.
    """
    return replace(r, read_load=r.read_load + value * (1 + 0.1 * np.sin(2 * np.pi * r.time / 1800)))


def load_misalignment(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The force sensor reads a component along an axis of its own: a cosine about 25° or -25°."""
    axis = rng.choice([-25.0, 25.0])
    share = value * np.cos(np.radians(r.commanded - axis))
    return replace(r, read_load=r.read_load * (1 + share[r.touch]))


def worn_edge(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The edge is worn to a flat land of half-width `value` mm."""
    return replace(r, press=replace(r.press, land=value))


def round_edge(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The edge is round, radius `value` mm."""
    return replace(r, press=replace(r.press, tip=np.where(r.press.tip == 0, value, r.press.tip)))


def tangential_load(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Friction that grows less than in proportion to the load, as rubber's does."""
    share = value * rng.choice([-1, 1]) * (r.press.load / 200) ** (-1 / 3)
    return replace(r, press=replace(r.press, tangential=r.press.tangential + share))


EFFECTS = (
    Effect(
        "prober_eccentricity",
        "two harmonics",
        "before",
        0.3,
        5.0,
        prober_eccentricity,
        in_catalogue=False,
        reason="the catalogue has the first harmonic of the angle alone",
    ),
    Effect(
        "load_offset",
        "breathing",
        "before",
        5.0,
        80.0,
        load_offset,
        in_catalogue=False,
        reason="the catalogue's offset is constant",
    ),
    Effect(
        "load_misalignment",
        "cosine",
        "before",
        0.1,
        0.6,
        load_misalignment,
        in_catalogue=True,
        reason="1 + a sin θ + b cos θ, as in the catalogue",
    ),
    Effect(
        "blunt_edge",
        "flat land",
        "before",
        0.3,
        1.6,
        worn_edge,
        in_catalogue=False,
        reason="the catalogue's edge is round",
    ),
    Effect(
        "blunt_edge",
        "round",
        "before",
        0.5,
        4.0,
        round_edge,
        in_catalogue=True,
        reason="a radius in place of 0, as in the catalogue",
    ),
    Effect(
        "tangential_load",
        "sublinear",
        "before",
        0.1,
        1.0,
        tangential_load,
        in_catalogue=False,
        reason="the catalogue's friction is in proportion to the load",
    ),
)
