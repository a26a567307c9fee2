"""What may make errors of a place: loads and surfaces that act through the rubber, fine E maps, and the touch itself.

The rubber lets no more than its frequency response through (4.5 cycles/radian). So an error may change from place to
place as it likes only if it acts as a load does: more of it, a push along the surface, another curvature. If E maps are
linear, and change from place to place in some other way, a tip feels the mean over its contact. Errors that every
element has of its own at each place, and that all tips feel alike (`Unknowns.place_error`), come from neither. Strains
are in % of each element's peak under an edge.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.body.annulus import solve_annulus
from nicolson_fearing.finger_errors import AT, EDGES_DEG, Added, Tables
from nicolson_fearing.linear_finger import LinearFinger
from nicolson_fearing.linear_touches import LOAD, MODES, R_A, R_B, best_ellipse, felt
from nicolson_fearing.made_by_hand_causes import Cause, core_off_centre, nothing, pressures
from nicolson_fearing.paper_finger import LOCATIONS_DEG, POISSON_RATIO
from nicolson_fearing.unknowns import Unknowns

FloatArray = NDArray[np.float64]

CURVATURE_LENGTH_DEG = 10.0
"""Over which the curvature changes, as in `studies/surface_profile.py`; the tables of 1995 say nothing of it."""
LOAD_STEP = 0.1  # a share of the load: contacts are interpolated, and a likely amount is the smoothest
STREAM = 13  # of random numbers


def load_by_place(percent: float) -> Cause:
    """More or less of the load reaches the rubber."""

    def cause(finger: LinearFinger, u: Unknowns, radii_mm: FloatArray, rng: np.random.Generator) -> Added:
        more = percent * rng.standard_normal(len(EDGES_DEG))
        by_mode = finger.turns[0] * finger.weights
        larger, smaller = (pressures(u, radii_mm, 1 + s * LOAD_STEP) for s in (1, -1))
        by_load = (larger - smaller) / (2 * LOAD_STEP)
        tips = felt(by_mode[AT], by_load) * more[AT][:, None]
        return replace(nothing(finger), edges=by_mode.sum(axis=-1) * more[:, None], tips=tips)

    return cause


def pushed_along(percent: float) -> Cause:
    """A part of the load acts along the surface: the surface is not at a right angle to the load, or holds the tip."""

    def cause(finger: LinearFinger, u: Unknowns, radii_mm: FloatArray, rng: np.random.Generator) -> Added:
        push = percent * rng.standard_normal(len(EDGES_DEG))
        by_mode = -finger.turns[1] * push_weights(finger)
        tips = felt(by_mode[AT], pressures(u, radii_mm)) * push[AT][:, None]
        return replace(nothing(finger), edges=by_mode.sum(axis=-1) * push[:, None], tips=tips)

    return cause


def curved(per_mm: float) -> Cause:
    """The surface is not round: its curvature adds to that of the tips, and edges do not see it."""

    def cause(finger: LinearFinger, u: Unknowns, radii_mm: FloatArray, rng: np.random.Generator) -> Added:
        off = LOCATIONS_DEG[:, None] - LOCATIONS_DEG
        covariance = np.exp(-0.5 * (off / CURVATURE_LENGTH_DEG) ** 2) + 1e-9 * np.eye(len(off))
        drawn = np.linalg.cholesky(covariance) @ rng.standard_normal(len(off))
        return replace(nothing(finger), curvature_per_mm=per_mm * drawn)

    return cause


def fine_maps(percent: float) -> Cause:
    """Every element's E map changes from place to place, too fast for a fitted or identified map to follow."""

    def cause(finger: LinearFinger, u: Unknowns, radii_mm: FloatArray, rng: np.random.Generator) -> Added:
        errors = percent * own_errors(finger, u, (len(EDGES_DEG),), rng)
        return replace(nothing(finger), edges=errors, tips=contact_shares(u, radii_mm) @ errors)

    return cause


def contact_shares(u: Unknowns, radii_mm: FloatArray) -> FloatArray:
    """Share of each tip's load that presses on the places of the edges, (tips, places, edges)."""
    width, load = best_ellipse(LOAD / 1000 * radii_mm / u.modulus_MPa, u.poisson_ratio, u.length_mm)
    off = R_B * np.radians(LOCATIONS_DEG[:, None] - EDGES_DEG)
    # an edge, or a contact that is narrower than the steps, presses on one place
    pressed = np.maximum(width, R_B * np.radians(1.0))[:, None, None]
    share = np.sqrt(np.maximum(1 - (off / pressed) ** 2, 0.0))
    return np.asarray(share * (load[:, None] / share.sum(axis=-1))[..., None])


def each_touch(percent: float) -> Cause:
    """Every element has an error of its own at each touch, whatever the place: no two tips share it."""

    def cause(finger: LinearFinger, u: Unknowns, radii_mm: FloatArray, rng: np.random.Generator) -> Added:
        edges = percent * own_errors(finger, u, (len(EDGES_DEG),), rng)
        tips = percent * own_errors(finger, u, (len(radii_mm), len(LOCATIONS_DEG)), rng)
        return replace(nothing(finger), edges=edges, tips=tips)

    return cause


def own_errors(finger: LinearFinger, u: Unknowns, shape: tuple[int, ...], rng: np.random.Generator) -> FloatArray:
    """White errors of every element, (*shape, m), whose sizes differ by the unknown spread."""
    m = len(finger.levels)
    return np.asarray(u.element_scales(rng.standard_normal(m)) * rng.standard_normal((*shape, m)))


def push_weights(finger: LinearFinger) -> FloatArray:
    """Response to each mode of a push along the surface, over the peak under an edge; (m, modes).

    A push ``cos k(θ - θ_c)`` towards larger angles is a sine that is turned by a quarter of a wave. It causes the
    strain ``sin k(θ - θ_c)`` times these.
    """
    at = finger.sensing_radius_mm
    ring = {"core_radius_mm": R_A, "outer_radius_mm": R_B, "poisson_ratio": POISSON_RATIO}
    peak = np.where(MODES == 0, 1.0, 2.0) * solve_annulus(MODES, **ring).radial_strain(at)
    along = np.where(MODES == 0, 0.0, 2.0) * solve_annulus(MODES, **ring, traction="tangential").radial_strain(at)
    return np.asarray(along / peak.sum(axis=1, keepdims=True))


def causes_of(u: Unknowns) -> tuple[Cause, ...]:
    """What the unknowns say of the surface, the core, fine maps and touches."""
    amounts = {
        load_by_place: u.load_by_place,
        pushed_along: u.push,
        curved: u.curvature_per_mm,
        core_off_centre: u.core_mm,
        fine_maps: u.fine_map,
        each_touch: u.touch_error,
    }
    return tuple(cause(amount) for cause, amount in amounts.items() if amount)


def surface_tables(finger: LinearFinger, u: Unknowns, draw: int = 0) -> Tables:
    """What a finger would print (`LinearFinger.tables`), with its surface and its core."""
    causes = causes_of(u)
    if not causes:
        return finger.tables(u, draw)
    _, radii, _ = finger.drawn(u, draw)
    rng = np.random.default_rng([finger.seed, STREAM, draw])
    return finger.tables(u, draw, sum((cause(finger, u, radii, rng) for cause in causes), nothing(finger)))
