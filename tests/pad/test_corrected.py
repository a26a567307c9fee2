"""Loads on a pad: as a force sensor reads them, as they are, and as they act on the elements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.chain.recording import History
from bayestouch.data.touches import touches_from
from bayestouch.effects import Setting, effect_classes
from bayestouch.model.effect_list import EffectList
from bayestouch.model.noise import AddedNoise
from bayestouch.pad.corrected import LEAST_RELATIVE_SLOPE, PadEffects

OFFSET, SHARE, THRESHOLD = 0.1, 0.4, 0.05
LOAD = np.linspace(0.3, 2.0, 9)


def with_effects(added: AddedNoise | None = None, **values: tuple[float, ...]) -> PadEffects:
    place = (np.array([0.0, 5.0, 10.0]),)
    setting = Setting(False, 3, place, ((0.0, 10.0),), 1.0, "N", "", False, 0.0, 0.0, 0.0)
    suited = [effect_classes()[name].suited(setting) for name in values]
    effects = tuple(effect for effect in suited if effect is not None)
    assert len(effects) == len(values)
    return PadEffects(EffectList(setting, effects, added or AddedNoise()), values, np.ones(3), np.zeros(3), place)


def test_wrong_readings_are_those_far_off_by_the_noise_at_their_signal() -> None:
    """Own noise 0.03 of the peak, and 0.04 at it: sds 0.03 and 0.05.

    Effects act on the whole reading: the last element has 0.25 at rest, and is at its peak with a signal of 0.75.
    """
    effects = with_effects(AddedNoise(share=0.04), outliers=(0.1, 0.3), signal_dependent_noise=(0.04, 1.0))
    effects = replace(effects, zero=np.array([0.0, 0.0, 0.25]), sd=np.full(3, 0.03))
    limit = [np.sqrt(2 * np.log(9 * np.hypot(s, 0.3) / s) / (1 / s**2 - 1 / (s**2 + 0.09))) for s in (0.03, 0.05)]
    off = np.array([limit[0], limit[1], limit[1]]) * np.array([[-1 + 1e-9], [0.0], [1 + 1e-9]])
    table = touches_from(np.zeros(3, dtype=int), np.array([0.0, 1.0, 1.0]) + off, sample=np.arange(3), load=np.ones(3))
    found = effects.without_wrong(effects.corrected(table)).readings
    np.testing.assert_array_equal(np.isnan(found), [[False] * 3, [False] * 3, [True] * 3])


def acting(load: np.ndarray) -> np.ndarray:
    """The formula of `load_nonlinearity` at a reference load of 1 N, written out."""
    reached = load - THRESHOLD
    return reached / (1 + SHARE * reached)


def test_an_offset_of_the_force_sensor_is_no_load() -> None:
    effects = with_effects(load_offset=(OFFSET,))
    np.testing.assert_allclose(effects.pressed(LOAD + OFFSET), LOAD, rtol=1e-12)
    np.testing.assert_allclose(effects.pressing(LOAD), LOAD, rtol=1e-12)
    np.testing.assert_allclose(effects.as_read(LOAD), LOAD + OFFSET, rtol=1e-12)


def test_a_load_is_true_before_the_contact_takes_its_part() -> None:
    """Of a force sensor with an offset under a contact that is not linear: neither what it reads nor what acts."""
    effects = with_effects(load_offset=(OFFSET,), load_nonlinearity=(SHARE, THRESHOLD))
    np.testing.assert_allclose(effects.acting(LOAD + OFFSET), acting(LOAD), rtol=1e-12)
    np.testing.assert_allclose(effects.pressed(LOAD + OFFSET), LOAD, rtol=1e-12)
    # Tabulated in steps of a hundredth of the reference load: the curvature of 0.8 over half a step, squared, by two.
    np.testing.assert_allclose(effects.pressing(acting(LOAD)), LOAD, atol=1e-4)
    np.testing.assert_allclose(effects.as_read(acting(LOAD)), LOAD + OFFSET, atol=1e-4)
    np.testing.assert_allclose(effects.pressing_slope(acting(LOAD)), (1 + SHARE * (LOAD - THRESHOLD)) ** 2, rtol=0.02)


def test_noise_of_a_load_goes_with_the_slope_of_the_response() -> None:
    """Of a response that flattens, the noise of an acting load is less where the load is larger."""
    effects = with_effects(load_offset=(OFFSET,), load_nonlinearity=(SHARE, THRESHOLD))
    slope = (1 + SHARE * (LOAD - THRESHOLD)) ** -2  # of `acting`, by its derivative
    of_reference = (1 + SHARE * (1.0 - OFFSET - THRESHOLD)) ** -2
    # loads are tabulated in steps of a hundredth of the reference load, over which the slope changes by a hundredth
    np.testing.assert_allclose(effects.relative_slope(acting(LOAD)), slope / of_reference, rtol=0.01)
    assert np.isclose(effects.load_slope, of_reference, rtol=1e-6)
    assert effects.relative_slope(np.array([0.0]))[0] == LEAST_RELATIVE_SLOPE
    assert np.isnan(effects.relative_slope(np.array([np.nan])))[0]
    plain = with_effects(load_offset=(OFFSET,))
    np.testing.assert_allclose(plain.relative_slope(LOAD), 1.0, rtol=1e-9)


def test_what_earlier_touches_left_does_not_depend_on_the_readings_without_touch() -> None:
    """Neither what is taken from readings, nor what touches that may be missing left; 0.9 of the peak, then nothing."""
    place, readings = (np.array([0.0, 5.0, 10.0]),), np.array([[0.9, 0.2, 0.0], [0.0, 0.1, np.nan], [0.3, 0.3, 0.3]])
    setting = Setting(False, 3, place, ((0.0, 10.0),), 1.0, "N", "", False, 1.0, 10.0, 30.0)
    memory = effect_classes()["memory"].suited(setting)
    assert memory is not None
    listed, values = EffectList(setting, (memory,), AddedNoise()), {"memory": (0.1, 20.0, 0.5)}
    time_s, ends = np.array([0.0, 10.0, 20.0]), np.array([-20.0, -10.0])
    found, square = [], []
    for zero in (0.0, 50.0):
        calibrated = np.nan_to_num(readings)
        effects = PadEffects(listed, values, np.ones(3), np.full(3, zero), place, calibrated=calibrated)
        table = touches_from(np.arange(3), readings + zero, time_s=time_s, load=np.ones(3))
        found.append(effects.corrected(table).readings - zero)
        history = History.of(np.zeros(1, dtype=int), np.zeros(1), table.readings[:1])
        found.append(effects.corrected_sample(table.readings[1], 1.0, 10.0, 0.0, history)[0] - zero)
        square.append(effects.left_by_missing(table.readings, time_s, ends, time_s))
    np.testing.assert_allclose(found[2], found[0], atol=1e-9)
    np.testing.assert_allclose(found[3], found[1], atol=1e-9)
    np.testing.assert_allclose(found[1], found[0][1], atol=1e-9)
    np.testing.assert_allclose(square[1], square[0], rtol=1e-9)
