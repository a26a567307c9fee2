"""Effects inside the finger, where the chain is summed over modes, against the independent simulator.

Its body is collocated and its contact solved by other means; what is compared is what the effect changes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from independent.body import Annulus
from independent.catalogue_finger import finite_strain
from independent.catalogue_forms import surface_profile
from independent.finger import REFERENCE_LOAD, Finger, Press

from bayestouch.chain.finger import FingerChain
from bayestouch.chain.recording import Recording
from bayestouch.contact import composite_radius
from bayestouch.effects import effect_classes
from bayestouch.effects.listing import FINGER

RNG = np.random.default_rng(9)
M = 6
BODY = Annulus(poisson=0.46)
BUILT = Finger(BODY, 0.15, RNG.uniform(9.7, 10.4, M), np.linspace(-24.0, 26.0, M), RNG.uniform(500, 900, M))
EDGES = Press(np.zeros(40), RNG.uniform(-60, 60, 40), RNG.uniform(100, 300, 40))
TIPS = Press(np.repeat([2.0, 6.0, 15.0, np.inf], 10), RNG.uniform(-60, 60, 40), RNG.uniform(100, 300, 40))


def packaged(name: str, values: tuple[float, ...], press: Press, under: Press, contact: str = "layer") -> np.ndarray:
    """Readings of the package's chain; its responses are those of the simulator to a knife edge as `under`."""
    setting = replace(FINGER, contact=contact)
    effect = effect_classes()[name].suited(setting)
    assert effect is not None
    chain = FingerChain(
        core_radius_mm=BODY.core,
        outer_radius_mm=BODY.outer,
        response=peak(under) / REFERENCE_LOAD,
        sensing_radius_mm=BUILT.depth,
        angle=np.radians(BUILT.angle),
        offset=np.zeros(M),
        poisson_ratio=BODY.poisson,
        shear_modulus_MPa=BUILT.modulus,
        largest_load=400.0,
        contact=contact,
    )
    radius = composite_radius(press.tip, BODY.outer)
    return effect.finger(chain, values).predict(radius, np.radians(press.angle), press.load)


def peak(press: Press) -> np.ndarray:
    """Counts right under a knife edge of the reference load, of elements that read as in `press`, (m,)."""
    at = replace(press, tip=np.zeros(M), angle=BUILT.angle, load=np.full(M, REFERENCE_LOAD), tangential=0.0)
    return np.asarray(np.diagonal(BUILT.signal(at)))


@pytest.mark.parametrize("width", [1.0, 3.0])
def test_an_aperture_averages_over_its_width_along_the_arc(width: float) -> None:
    wide = replace(EDGES, width=width)
    # Interpolation in angle, 1e-5 of the peak (`bayestouch.chain.response`); twice the width changes 1 % and more.
    found = packaged("aperture", (width,), EDGES, wide)
    np.testing.assert_allclose(found / peak(wide), BUILT.signal(wide) / peak(wide), atol=5e-5)
    assert np.abs(BUILT.signal(wide) / peak(wide) - BUILT.signal(EDGES) / peak(EDGES)).max() > 2e-3


@pytest.mark.parametrize("share", [0.2, -0.2])
def test_friction_pulls_towards_larger_angles(share: float) -> None:
    """With the sign of the share: the elements at larger angles than the touch are squeezed by what is pushed there."""
    pulled = replace(EDGES, tangential=np.full(40, share))
    found = packaged("tangential_load", (share,), EDGES, EDGES)
    np.testing.assert_allclose(found / peak(EDGES), BUILT.signal(pulled) / peak(EDGES), atol=5e-5)
    assert np.abs(BUILT.signal(pulled) - BUILT.signal(EDGES)).max() > 0.02 * peak(EDGES).max()


def test_a_surface_out_of_round_adds_its_curvature() -> None:
    """And an edge does not feel it."""
    weights = {f"weight_{i:02d}": 0.012 * np.sin(1.7 * i) for i in range(1, 22)}
    bent, edges = (replace(press, hump=surface_profile(press.angle, weights)) for press in (TIPS, EDGES))
    found = packaged("surface_profile", tuple(weights.values()), TIPS, EDGES)
    # Interpolation over the width of the contact, 1e-4 of the peak.
    np.testing.assert_allclose(found / peak(EDGES), BUILT.signal(bent) / peak(EDGES), atol=1.5e-4)
    assert np.abs(BUILT.signal(bent) - BUILT.signal(TIPS)).max() > 0.01 * peak(EDGES).max()
    found = packaged("surface_profile", tuple(weights.values()), edges, EDGES)
    np.testing.assert_allclose(found / peak(EDGES), BUILT.signal(EDGES) / peak(EDGES), atol=5e-5)


@pytest.mark.parametrize("share", [1.0, 0.5, -0.4])
def test_a_rigid_core_takes_hertz_to_the_layer(share: float) -> None:
    between = replace(TIPS, half_space=1 - share)
    found = packaged("rigid_core", (share,), TIPS, EDGES, "hertz")
    # Interpolation over the width of the contact, 1e-4 of the peak.
    np.testing.assert_allclose(found / peak(EDGES), BUILT.signal(between) / peak(EDGES), atol=1.5e-4)
    changed = BUILT.signal(between) - BUILT.signal(replace(TIPS, half_space=1.0))
    assert np.abs(changed).max() > 30 * 1.5e-4 * peak(EDGES).max()


@pytest.mark.parametrize("share", [1.0, -0.4])
def test_finite_strain_adds_its_share_of_the_table(share: float) -> None:
    linear = packaged("finite_strain", (0.0,), TIPS, EDGES)
    added = packaged("finite_strain", (share,), TIPS, EDGES) - linear
    wanted = finite_strain(BUILT, TIPS, share)
    # Interpolation is good to 3e-4 of the peak (`bayestouch.body.finite_strain`).
    scale = peak(EDGES) * TIPS.load[:, None] / REFERENCE_LOAD
    np.testing.assert_allclose(added / scale, wanted / scale, atol=1e-3 * abs(share))
    assert np.abs(wanted / scale).max() > 20 * 1e-3 * abs(share)


def touched(angle_deg: np.ndarray, load: np.ndarray, tip: np.ndarray) -> Recording:
    """Touches that every element reads as one, at a reference load of 100."""
    none = np.zeros(len(load))
    return Recording(
        indenter_radius_mm=tip,
        place=(angle_deg,),
        load=load,
        time_s=none,
        held_s=none,
        element_place=(BUILT.angle,),
        peak=np.ones(M),
        reference_load=100.0,
        signal=np.ones((len(load), M)),
    )


def test_a_void_that_closes_under_load() -> None:
    """The share goes with a power of the load over the reference load, and not beyond a hundred times."""
    plain = effect_classes()["soft_spot"].suited(FINGER)
    assert plain is not None
    looser = plain.looser(M)
    assert looser is not None and [each.name for each in looser.parameters] == [
        *(each.name for each in plain.parameters),
        "load_power",
    ]
    load = np.array([50.0, 100.0, 200.0, 0.0])
    one = touched(np.array([0.0, 3.0, 6.0, 6.0]), load, np.zeros(4))
    values = (0.3, 6.0, 0.0, 0.0)
    found = looser.signal(one, (*values, -2.0))[:, 0]
    bell = 0.5 ** (np.array([0.0, 0.5, 1.0, 1.0]) ** 2)
    np.testing.assert_allclose(found, 1 + 0.3 * np.array([4.0, 1.0, 0.25, 100.0]) * bell)
    np.testing.assert_array_equal(looser.signal(one, (*values, 0.0)), plain.signal(one, values))


def test_a_tip_that_descends_beside_the_centre() -> None:
    """Circles that touch: a tip of radius r_c at a distance d from the axis, at asin(d/(r_b + r_c)); a flat nowhere."""
    plain = effect_classes()["prober_eccentricity"].suited(FINGER)
    assert plain is not None
    looser = plain.looser(M)
    assert looser is not None
    assert [each.name for each in looser.parameters] == [
        *("sine", "cosine", "edge", "edge_sine", "edge_cosine", "sine_2", "cosine_2", "sine_3", "cosine_3"),
        *(f"{name}_wave_{k}" for name in ("turn", "sine", "cosine") for k in (1, 2, 3, 4)),
    ]
    rest = (0.0,) * (len(looser.parameters) - 5)
    outer, turn = FINGER.radii_mm[1], np.radians([-40.0, 0.0, 25.0, 25.0])
    tip = np.array([0.0, 6.0, 6.0, np.inf])
    one = touched(np.degrees(turn), np.ones(4), tip)
    # Degree per radian: small, so that an arc is its sine.
    beside, around = 0.02, 0.01
    distance = outer * np.radians(beside + around * np.sin(turn))
    expected = np.where(np.isinf(tip), 0.0, np.degrees(np.arcsin(distance / (outer + np.where(tip < 99, tip, 0.0)))))
    found = looser.pose(one, (0.0, 0.0, beside, around, 0.0, *rest)).place[0] - one.place[0]
    np.testing.assert_allclose(found, expected, atol=1e-9)
    same = plain.pose(one, (0.3, -0.2)).place[0]
    np.testing.assert_array_equal(looser.pose(one, (0.3, -0.2, 0.0, 0.0, 0.0, *rest)).place[0], same)
    # A finger whose radius is not known has no such form.
    unknown = effect_classes()["prober_eccentricity"].suited(replace(FINGER, radii_mm=(0.0, 0.0)))
    assert unknown is not None and unknown.looser(M) is None


def test_a_prober_in_three_jaws_that_slips() -> None:
    """θ + f(t) + (a + g(t)) (sin θ - s) + two and three waves a turn; f and g are half waves over an hour."""
    plain = effect_classes()["prober_eccentricity"].suited(FINGER)
    assert plain is not None
    looser = plain.looser(M)
    assert looser is not None and len(looser.parameters) == 5 + 4 + 12
    values = dict.fromkeys((each.name for each in looser.parameters), 0.0)
    values |= {
        "sine": 0.8,
        "sine_2": 0.3,
        "cosine_3": -0.2,
        "turn_wave_1": 0.4,
        "turn_wave_4": 0.05,
        "sine_wave_3": 0.1,
    }
    turn, time = np.radians([-40.0, 0.0, 25.0, 25.0, 70.0]), np.array([0.0, 900.0, 1800.0, 3600.0, 7200.0])
    # After the end of the recording all stays as it is there.
    passed = np.minimum(time / 3600.0, 1.0)
    elements = np.radians(FINGER.element_place[0])
    once = np.sin(turn) - np.sin(elements).mean()
    wanted = (0.8 + 0.1 * np.cos(3 * np.pi * passed)) * once
    wanted += 0.3 * (np.sin(2 * turn) - np.sin(2 * elements).mean()) - 0.2 * (
        np.cos(3 * turn) - np.cos(3 * elements).mean()
    )
    wanted += 0.4 * np.cos(np.pi * passed) + 0.05 * np.cos(4 * np.pi * passed)
    one = replace(touched(np.degrees(turn), np.ones(5), np.zeros(5)), time_s=time)
    found = looser.pose(one, tuple(values.values())).place[0] - one.place[0]
    np.testing.assert_allclose(found, wanted, atol=1e-12)
    # Half waves k have 1/k of the spread that the error everywhere has.
    sd = {each.name: each.prior.quantile(np.array(0.841)) for each in looser.parameters}
    assert sd["turn_wave_4"] == pytest.approx(sd["sine"] / 4, rel=1e-3)


def test_a_force_sensor_whose_zero_changes() -> None:
    """P = reading - offset - a sum of cosines of half waves over the hour; without times there is no such form."""
    plain = effect_classes()["load_offset"].suited(FINGER)
    assert plain is not None
    looser = plain.looser(M)
    assert looser is not None and len(looser.parameters) == 9
    load, time = np.array([100.0, 150.0, 200.0]), np.array([0.0, 1200.0, 3600.0])
    one = replace(touched(np.zeros(3), load, np.zeros(3)), time_s=time)
    found = looser.pose(one, (7.0, 2.0, *(0.0,) * 6, -1.0)).load
    wanted = load - 7.0 - 2.0 * np.cos(np.pi * time / 3600) + np.cos(8 * np.pi * time / 3600)
    np.testing.assert_allclose(found, wanted, rtol=1e-13)
    np.testing.assert_array_equal(plain.pose(one, (7.0,)).load, load - 7.0)
    untimed = effect_classes()["load_offset"].suited(replace(FINGER, span_s=0.0))
    assert untimed is not None and untimed.looser(M) is None


def test_a_guide_with_friction_errs_with_two_waves_a_turn() -> None:
    """P = reading/(1 + a (sin θ - s) + b (cos θ - c)), and the same of 2θ; s and c are means over the elements."""
    plain = effect_classes()["load_misalignment"].suited(FINGER)
    assert plain is not None
    looser = plain.looser(M)
    assert looser is not None
    names = [each.name for each in looser.parameters]
    assert names == ["sine", "cosine", "sine_2", "cosine_2"]
    turn, load = np.radians([-40.0, 0.0, 25.0]), np.array([100.0, 150.0, 200.0])
    one = touched(np.degrees(turn), load, np.zeros(3))
    elements = np.radians(FINGER.element_place[0])
    error = 0.1 * (np.sin(turn) - np.sin(elements).mean()) - 0.05 * (np.cos(turn) - np.cos(elements).mean())
    np.testing.assert_allclose(looser.pose(one, (0.1, -0.05, 0.0, 0.0)).load, load / (1 + error))
    error += 0.02 * (np.sin(2 * turn) - np.sin(2 * elements).mean())
    error += 0.03 * (np.cos(2 * turn) - np.cos(2 * elements).mean())
    np.testing.assert_allclose(looser.pose(one, (0.1, -0.05, 0.02, 0.03)).load, load / (1 + error))
