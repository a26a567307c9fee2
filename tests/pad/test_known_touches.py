"""Which samples of a touch on a pad count, and what an element reads without load."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.data.touches import touches_from
from bayestouch.pad.known_touches import choose_samples, counted_samples, faintest_readings, readings_without_load


@pytest.mark.parametrize("silent", [0.0, np.nan])
def test_an_element_without_a_signal_hides_no_creep(silent: float) -> None:
    """Two elements gain 5 % from the first sample to the last: 0.05/1.025 of their mean signal, 4.88 %."""
    creeping = np.repeat(np.linspace(100, 200, 10), 2) * np.tile([1.0, 1.05], 10)
    readings = np.stack([creeping, 2 * creeping, np.full(20, silent)], axis=1)
    touch, sample = np.repeat(np.arange(10), 2), np.tile([0, 1], 10)
    touches = touches_from(touch, readings, sample=sample, x_mm=np.repeat(np.arange(10.0), 2), load=1.0)
    samples, why = choose_samples(touches)
    assert samples == "first"
    assert "+4.878 % of the signal" in why and "nan" not in why


def test_a_small_change_between_samples_is_stated_with_its_digits() -> None:
    """Signals of 10,000 whose last sample is 0.02 more or 0.01 less in turn: changes of +2 and -1 millionths.

    Weighted alike, their mean is 0.5 millionths of the signal, and each is 1.5 off: 1.5/√10 = 0.47 is the error.
    """
    readings = np.repeat(np.full(10, 1e4), 2)
    readings[1::4] += 0.02
    readings[3::4] -= 0.01
    touch, sample = np.repeat(np.arange(10), 2), np.tile([0, 1], 10)
    touches = touches_from(touch, readings[:, None], sample=sample, x_mm=touch.astype(float), load=1.0)
    samples, why = choose_samples(touches)
    assert samples == "mean" and why == (
        "no creep between the samples of a touch (+0.000050 ± 0.000047 % of the signal): their mean is used"
    )


@pytest.mark.parametrize("seed", [0, 1])
def test_creep_is_found_in_rows_of_any_order(seed: int) -> None:
    """Each touch is compared with itself; the rows that count stay in the order of the table."""
    shuffled = np.random.default_rng(seed).permutation(30)
    touch, sample = np.repeat(np.arange(10), 3)[shuffled], np.tile([0, 1, 2], 10)[shuffled]
    readings = 100.0 * (1 + touch) * (1 + 0.025 * sample)
    touches = touches_from(touch, readings[:, None], sample=sample, x_mm=touch.astype(float), load=1.0)
    samples, why = choose_samples(touches)
    assert samples == "first"
    assert "+4.878 % of the signal" in why
    for which, number in (("first", 0), ("last", 2)):
        np.testing.assert_array_equal(counted_samples(touches, which).touch, touch[sample == number])


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("zero", [0.0, 1e5])
def test_creep_is_a_share_of_the_signal_above_the_readings_without_touch(zero: float, sign: float) -> None:
    """The last sample has 5 % more signal: 0.05/1.025 of the mean of the two, 4.88 %. Most touches are elsewhere."""
    signal = np.zeros((30, 2))
    signal[:10, 0], signal[20:, 1] = np.linspace(10, 200, 10), np.linspace(90, 10, 10)
    readings = zero + sign * np.repeat(signal, 2, axis=0) * np.tile([1.0, 1.05], 30)[:, None]
    readings[59, 1] = np.nan
    touch, sample = np.repeat(np.arange(30), 2), np.tile([0, 1], 30)
    touches = touches_from(touch, readings, sample=sample, x_mm=touch.astype(float), load=1.0)
    samples, why = choose_samples(touches, faintest_readings(touches, None))
    assert samples == "first" and "+4.878 % of the signal" in why
    assert not faintest_readings(touches, np.zeros(2)).any()


@pytest.mark.parametrize("repeated", [True, False])
def test_readings_without_load(repeated: bool) -> None:
    """A slope for each place and one offset; where each place is touched once, most places are far from an element."""
    rng = np.random.default_rng(4)
    place = np.repeat(np.arange(12.0), 3) if repeated else np.arange(36.0)
    load = rng.uniform(1.0, 6.0, 36)
    slope = np.array([[9.0], [4.0]]) * (np.abs(place - np.array([[3.0], [8.0]])) < 2.5)
    offset = np.array([1000.0, -20.0])
    known = touches_from(
        x_mm=place, load=load, readings=offset + (slope * load).T, touch=np.arange(36), indenter_radius_mm=np.ones(36)
    ).averaged()
    np.testing.assert_allclose(readings_without_load(known), offset, rtol=1e-12)
