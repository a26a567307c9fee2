"""Touches that are not in the table: when they were, and what they leave."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.chain.missing import REMEMBERED, MissingTouches, ends_before, missing_ends

#: Touches of 1 s, 3 s after each other.
PAUSE, HOLD = 3.0, 1.0


@pytest.mark.parametrize(
    ("touch", "begin", "timed", "expected"),
    [
        # The first touch has three before it.
        ([7], [20.0], True, [9.0, 13.0, 17.0]),
        # Two numbers are missing, and there was time for them.
        ([1, 4], [20.0, 32.0], True, [9.0, 13.0, 17.0, 25.0, 29.0]),
        # There was time for one of them.
        ([1, 4], [20.0, 28.0], True, [9.0, 13.0, 17.0, 25.0]),
        # A long pause is a pause if no number is missing, and missing numbers are no touches if there was no time.
        ([1, 2], [20.0, 90.0], True, [9.0, 13.0, 17.0]),
        ([10, 20], [20.0, 24.0], True, [9.0, 13.0, 17.0]),
        # Touches in another order than their numbers: 2 is in the table, 3 is not.
        ([4, 1, 2], [20.0, 90.0, 94.0], True, [9.0, 13.0, 17.0, 87.0]),
        # Without times the numbers alone count.
        ([1, 3], [0.0, 4.0], False, [-11.0, -7.0, -3.0, 1.0]),
    ],
)
def test_times_of_missing_touches(touch: list[int], begin: list[float], timed: bool, expected: list[float]) -> None:
    start = np.array(begin)
    found = missing_ends(np.array(touch), start, start + HOLD, PAUSE, HOLD, before=3, timed=timed)
    assert found.tolist() == expected


def test_no_more_touches_are_looked_at_than_are_remembered() -> None:
    assert len(ends_before(0.0, 100, PAUSE, HOLD)) == REMEMBERED
    found = missing_ends(np.array([1, 500]), np.array([0.0, 9e3]), np.array([1.0, 9e3]), 3, 1, before=90, timed=True)
    assert len(found) == 2 * REMEMBERED


def test_what_is_left_is_that_of_the_touches_before_one_that_is_alike() -> None:
    """A calibration of two places in turn, then of two touches at a third: who was before whom matters."""
    calibrated = np.array([[3.0, 0.0, 0.0], [0.0, 2.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 5.0]])
    # Before 20 s the touch at 17 s is missing, and the one before it at 13 s is known.
    missing = MissingTouches(np.array([9.0, 17.0]), np.array([13.0, 21.0]), calibrated)
    read, when = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]), np.array([20.0, 8.0, 20.0])
    found = missing.left(read, when, np.array([1.0, 2.0, 0.0]), lambda passed: 1 / passed)
    # One touch before each of the calibration, and three before it, as if the calibration were repeated.
    sums = calibrated[[4, 0, 1, 2, 3]] / 3 + calibrated[[2, 3, 4, 0, 1]] / 11
    any_touch = sums.T @ sums / 5
    # Like the first touch is the second of the calibration, and one more may be like any.
    np.testing.assert_allclose(found[0], (np.outer(sums[1], sums[1]) + any_touch) / 2)
    assert not found[1].any()  # nothing is missing before 8 s
    np.testing.assert_allclose(found[2], any_touch)  # a touch without readings is like any
