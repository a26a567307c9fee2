"""What a finger and tips that are made by hand add to the strains: a core, a prober and tips that are not as designed.

Four causes, each with one amount: a core off centre, an axis of the prober off centre, tips that are tilted along the
finger, and tips that are turned about their normal. The first two are of first order in the amount (the core by finite
differences of the annulus and of the contact), the others of all orders. Strains are in % of each element's peak under
an edge.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bayestouch.body.annulus import solve_annulus
from bayestouch.contact.hertz import elliptic_spectrum
from nicolson_fearing.finger_errors import AT, EDGES_DEG, Added
from nicolson_fearing.linear_finger import FINGERS, LinearFinger
from nicolson_fearing.linear_touches import LOAD, MODES, R_A, R_B, best_ellipse, felt
from nicolson_fearing.paper_finger import POISSON_RATIO
from nicolson_fearing.paper_run import TIPS_MM
from nicolson_fearing.unknowns import Unknowns

FloatArray = NDArray[np.float64]

OFF_CENTRE_MM = 0.2
"""Of the core; as all amounts of this file as in docs/made_by_hand.md, since the paper says nothing."""
TILT_LOAD, TURN = 5.0, 0.05
"""Standard deviations over tips: N/m more in the plane of the elements, and slope of the tip to the axis (3°)."""
LENGTH_MM, BESIDE_MM = 2.0, 1.0
"""Half the length of the elements along the axis, and the distance of their middle from that of the tips."""
_GAUSS, _SHARES = np.array([-0.775, 0.0, 0.775]), np.array([5, 8, 5]) / 18  # points and weights of a mean over a length
_STEP_MM = 0.02


Cause = Callable[[LinearFinger, Unknowns, FloatArray, np.random.Generator], Added]


def nothing(finger: LinearFinger) -> Added:
    """No cause."""
    return Added.none(len(finger.levels))


def pressures(u: Unknowns, radii_mm: FloatArray, load: FloatArray | float = 1.0, core_mm: float = R_A) -> FloatArray:
    """Best elliptic pressures of tips under a load (1: 200 N/m), by mode: (tips, modes)."""
    kappa = LOAD / 1000 * load * radii_mm / u.modulus_MPa
    width, factor = best_ellipse(kappa, u.poisson_ratio, u.length_mm, core_mm)
    return np.asarray((load * factor)[:, None] * elliptic_spectrum(width / R_B, MODES))


def responses(sensing_radius_mm: FloatArray, core_radius_mm: float, nominal_mm: FloatArray) -> FloatArray:
    """Responses (m, modes) of elements at these radii, over the peak of those at nominal radii on the designed core."""

    def strain(radius: FloatArray, core: float) -> FloatArray:
        solved = solve_annulus(MODES, core_radius_mm=core, outer_radius_mm=R_B, poisson_ratio=POISSON_RATIO)
        return np.asarray(np.where(MODES == 0, 1.0, 2.0) * solved.radial_strain(radius))

    return np.asarray(strain(sensing_radius_mm, core_radius_mm) / strain(nominal_mm, R_A).sum(axis=1, keepdims=True))


def core_off_centre(off_centre_mm: float) -> Cause:
    """The core is off centre: under each touch the layer is as thick as it is there, and elements go with the core."""

    def cause(finger: LinearFinger, u: Unknowns, radii_mm: FloatArray, rng: np.random.Generator) -> Added:
        phase = rng.uniform(-90, 90)
        place, element = (off_centre_mm * np.cos(np.radians(a - phase)) for a in (EDGES_DEG, finger.angle_deg))
        by_core, by_depth = slopes_of_layer(finger)
        off = 100 * (place[:, None, None] * by_core + element[:, None] * by_depth)
        cos, _ = finger.turns
        # the width of a contact is interpolated: a step as large as a likely amount is the smoothest
        wider, narrower = (pressures(u, radii_mm, core_mm=R_A + s * OFF_CENTRE_MM) for s in (1, -1))
        by_thickness = (wider - narrower) / (2 * OFF_CENTRE_MM)
        tips = felt(cos[AT] * off[AT], pressures(u, radii_mm))
        tips += felt(100 * cos[AT] * finger.weights, by_thickness) * place[AT][:, None]
        return replace(nothing(finger), edges=(cos * off).sum(axis=-1), tips=tips)

    return cause


@lru_cache(maxsize=FINGERS)
def slopes_of_layer(finger: LinearFinger) -> tuple[FloatArray, FloatArray]:
    """Changes of the elements' responses (m, modes) by a mm of the core's radius, and of the elements' own."""
    at, step = finger.sensing_radius_mm, _STEP_MM
    by_core = (responses(at, R_A + step, at) - responses(at, R_A - step, at)) / (2 * step)
    return by_core, (responses(at + step, R_A, at) - responses(at - step, R_A, at)) / (2 * step)


def prober_off_centre(rms_deg: float) -> Cause:
    """Locations are off by a sine over one turn; its rms over the turn, degree."""

    def cause(finger: LinearFinger, u: Unknowns, radii_mm: FloatArray, rng: np.random.Generator) -> Added:
        location = np.sqrt(2) * rms_deg * np.sin(np.radians(EDGES_DEG - rng.uniform(-180, 180)))
        # where a tip really is does not change what its fit finds: it counts as an error of location
        return replace(nothing(finger), edges=location[:, None] * finger.by_degree, location_deg=location)

    return cause


def tilted_tips(finger: LinearFinger, u: Unknowns, radii_mm: FloatArray, rng: np.random.Generator) -> Added:
    """Each tip, the edge of the calibration too, presses more or less in the plane of the elements."""
    load = 1 + TILT_LOAD / LOAD * rng.standard_normal(len(TIPS_MM))
    cos, _ = finger.turns
    more = pressures(u, radii_mm, load) - pressures(u, radii_mm)
    edges = 100 * (load[0] - 1) * (cos * finger.weights).sum(axis=-1)
    return replace(nothing(finger), edges=edges, tips=felt(100 * cos[AT] * finger.weights, more))


def turned_tips(finger: LinearFinger, u: Unknowns, radii_mm: FloatArray, rng: np.random.Generator) -> Added:
    """Each tip, the edge of the calibration too, is turned: along their length the elements feel it at other angles."""
    slope = TURN * rng.standard_normal((len(TIPS_MM), 1, 1))
    turn = slope * (BESIDE_MM + LENGTH_MM * _GAUSS[:, None]) / R_B * MODES
    even, odd = ((_SHARES[:, None] * wave(turn)).sum(axis=1) for wave in (np.cos, np.sin))
    cos, sin = (100 * each * finger.weights for each in finger.turns)
    spectrum = pressures(u, radii_mm)
    tips = felt(cos[AT], (even - 1) * spectrum) - felt(sin[AT], odd * spectrum)
    edges = (cos * (even[0] - 1) - sin * odd[0]).sum(axis=-1)
    return replace(nothing(finger), edges=edges, tips=tips)
