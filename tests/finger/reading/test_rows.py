"""Blocks of touches on a finger: joined into one."""

from __future__ import annotations

import numpy as np

from bayestouch.data.averages import TouchMeans
from bayestouch.finger.reading.reader import TouchReadings
from bayestouch.finger.reading.rows import FingerTouches


def block(touch: list[int]) -> FingerTouches:
    """Touches of one element that read their own numbers."""
    number, unknown = np.array(touch, dtype=float), np.full(len(touch), np.nan)
    readings, counts = number[:, None], np.ones((len(touch), 1), dtype=np.int64)
    means = TouchMeans(
        np.array(touch), readings, counts, np.array([np.nan]), np.zeros(1),
        number, unknown, unknown, unknown, unknown, None, None,
    )  # fmt: skip
    return FingerTouches(means, TouchReadings(readings, counts, number, np.ones(len(touch))))


def test_blocks_are_joined_in_their_order() -> None:
    """One block is itself; of several, means and readings follow each other."""
    first, second = block([3, 1]), block([7])
    assert FingerTouches.joined([first]) is first
    both = FingerTouches.joined([first, second])
    np.testing.assert_array_equal(both.means.touch, [3, 1, 7])
    np.testing.assert_array_equal(both.readings.readings, [[3.0], [1.0], [7.0]])
    np.testing.assert_array_equal(both.readings.load, [3.0, 1.0, 7.0])
