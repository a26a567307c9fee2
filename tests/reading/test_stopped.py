"""Elements that stop in the middle of a table, by hand: three elements and a force sensor."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bayestouch.reading import stopped
from bayestouch.reading.fault_tests import SensorMisfit
from bayestouch.reading.stopped import may_be_silent, same_since, silent_at, stopped_at

SCALE = np.array([10.0, 10.0, 10.0, 1.0])
T = 30


def table(first: int, value: float = 0.0) -> np.ndarray:
    """Readings of 3 to 9; the second element reads `value` from touch `first` on, and every load is the same."""
    columns = np.tile(3.0 + 3 * np.arange(3.0), 10)[:, None] + np.zeros(4)
    columns[:, 3] = 1.0
    columns[first:, 1] = value
    return columns


def fitted(signal: np.ndarray, sd: float = 0.0) -> Any:
    def fit(out: np.ndarray) -> SensorMisfit:
        assert out.tolist() == [False, True, False, False], "the element in doubt says nothing of the touches"
        nothing = np.zeros((T, 4))
        return SensorMisfit(nothing, nothing, signal, np.full((T, 4), sd), lambda _: np.zeros(4), np.zeros(4), SCALE)

    return fit


def test_settings() -> None:
    assert (stopped.SAME, stopped.NOTHING_SHARE) == (1e-9, 0.15)


def test_from_which_touch_a_column_reads_the_same() -> None:
    columns = [[1.0, 4.0, 4.0, 4.0], [2.0, 2.0, 2.0 + 1e-9, 2.0], [5.0, 5.0, 6.0, 5.0], [3.0, np.nan, 3.0, np.nan]]
    np.testing.assert_array_equal(same_since(np.array(columns).T, SCALE), [1, 0, 3, 4])


@pytest.mark.parametrize(
    ("first", "value", "sd", "at"),
    [
        (20, 0.0, 0.0, 20),
        (22, 0.0, 0.0, 22),
        (23, 0.0, 0.0, T),  # seven touches are too few
        (0, 0.0, 0.0, T),  # all touches: it is stuck throughout
        # from touch 20 on there are three readings of 3 and 6, four of 9: only 9 is not within a fifth of 4.5
        (20, 4.5, 0.0, 20),
        (20, 4.5, 1.3, T),  # 9 - 4.5 is less than twice the sd and a fifth of the peak
    ],
)
def test_an_element_stops_where_the_others_say_that_it_should_read_something_else(
    first: int, value: float, sd: float, at: int
) -> None:
    found = stopped_at(table(first, value), SCALE, fitted(table(T), sd), 1)
    assert found.tolist() == [T, at, T, T]


def test_copies_of_the_last_touch_are_no_fault() -> None:
    columns = table(T)
    columns[20:] = columns[20]

    def never(out: np.ndarray) -> SensorMisfit:
        raise AssertionError("nothing is left to compare with")

    assert stopped_at(columns, SCALE, never, 1).tolist() == [T] * 4


def misfit(signal: np.ndarray, sd: float, score: np.ndarray, information: float) -> SensorMisfit:
    sds, told = np.full(signal.shape, sd), np.full(signal.shape, information)
    return SensorMisfit(score, told, signal, sds, lambda _: np.zeros(4), np.zeros(4), SCALE)


@pytest.mark.parametrize(
    ("read", "sd", "silent"),
    [
        (0.4, 0.0, [0, 1, 2, 3]),  # by a tenth or less
        (0.8, 0.0, [0, 1, 2, 3]),  # of 4, 6, 8 and 10: 0.8 ‧ 28 is 10 % of the sum of squares
        (1.4, 0.0, []),  # 18 % of it: the gain has changed
        (0.4, 1.5, [1, 2, 3]),  # 4 - 2 ‧ 1.5 is less than a fifth of the peak, 2
        (0.4, 2.5, []),  # two touches are too few
        (5.5, 0.0, []),  # nearer to what it should read in all but two
    ],
)
def test_touches_of_which_an_element_reads_nothing(read: float, sd: float, silent: list[int]) -> None:
    signal = np.zeros((5, 4))
    signal[:, 1] = [4.0, 6.0, 8.0, 10.0, 1.0]
    none = np.zeros((5, 4))
    found, told = silent_at(np.full(5, read), misfit(signal, sd, none, 0.0), 1)
    assert np.flatnonzero(found).tolist() == silent
    assert np.flatnonzero(told).tolist() == [k for k in range(4) if signal[k, 1] - 2 * sd > 2.0]


def test_elements_that_may_be_silent_by_what_the_others_say() -> None:
    """Score over information is what an element reads beside it; three touches count, and no change of sign."""
    columns, score = np.zeros((4, 4)), np.zeros((4, 4))
    columns[:, 0], score[:, 0] = 0.5, [-8.0, -8.0, -8.0, 0.0]  # 2.5 to 4.5 are expected with an information of 2
    columns[:, 1], score[:, 1] = 0.5, [-8.0, -8.0, 0.0, 0.0]
    columns[:, 2], score[:, 2] = 4.0, -6.0  # 7 is expected
    assert may_be_silent(columns, misfit(columns, 0.0, score, 2.0)).tolist() == [True, False, False]
    assert not may_be_silent(columns, misfit(columns, 0.0, score, 0.0)).any()
