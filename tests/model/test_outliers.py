"""Readings that are more likely wrong than not: limits worked out by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.effects.noise import Outliers
from bayestouch.model.noise import AddedNoise
from bayestouch.model.outliers import RightReadings, from_median, without_wrong


def table(readings: np.ndarray, touch: list[int], contact: list[bool] | None = None) -> Any:
    made = SimpleNamespace(readings=readings, touch=np.array(touch))
    made.in_contact = np.ones(len(touch), dtype=bool) if contact is None else np.array(contact)
    made.with_ = lambda readings: table(readings, touch, contact)
    return made


def test_from_the_median_of_the_touch() -> None:
    """Of three samples or more, in any order of rows, rest left out."""
    nan = np.nan
    readings = np.array([[1.0, 5.0], [100.0, 7.0], [4.0, nan], [9.0, 1.0], [2.0, 8.0], [50.0, 50.0]])
    found = from_median(table(readings, [7, 3, 7, 7, 3, 7], [True] * 5 + [False]))
    np.testing.assert_array_equal(found[:, 0], [-3.0, nan, 0.0, 5.0, nan, nan])
    assert np.isnan(found[:, 1]).all(), "two samples do not tell which is off"


def test_where_wrong_becomes_more_likely() -> None:
    """Sizes 0.5 and sqrt(0.25 + 2) = 1.5: x²/2 (4 - 4/9) = log((1 - p)/p) + log 3 at the limit."""
    sd, peak = np.array([0.5]), np.array([np.sqrt(50.0)])
    probability, size = 0.1, 0.2
    limit = np.sqrt(2 * (np.log(9) + np.log(3)) / (4 - 4 / 9))
    near = limit * np.array([[1 - 1e-9], [1 + 1e-9], [-1 + 1e-9], [-1 - 1e-9], [np.nan]])
    found = Outliers().wrong(near, sd, peak, (probability, size))
    np.testing.assert_array_equal(found[:, 0], [False, True, False, True, False])
    assert not Outliers().wrong(np.array([[10.0]]), sd, peak, (0.0, size)).any()


def test_wrong_readings_are_left_out() -> None:
    readings = np.array([[1.0, 2.0], [1.1, 2.1], [9.0, 2.2]])
    right = RightReadings(np.full(2, 0.1), np.full(2, 10.0), AddedNoise())
    found = without_wrong(table(readings, [0, 0, 0]), Outliers(), (0.05, 0.5), right, np.ones((3, 2))).readings
    np.testing.assert_array_equal(np.isnan(found), [[False, False], [False, False], [True, False]])
    np.testing.assert_array_equal(found[:2], readings[:2])


def limit(sd: float, wide: float) -> float:
    """Deviation x at which a wrong reading, one in ten, is as probable as a right one."""
    return float(np.sqrt(2 * np.log(9 * np.hypot(sd, wide) / sd) / (1 / sd**2 - 1 / (sd**2 + wide**2))))


def test_a_reading_is_judged_by_the_noise_at_the_signal_of_its_touch() -> None:
    """Own noise 3, and 4 at the signal 100: sds 3 and 5. At a third touch the peak is passed: √(9 + 8²)."""
    for share, common in ((0.04, 0.0), (0.0, 0.04)):
        right = RightReadings(np.array([3.0]), np.array([100.0]), AddedNoise(share=share, common=common))
        # An error that elements share is equal at all signals.
        sds = (3.0, 5.0, np.sqrt(73.0)) if share else (5.0, 5.0, 5.0)
        for middle, sd in zip((0.0, 100.0, 200.0), sds, strict=True):
            # The median of three readings is the middle one.
            off = limit(sd, 30.0) * np.array([-1 + 1e-9, 0.0, 1 + 1e-9])
            rows = table(middle + off[:, None], [4, 4, 4])
            found = np.isnan(without_wrong(rows, Outliers(), (0.1, 0.3), right).readings[:, 0])
            np.testing.assert_array_equal(found, [False, False, True])


def test_the_signal_of_a_touch_is_that_of_its_mean_reading() -> None:
    """Readings that creep from 80 to 120 per cent of 100 have the noise of 100."""
    right = RightReadings(np.array([3.0]), np.array([100.0]), AddedNoise(share=0.04))
    growth = np.array([[0.8], [1.0], [1.2]])
    readings = (100.0 + limit(5.0, 30.0) * np.array([[-1 + 1e-9], [0.0], [1 + 1e-9]])) * growth
    found = without_wrong(table(readings, [4, 4, 4]), Outliers(), (0.1, 0.3), right, growth).readings
    np.testing.assert_array_equal(np.isnan(found[:, 0]), [False, False, True])
