"""A surface out of round: its curvature between knots, and what touches make of it."""

from __future__ import annotations

import pickle

import numpy as np
from known_fingers import true_chain
from scipy.interpolate import make_interp_spline

from bayestouch.chain.surface import LEAST_SHARE, Profile, profile_basis

KNOTS = (-30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0)
VALUES = np.array([0.004, -0.01, 0.02, 0.0, 0.006, -0.008, 0.01])
PROFILE = Profile(KNOTS, VALUES)
ANGLE = np.radians(np.linspace(-29, 29, 12))
RADIUS = np.linspace(0.5, 12.7, 12)


def test_it_is_a_cubic_spline_through_the_knots_that_ends_level() -> None:
    level = [(1, 0.0)]
    spline = make_interp_spline([-50.0, *KNOTS, 50.0], [0, *VALUES, 0], k=3, bc_type=(level, level))
    np.testing.assert_allclose(PROFILE.at(np.radians(np.array(KNOTS))), VALUES, atol=1e-15)
    np.testing.assert_allclose(PROFILE.at(ANGLE), spline(np.degrees(ANGLE)), atol=1e-14)
    np.testing.assert_array_equal(PROFILE.at(np.radians([-180.0, -50.0, 50.0, 90.0])), np.zeros(4))
    np.testing.assert_allclose(profile_basis(KNOTS, ANGLE) @ VALUES, PROFILE.at(ANGLE), atol=1e-15)


def test_a_place_is_the_same_after_a_turn() -> None:
    """Knots up to 170 degrees fade out beyond half a turn, where places are negative."""
    turn = 2 * np.pi
    for angle in (ANGLE - turn, ANGLE + turn, ANGLE + 3 * turn):
        np.testing.assert_allclose(PROFILE.at(angle), PROFILE.at(ANGLE), atol=1e-14)
        np.testing.assert_allclose(profile_basis(KNOTS, angle), profile_basis(KNOTS, ANGLE), atol=1e-12)
    behind = Profile(tuple(knot + 140 for knot in KNOTS), VALUES)
    place = np.radians(np.linspace(0.0, 49.0, 50))
    there = place + np.radians(140)
    np.testing.assert_allclose(behind.at(np.where(there > np.pi, there - turn, there)), PROFILE.at(place), atol=1e-14)


def test_curvatures_of_tip_and_surface_add() -> None:
    found = PROFILE.effective_radius(RADIUS, ANGLE)
    np.testing.assert_allclose(1 / found, 1 / RADIUS + PROFILE.at(ANGLE), rtol=1e-12)
    # An edge stays one, and a flat over a hollow does not get a negative curvature.
    assert PROFILE.effective_radius(np.zeros(1), ANGLE[:1])[0] == 0
    hollow = Profile(KNOTS, np.full(7, -1.0))
    np.testing.assert_allclose(hollow.effective_radius(RADIUS, ANGLE)[-1], RADIUS[-1] / LEAST_SHARE)


def test_a_finger_reads_touches_by_their_effective_radius() -> None:
    """With the same tables; and the surface goes to a worker process with the finger."""
    chain, load = true_chain(), np.full(12, 200.0)
    bent = chain.with_(surface=PROFILE)
    assert bent.table is chain.table
    expected = chain.predict(1 / (1 / RADIUS + PROFILE.at(ANGLE)), ANGLE, load)
    np.testing.assert_allclose(bent.predict(RADIUS, ANGLE, load), expected, rtol=1e-9)
    assert np.abs(expected - chain.predict(RADIUS, ANGLE, load)).max() > 0.01 * np.abs(expected).max()
    np.testing.assert_array_equal(bent.predict(0 * RADIUS, ANGLE, load), chain.predict(0 * RADIUS, ANGLE, load))
    again = pickle.loads(pickle.dumps(bent))
    np.testing.assert_array_equal(again.predict(RADIUS, ANGLE, load), bent.predict(RADIUS, ANGLE, load))
