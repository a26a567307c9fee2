"""Fingers whose fits are searched for, against first order; causes made by hand, against the tests' simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import study_modules  # noqa: F401  # it makes nicolson_fearing known
from independent.body import Annulus
from independent.finger import Finger, Press
from nicolson_fearing.finger_errors import AT, Added, EdgeErrors, TouchErrors, table_4_rows
from nicolson_fearing.linear_finger import LinearFinger
from nicolson_fearing.linear_touches import LOAD, R_A, R_B
from nicolson_fearing.made_by_hand_causes import (
    BESIDE_MM,
    LENGTH_MM,
    OFF_CENTRE_MM,
    TILT_LOAD,
    TURN,
    core_off_centre,
    nothing,
    pressures,
    prober_off_centre,
    tilted_tips,
    turned_tips,
)
from nicolson_fearing.paper_finger import LOCATIONS_DEG, POISSON_RATIO
from nicolson_fearing.paper_run import TIPS_MM
from nicolson_fearing.searched_finger import SearchedFinger
from nicolson_fearing.unknowns import Unknowns

from bayestouch.contact import composite_radius

PLANE = Unknowns(modulus_MPa=0.1, poisson_ratio=POISSON_RATIO)
FULL = Unknowns(
    modulus_MPa=0.13,
    poisson_ratio=0.475,
    squeeze_mm=0.22,
    spread=0.2,
    tail=3.0,
    prober_deg=0.12,
    drift=2.0,
    jitter=4.0,
    length_mm=4.0,
)
RADII = composite_radius(np.array(TIPS_MM), R_B)
TIP = TIPS_MM.index(9.3)
STRAIGHT = (np.zeros(1), np.ones(1))


def scaled(errors: EdgeErrors, factor: float) -> EdgeErrors:
    """All errors, smaller."""
    rest = {name: factor * getattr(errors, name) for name in ("place", "prober", "noise", "drift", "force")}
    return EdgeErrors([factor * curve for curve in errors.curves], **rest)


def test_searched_fits_of_small_errors_are_those_of_first_order() -> None:
    factor = 0.05
    whole = SearchedFinger.of(3, FULL)
    names = ("noise", "jitter", "mean_noise", "mean_jitter", "drift")
    touches = TouchErrors(*(factor * getattr(whole.touches, name) for name in names))
    small = replace(whole, edges=scaled(whole.edges, factor), touches=touches)
    elements = small.elements
    found, reach = elements.calibrated(small.edges, nothing(elements)), elements.reach(FULL, small.radii_mm)
    missed = elements.missed(found, reach)
    first = elements._read(FULL, reach, found, missed, touches, np.zeros((2, len(TIPS_MM), len(LOCATIONS_DEG))))
    searched = small.tables()
    assert searched.errors_1 == pytest.approx(first.errors_1, rel=0.02)
    # edges and all; the narrower spectrum of an identified map leaves over 0.02 % and moves R by 0.02 mm
    assert searched.errors_2 == pytest.approx(first.errors_2, abs=0.05)
    assert searched.table_3 == pytest.approx(first.table_3, abs=0.03)
    # R of edges is at its bound, where no first order is
    assert searched.table_4[0, :, :2] == pytest.approx(first.table_4[0, :, :2], rel=0.03)
    round_tips = [0 < tip < np.inf for tip in TIPS_MM]
    off = (searched.radius_errors - first.radius_errors)[0, round_tips]
    assert off.std() < 0.2 * first.radius_errors[0, round_tips].std()


def test_table_4_splits_variances_about_each_tip() -> None:
    rng = np.random.default_rng(0)
    samples = rng.standard_normal((2, 3, 5, 7)) + 10 * np.arange(3)[:, None, None]
    rows = table_4_rows([samples.mean(axis=-1)] * 3, [samples] * 3)
    assert rows[:, 0] ** 2 == pytest.approx(rows[:, 1] ** 2 + rows[:, 2] ** 2)
    assert rows[0, 1, 0] == pytest.approx(np.sqrt(samples.mean(axis=-1)[0].var(axis=-1).mean()))


def simulated(elements: LinearFinger, core: float = R_A, deeper: np.ndarray | float = 0.0) -> Finger:
    """The same elements in the tests' own simulator."""
    m = len(elements.angle_deg)
    body = Annulus(core, R_B, POISSON_RATIO)
    return Finger(body, PLANE.modulus_MPa, elements.sensing_radius_mm + deeper, elements.angle_deg, np.ones(m))


def strains(finger: Finger, tip_mm: float, angle_deg: float, peak: np.ndarray, load: float = LOAD) -> np.ndarray:
    """One touch, % of the peak."""
    return 100 * finger.signal(Press(*(np.array([x]) for x in (tip_mm, angle_deg, load))))[0] / peak


def compared(
    elements: LinearFinger, added: Added, place: int, changed: Finger, turns: tuple[np.ndarray, np.ndarray], load: float
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Changes at a place, by the cause and simulated, of the calibration's edge and of a round tip.

    Simulated ones are means over turns: angles and their shares.
    """
    plain = simulated(elements)
    peak, at = plain.peak, LOCATIONS_DEG[place]
    out = []
    for tip in (0.0, TIPS_MM[TIP]):
        after = sum(s * strains(changed, tip, at + a, peak, load) for a, s in zip(*turns, strict=True))
        out.append(after - strains(plain, tip, at, peak))
    return [added.edges[AT[place]], added.tips[TIP, place]], out


@pytest.mark.parametrize("place", [0, 33])
def test_a_core_off_centre_is_that_of_the_independent_simulator(place: int) -> None:
    elements = LinearFinger.of(1)
    added = core_off_centre(OFF_CENTRE_MM)(elements, PLANE, RADII, np.random.default_rng(5))
    phase = np.random.default_rng(5).uniform(-90, 90)
    moved, deeper = (OFF_CENTRE_MM * np.cos(np.radians(a - phase)) for a in (LOCATIONS_DEG[place], elements.angle_deg))
    changed = simulated(elements, R_A + moved, deeper)
    ours, theirs = compared(elements, added, place, changed, STRAIGHT, LOAD)
    for mine, other in zip(ours, theirs, strict=True):
        # second order in 0.2 mm of 3.3 mm, and of 0.9 mm between element and core
        assert np.abs(mine - other).max() < 0.15 * np.abs(other).max()
        assert np.abs(other).max() > 0.5
    assert np.all(added.location_deg == 0)


def test_thinner_layers_have_narrower_contacts() -> None:
    thin, thick = (pressures(PLANE, RADII, core_mm=R_A + s * OFF_CENTRE_MM)[TIP] for s in (1, -1))
    assert np.all(thin[1:15] > thick[1:15])  # a wider pressure falls earlier


def test_turned_and_tilted_tips_are_those_of_the_independent_simulator() -> None:
    elements, place = LinearFinger.of(2), 12
    tip = [0, TIP]
    slope = TURN * np.random.default_rng(6).standard_normal(len(TIPS_MM))
    added = turned_tips(elements, PLANE, RADII, np.random.default_rng(6))
    more = 1 + TILT_LOAD / LOAD * np.random.default_rng(7).standard_normal(len(TIPS_MM))
    tilted = tilted_tips(elements, PLANE, RADII, np.random.default_rng(7))
    along, shares = BESIDE_MM + LENGTH_MM * np.array([-0.775, 0.0, 0.775]), np.array([5, 8, 5]) / 18
    plain = simulated(elements)
    for i, which in enumerate(tip):
        angles = np.degrees(slope[which] * along / R_B)
        ours, theirs = compared(elements, added, place, plain, (angles, shares), LOAD)
        assert ours[i] == pytest.approx(theirs[i], abs=0.03 * np.abs(theirs[i]).max())
        ours, theirs = compared(elements, tilted, place, plain, STRAIGHT, LOAD * more[which])
        assert ours[i] == pytest.approx(theirs[i], abs=0.05 * np.abs(theirs[i]).max())


def test_calibrations_take_up_a_prober_off_centre() -> None:
    elements = LinearFinger.of(0)
    quiet = scaled(EdgeErrors.of(PLANE, elements.levels, np.random.default_rng(0)), 0.0)
    added = prober_off_centre(0.5)(elements, PLANE, RADII, np.random.default_rng(1))
    # a sine of that rms over one turn; edges are over half a turn
    assert np.sqrt(np.mean(added.location_deg[:-1] ** 2)) == pytest.approx(0.5)
    found, reach = elements.calibrated(quiet, added), elements.reach(PLANE, RADII)
    errors = reach.fit(elements.missed(found, reach), np.zeros((len(TIPS_MM), len(LOCATIONS_DEG))))
    left = errors.angle_error_deg + found.prober
    assert found.prober == pytest.approx(added.location_deg[AT])
    # what the prober says is then where the fit finds the touch, but for what an element's model cannot follow
    assert np.abs(left[1]).max() < 0.02 * 0.5 < 0.1 * np.abs(added.location_deg[AT]).max()
    assert np.abs(left[0]).max() < 0.2 * 0.5


def test_causes_add_up() -> None:
    elements = LinearFinger.of(0)
    turned = turned_tips(elements, PLANE, RADII, np.random.default_rng(2))
    twice = turned + turned + nothing(elements)
    assert twice.tips == pytest.approx(2 * turned.tips) and twice.edges == pytest.approx(2 * turned.edges)
