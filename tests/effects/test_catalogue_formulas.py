"""Formulas of effects on pose, load and readings against the catalogue's page, written out independently.

Each at random touches and at values of either sign: what is compared is the size, the sign, the phase and the unit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from independent import catalogue_forms as forms

from bayestouch.chain.recording import History, Recording
from bayestouch.data.averages import average
from bayestouch.data.touches import touches_from
from bayestouch.effects import Effect, Setting, effect_classes
from bayestouch.effects.listing import FINGER, PAD

RNG = np.random.default_rng(14)
TOUCHES, SAMPLES, M = 30, 4, 8
ROWS = TOUCHES * SAMPLES
TOUCH = np.repeat(np.arange(TOUCHES), SAMPLES)
HELD = np.tile([0.0, 0.2, 0.5, 1.1], TOUCHES)
# Pauses differ; the usual one is the median.
START = np.cumsum(RNG.uniform(3.0, 8.0, TOUCHES))
TIME = START[TOUCH] + HELD
ANGLE = RNG.permutation(np.linspace(-60.0, 65.0, M))
PEAK = RNG.uniform(500.0, 1500.0, M)
REFERENCE = 200.0
LOAD = RNG.uniform(50.0, 400.0, ROWS)
PLACE = RNG.uniform(-90.0, 90.0, ROWS)
SIGNAL = RNG.uniform(-0.3, 1.2, (ROWS, M)) * PEAK
GRID = np.stack(np.meshgrid([0.0, 5.0, 10.0], [0.0, 5.0, 10.0], indexing="ij"), axis=-1).reshape(-1, 2)
ON_PAD = np.vstack([RNG.uniform(0.0, 10.0, (ROWS - 2, 2)), [[0.0, 0.0], [10.0, 10.0]]])

SETTINGS = {"finger": replace(FINGER, n_elements=M, element_place=(ANGLE,)), "pad": PAD}


def finger(**changes: object) -> Recording:
    """A recording of a finger on its way through the chain."""
    plain = Recording(
        indenter_radius_mm=np.where(TOUCH % 2 == 0, 0.0, 5.0),
        place=(PLACE,),
        load=LOAD,
        time_s=TIME,
        held_s=HELD,
        element_place=(ANGLE,),
        peak=PEAK,
        reference_load=REFERENCE,
        signal=SIGNAL,
    )
    return replace(plain, **changes)  # type: ignore[arg-type]  # named fields


def pad(**changes: object) -> Recording:
    """The same of a pad of three by three elements, 5 mm apart, loads in N."""
    signal = np.random.default_rng(3).uniform(-0.1, 1.2, (ROWS, 9))
    place = dict(place=(ON_PAD[:, 0], ON_PAD[:, 1]), element_place=(GRID[:, 0], GRID[:, 1]))
    return finger(**place, load=LOAD / 200, peak=np.ones(9), reference_load=1.0, signal=signal, **changes)


def effect(name: str, body: str = "finger") -> Effect:
    """The effect as it suits a finger or a pad."""
    setting: Setting = SETTINGS[body]
    for contact in (setting.contact, "hertz"):
        found = effect_classes()[name].suited(replace(setting, contact=contact))
        if found is not None:
            return found
    raise AssertionError(f"{name} suits no {body}")


def same(found: np.ndarray, wanted: np.ndarray) -> None:
    """Equal to rounding, and something is there to be compared."""
    np.testing.assert_allclose(found, wanted, rtol=1e-10, atol=1e-10 * float(np.abs(wanted).max()))


@pytest.mark.parametrize("values", [(1.3, -0.7), (-1.3, 0.7), (0.5, 0.0), (0.0, 0.5)])
def test_prober_eccentricity_is_in_degrees_once_around(values: tuple[float, float]) -> None:
    moved = effect("prober_eccentricity").pose(finger(), values)
    same(moved.place[0], forms.prober_eccentricity(PLACE, *values, ANGLE))
    same(moved.load, LOAD)


@pytest.mark.parametrize("places", [ANGLE, np.array([-10.0, 20.0, 55.0]), np.array([30.0])])
def test_errors_of_references_turn_no_finger_and_scale_no_load(places: np.ndarray) -> None:
    """Their mean over the elements is zero, wherever these are: a frame is known only as it is stated."""
    setting = replace(SETTINGS["finger"], n_elements=len(places), element_place=(places,))
    touched = finger(place=(places,), load=np.full(len(places), 200.0))
    for name in ("prober_eccentricity", "load_misalignment"):
        found = effect_classes()[name].suited(setting)
        assert found is not None
        moved = found.pose(touched, (0.3, -0.2))
        assert np.mean(moved.place[0] - places) == pytest.approx(0, abs=1e-12)
        assert np.mean(200.0 / moved.load) == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(("body", "offset"), [("finger", 17.0), ("finger", -17.0), ("pad", 0.08), ("pad", -0.08)])
def test_load_offset_is_added_to_what_is_read(body: str, offset: float) -> None:
    truth = finger() if body == "finger" else pad()
    read = replace(truth, load=forms.load_offset(truth.load, offset))
    same(effect("load_offset", body).pose(read, (offset,)).load, truth.load)


@pytest.mark.parametrize("values", [(0.12, -0.2), (-0.12, 0.2), (0.1, 0.0), (0.0, 0.1)])
def test_load_misalignment_of_a_finger_multiplies_what_is_read(values: tuple[float, float]) -> None:
    read = finger(load=forms.load_misalignment_finger(LOAD, PLACE, *values, ANGLE))
    same(effect("load_misalignment").pose(read, values).load, LOAD)


@pytest.mark.parametrize("values", [(0.12, -0.2), (-0.12, 0.2)])
def test_load_misalignment_of_a_pad_goes_from_side_to_side(values: tuple[float, float]) -> None:
    truth = pad()
    read = replace(truth, load=forms.load_misalignment_pad(truth.load, ON_PAD, np.array(values)))
    same(effect("load_misalignment", "pad").pose(read, values).load, truth.load)


@pytest.mark.parametrize("values", [(0.4, 0.05), (1.5, -0.1), (-0.15, 0.0)])
def test_load_nonlinearity_of_a_pad(values: tuple[float, float]) -> None:
    truth = pad()
    acting = effect("load_nonlinearity", "pad").pose(truth, values).load
    same(acting, forms.load_nonlinearity(truth.load, 1.0, *values))


def test_a_load_under_the_threshold_does_not_act() -> None:
    """It is no load of the other sign: a peak would be negative, and the limits that are shares of it."""
    truth = pad()
    load = np.sort(np.unique(truth.load))
    threshold = float(0.5 * (load[0] + load[-1]))
    acting = effect("load_nonlinearity", "pad").pose(truth, (0.4, threshold)).load
    under = truth.load < threshold
    assert under.any() and not under.all()
    assert (acting > 0).all() and (acting[under] <= 1e-6).all()
    same(acting[~under], forms.load_nonlinearity(truth.load[~under], 1.0, 0.4, threshold))


def test_a_blunt_edge_has_its_radius_and_other_tips_keep_theirs() -> None:
    found = effect("blunt_edge").pose(finger(), (0.7,)).indenter_radius_mm
    same(found, np.where(TOUCH % 2 == 0, 0.7, 5.0))


@pytest.mark.parametrize("tails", [-1.0, -0.4, 0.0, 0.6, 1.0])
@pytest.mark.parametrize("share", [0.2, -0.2])
def test_soft_spot_has_its_place_and_width(share: float, tails: float) -> None:
    found = effect("soft_spot").signal(finger(), (share, 12.0, tails, 20.0))
    same(found, forms.soft_spot(SIGNAL, PLACE[:, None], share, 12.0, tails, np.array([20.0])))
    there = pad()
    found = effect("soft_spot", "pad").signal(there, (share, 2.5, tails, 3.0, 8.0))
    same(found, forms.soft_spot(there.signal, ON_PAD, share, 2.5, tails, np.array([3.0, 8.0])))


@pytest.mark.parametrize("values", [(0.06, 0.3, 0.4), (-0.06, 0.5, -0.4), (0.06, 0.0, 0.0)])
def test_crosstalk_of_a_finger_reaches_and_leans(values: tuple[float, float, float]) -> None:
    same(effect("crosstalk").signal(finger(), values), forms.crosstalk_finger(SIGNAL, ANGLE, *values))


@pytest.mark.parametrize("share", [0.06, -0.06])
def test_crosstalk_of_a_pad_comes_from_those_a_pitch_away(share: float) -> None:
    there = pad()
    same(effect("crosstalk", "pad").signal(there, (share,)), forms.crosstalk_pad(there.signal, GRID, 5.0, share))


@pytest.mark.parametrize("values", [(0.06, 0.0), (0.06, 0.5), (-0.06, 0.7)])
def test_channel_lag_is_what_scans_leave(values: tuple[float, float]) -> None:
    same(effect("channel_lag").signal(finger(), values), forms.channel_lag(SIGNAL, *values))


@pytest.mark.parametrize("tails", [-0.5, 0.0, 1.0])
@pytest.mark.parametrize(("share", "power"), [(0.05, 0.0), (-0.05, 0.4), (0.05, 1.0)])
def test_proximity_goes_with_distance_and_load(share: float, power: float, tails: float) -> None:
    # A finger that is touched all around: the way to an element is the shorter one.
    place = PLACE * 2
    turn = (ANGLE - place[:, None] + 180) % 360 - 180
    added = effect("proximity").signal(finger(place=(place,)), (share, 33.0, power, tails)) - SIGNAL
    wanted = forms.proximity(turn, PEAK, LOAD, REFERENCE, (share, 33.0, power, tails))
    # Differences of readings a thousand times larger than what is added.
    np.testing.assert_allclose(added, wanted, atol=1e-12 * float(PEAK.max()))


@pytest.mark.parametrize("values", [(0.2, 1.0), (-0.2, 2.0), (0.3, 1.4)])
def test_gain_nonlinearity_goes_with_a_power_of_the_reading(values: tuple[float, float]) -> None:
    same(effect("gain_nonlinearity").signal(finger(), values), forms.gain_nonlinearity(SIGNAL, PEAK, *values))


@pytest.mark.parametrize("values", [(0.8, 6.0, 0.0), (0.8, 20.0, 1.0), (1.1, 9.0, 0.4)])
def test_saturation_has_a_limit_and_a_knee(values: tuple[float, float, float]) -> None:
    same(effect("saturation").signal(finger(), values), forms.saturation(SIGNAL, PEAK, *values))


def test_rest_offset_is_a_share_of_the_peak_of_each_element() -> None:
    shares = np.linspace(-0.2, 0.3, M)
    same(effect("rest_offset").signal(finger(), tuple(shares)), forms.rest_offset(SIGNAL, PEAK, shares))


@pytest.mark.parametrize("share", [0.2, -0.2])
def test_creep_starts_with_the_touch_and_settles(share: float) -> None:
    same(effect("creep").signal(finger(), (share, 0.7)), forms.creep(SIGNAL, HELD, share, 0.7))


def test_creep_by_element_has_a_share_for_each() -> None:
    there = pad()
    shares = np.linspace(-0.2, 0.2, 9)
    found = effect("creep_by_element", "pad").signal(there, (*shares, 0.7))
    same(found, forms.creep(there.signal, HELD, shares, 0.7))


@pytest.mark.parametrize("values", [(0.08, 6.0, 1.0), (-0.08, 3.0, 0.0), (0.08, 15.0, 1.8)])
def test_memory_is_what_all_touches_before_left(values: tuple[float, float, float]) -> None:
    pause = 4.0
    read = forms.memory(SIGNAL, TOUCH, TIME, pause, values)
    means = average(touches_from(TOUCH, read, time_s=TIME)).readings
    there = finger(history=History(START + 1.1, means))
    setting = replace(SETTINGS["finger"], gap_s=pause)
    memory = effect_classes()["memory"].suited(setting)
    assert memory is not None
    same(memory.signal(there, values), read)


@pytest.mark.parametrize(("axis", "name"), [(0, "x"), (1, "y")])
def test_load_misalignment_of_a_pad_touched_along_a_line(axis: int, name: str) -> None:
    """Where one coordinate does not change but for rounding, the error goes with the other."""
    ranges = [(4.0, 4.0 + 1e-15), (4.0, 4.0)]
    ranges[axis] = (-10.0, 30.0)
    misaligned = effect_classes()["load_misalignment"]
    found = misaligned.suited(replace(PAD, place_range=tuple(ranges)))
    assert found is not None and [each.name for each in found.parameters] == [name]
    there = pad()
    wanted = there.load / (1 + 0.1 * (ON_PAD[:, axis] - 10) / 20)
    same(found.pose(there, (0.1,)).load, wanted)
    assert misaligned.suited(replace(PAD, place_range=((4.0, 4.0), (5.0, 5.0)))) is None


def test_a_soft_spot_goes_round_a_finger() -> None:
    """Over 180 degree; a pad has no such turn."""
    angle = np.resize([175.0, -175.0, 185.0, -185.0], ROWS)
    there = finger(place=(angle,))
    spot = effect("soft_spot")
    for centre in (180.0, -180.0):
        found = spot.signal(there, (0.2, 10.0, 0.0, centre))
        # A bell of half width 10 has 2^(-1/4) at 5.
        same(found, there.signal * (1 + 0.2 * 0.5**0.25))
    on_pad = pad()
    far = replace(on_pad, place=(on_pad.place[0] + 360, on_pad.place[1]))
    same(effect("soft_spot", "pad").signal(far, (0.2, 2.5, 0.0, 3.0, 8.0)), far.signal)
