"""Touches as means and deviations: rows that stand for several reads weigh so much."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.chain.recording import History
from bayestouch.data.touches import Touches
from bayestouch.model.observations import Observations, UntimedTouches, history_of

NAN = np.nan


def table() -> Touches:
    """Touch 5 with rows of 1 and 3 reads and one of rest, touch 2 with one row of unknown reads."""
    n = 4
    return Touches(
        touch=np.array([5, 5, 5, 2]),
        sample=np.array([0, 1, 2, 0]),
        time_s=np.array([0.0, 1.0, 2.0, 9.0]),
        indenter_radius_mm=np.full(n, 6.0),
        angle_deg=np.array([10.0, 10.0, 10.0, 20.0]),
        x_mm=None,
        y_mm=None,
        load=np.array([0.0, 4.0, 4.0, 7.0]),
        depth_mm=np.full(n, NAN),
        contact=np.array([0.0, 1.0, 1.0, 1.0]),
        readings=np.array([[9.0, 9.0], [1.0, NAN], [5.0, 6.0], [2.0, 3.0]]),
        reads=np.array([1.0, 1.0, 3.0, NAN]),
    )


def observed() -> Observations:
    history: Any = SimpleNamespace()
    time = np.array([0.0, 1.0, 2.0, 9.0])
    return Observations.of(table(), time, time / 10, "s", history, (0.0, 9.0), ((0.0, 9.0),))


def test_means_and_deviations() -> None:
    found = observed()
    np.testing.assert_array_equal(found.row_touch, [0, 0, 1])
    np.testing.assert_array_equal(found.weight, [1.0, 3.0, 1.0])
    np.testing.assert_allclose(found.means.readings, [[4.0, 6.0], [2.0, 3.0]])
    np.testing.assert_allclose(found.deviation, [[-3.0, NAN], [1.0, 0.0], [0.0, 0.0]])
    np.testing.assert_array_equal(found.time_s, [1.0, 2.0, 9.0])
    np.testing.assert_array_equal(found.held_s, [0.1, 0.2, 0.9])
    np.testing.assert_allclose(found.touch_time_s, [1.75, 9.0])
    np.testing.assert_array_equal(found.load, [4.0, 7.0])
    columns = np.array([[1.0, 10.0], [2.0, 30.0], [8.0, 9.0]])
    # The second element has no reading in the first row.
    np.testing.assert_allclose(found.of_touches(columns), [[1.75, 30.0], [8.0, 9.0]])
    np.testing.assert_allclose(found.of_touches(columns[:, 1]), [25.0, 9.0])
    assert found.n_touches == 2 and found.table.n_rows == 3 and found.sessions == ((0.0, 9.0),)


def test_values_of_an_element_without_readings_are_averaged_over_all_samples() -> None:
    columns = np.array([[1.0, 10.0], [2.0, 30.0], [8.0, 9.0]])
    lost = np.array([[False, False], [False, True], [False, False]])
    np.testing.assert_allclose(observed().without(lost).of_touches(columns), [[1.75, 25.0], [8.0, 9.0]])
    lost[0, 0] = True
    np.testing.assert_allclose(observed().without(lost).of_touches(columns), [[2.0, 25.0], [8.0, 9.0]])


def test_a_touch_is_within_the_times_of_its_samples() -> None:
    """The mean of three equal times is above them by rounding: its touch would be after the end of the session."""
    end = 3599.3
    assert (end + end + end) / 3 > end
    columns = {name: np.full(3, NAN) for name in ("depth_mm", "load")}
    three = Touches(
        touch=np.zeros(3, dtype=np.int64),
        sample=np.arange(3),
        time_s=np.full(3, end),
        indenter_radius_mm=np.full(3, 6.0),
        angle_deg=np.zeros(3),
        x_mm=None,
        y_mm=None,
        contact=np.ones(3),
        readings=np.ones((3, 2)),
        reads=np.ones(3),
        **columns,
    )
    history: Any = SimpleNamespace()
    found = Observations.of(three, three.time_s, three.time_s, "s", history, (0.0, end), ((0.0, end),))
    np.testing.assert_array_equal(found.touch_time_s, [end])


def test_without_wrong_readings() -> None:
    wrong = np.array([[False, False], [True, False], [False, False]])
    found = observed().without(wrong)
    np.testing.assert_allclose(found.means.readings, [[1.0, 6.0], [2.0, 3.0]])
    np.testing.assert_array_equal(found.time_s, [1.0, 2.0, 9.0])


def test_readings_that_were_removed_come_back() -> None:
    """Also where others were removed after them."""
    whole = observed()
    first = np.array([[False, False], [True, False], [False, False]])
    second = np.array([[False, False], [False, False], [False, True]])
    back = whole.without(first).without(second).with_all_readings()
    np.testing.assert_array_equal(back.table.readings, whole.table.readings)
    np.testing.assert_array_equal(back.means.readings, whole.means.readings)
    np.testing.assert_array_equal(back.deviation, whole.deviation)
    assert back.as_read is None and whole.with_all_readings() is whole


def test_history() -> None:
    """Mean reading of each touch in the order of time, which here is the other way round; rest left out."""
    found = history_of(table(), np.array([20.0, 21.0, 23.0, 9.0]))
    np.testing.assert_array_equal(found.end_s, [9.0, 23.0])
    np.testing.assert_allclose(found.readings, [[2.0, 3.0], [3.0, 6.0]])


def test_touches_of_which_only_the_number_counts() -> None:
    touches = UntimedTouches(3)
    assert np.isnan(touches.load).all() and len(touches.load) == 3 and touches.unit == "s"
    for later in (touches.touch_time_s, touches.time_s):
        np.testing.assert_array_equal(later, np.full(3, np.inf))
    np.testing.assert_array_equal(UntimedTouches(2, np.array([3.0, 4.0])).time_s, [3.0, 4.0])
    np.testing.assert_array_equal(touches.held_s, np.zeros(3))
    np.testing.assert_array_equal(touches.row_touch, [0, 1, 2])
    values = np.arange(3.0)
    assert touches.of_touches(values) is values


def test_earlier_readings_with_swapped_wires() -> None:
    """Touches are as they were; what was read before them is in the other order."""
    before = replace(observed(), history=History(np.ones(1), np.array([[1.0, 2.0]])))
    after = before.with_wires(np.array([1, 0]))
    np.testing.assert_array_equal(after.history.readings, [[2.0, 1.0]])
    np.testing.assert_array_equal(after.means.readings, before.means.readings)
