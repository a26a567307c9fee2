"""Clocks of tables: their own, or the order of the rows; and two tables one after the other, or in turn."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.model.timing import Timing, one_clock, typical_gap


def table(time: list[float], touch: list[int], contact: list[bool] | None = None) -> Any:
    n = len(time)
    sample = [touch[:i].count(touch[i]) for i in range(n)]
    made = SimpleNamespace(touch=np.array(touch), time_s=np.array(time), sample=np.array(sample), n_rows=n)
    made.in_contact = np.ones(n, dtype=bool) if contact is None else np.array(contact)
    made.with_ = lambda time_s: table(time_s.tolist(), touch, contact)
    return made


def test_own_clock() -> None:
    """From the first row; held since the first row of the touch that is in contact."""
    found = Timing.of(table([10.0, 11.0, 13.0, 20.0, 22.0], [0, 0, 0, 5, 5], [False, True, True, True, True]))
    np.testing.assert_array_equal(found.time_s, [0, 1, 3, 10, 12])
    np.testing.assert_array_equal(found.held_s, [0, 0, 2, 0, 2])
    assert (found.unit, found.note) == ("s", "")


def test_touches_at_the_same_time_and_at_rest() -> None:
    """Two touches may begin together; one that is all rest has no beginning and is held for no time."""
    found = Timing.of(table([1.0, 1.0, 2.0, 4.0], [0, 1, 2, 3], [True, True, False, True]))
    assert found.unit == "s"
    np.testing.assert_array_equal(found.held_s, [0, 0, 0, 0])


@pytest.mark.parametrize(
    ("time", "why"),
    [
        ([0.0, 1.0, 2.0, np.nan, 4.0], "times are missing"),
        ([0.0, 1.0, np.inf, 3.0, 4.0], "times are missing"),
        ([5.0, 6.0, 7.0, 4.0, 5.0], "touches overlap in time, as where a clock begins again"),
        ([5.0, 6.0, 7.0, 1.0, 8.0], "touches overlap in time, as where a clock begins again"),
        ([3.0, 3.0, 3.0, 3.0, 3.0], "all times are the same"),
    ],
)
def test_order_of_rows_where_there_is_no_clock(time: list[float], why: str) -> None:
    """One unit a touch, of which its samples fill a fifth."""
    found = Timing.of(table(time, [4, 4, 4, 2, 2]))
    np.testing.assert_allclose(found.time_s, [0, 0.1, 0.2, 1, 1.1])
    np.testing.assert_allclose(found.held_s, [0, 0.1, 0.2, 0, 0.1])
    assert found.unit == "touch"
    assert found.note == f"{why}: the order of the rows is taken as time, one unit a touch."
    one = Timing.of(table([np.nan, np.nan], [0, 1]))
    np.testing.assert_array_equal(one.time_s, [0.0, 1.0])


@pytest.mark.parametrize(
    ("touch", "time"),
    [
        # Sorted by tip: three tips in turn, two samples each.
        ([0, 0, 3, 3, 1, 1, 4, 4, 2, 2, 5, 5], [0.0, 1, 15, 16, 5, 6, 20, 21, 10, 11, 25, 26]),
        # The last one first, and in no order at all.
        ([3, 3, 2, 2, 1, 1, 0, 0], [15.0, 16, 10, 11, 5, 6, 0, 1]),
        ([2, 2, 4, 4, 0, 0, 3, 3, 1, 1], [10.0, 11, 20, 21, 0, 1, 15, 16, 5, 6]),
    ],
)
def test_touches_in_any_order_keep_their_times(touch: list[int], time: list[float]) -> None:
    found = Timing.of(table([7 + each for each in time], touch))
    np.testing.assert_array_equal(found.time_s, time)
    np.testing.assert_array_equal(found.held_s, np.tile([0, 1], len(time) // 2))
    assert (found.unit, found.note) == ("s", "")


def test_clocks_that_begin_again_are_not_sorted_into_each_other() -> None:
    """Two times thirty touches of one sample, about 5 s apart, none at the same time as another."""
    rng = np.random.default_rng(0)
    time = np.concatenate([np.cumsum(rng.uniform(4, 6, 30)) for _ in range(2)])
    assert len(np.unique(time)) == 60
    found = Timing.of(table(time.tolist(), list(range(60))))
    np.testing.assert_array_equal(found.time_s, np.arange(60))
    assert found.note.startswith("touches overlap in time")
    # The same touches of one clock, split by parity: those of one half are about 10 s apart, those of both 5 s.
    time = np.cumsum(rng.uniform(4, 6, 60))
    order = np.concatenate([np.arange(0, 60, 2), np.arange(1, 60, 2)])
    found = Timing.of(table(time[order].tolist(), list(range(60))))
    np.testing.assert_array_equal(found.time_s, time[order] - time[0])


def test_samples_are_counted_from_the_first_in_contact() -> None:
    """Whatever number the first one has. Of 10 to 13 the first is at rest, so that two steps are the longest."""
    made = table([np.nan] * 6, [1, 1, 1, 1, 2, 2], [False, True, True, True, True, True])
    made.sample = np.array([10, 11, 12, 13, 1, 7])
    found = Timing.of(made)
    np.testing.assert_allclose(found.held_s, [0, 0, 0.1, 0.2, 0, 0.1])
    np.testing.assert_allclose(found.time_s, [0, 0, 0.1, 0.2, 1, 1.1])


def test_gap_between_touches() -> None:
    """From last row to first row of the next: 3 and 5, in any order of rows."""
    time, held = np.array([0.0, 1.0, 4.0, 5.0, 10.0]), np.array([0.0, 1.0, 0.0, 1.0, 0.0])
    assert typical_gap(time, held) == 4.0
    order = [3, 0, 4, 2, 1]
    assert typical_gap(time[order], held[order]) == 4.0
    assert typical_gap(time[:2], held[:2]) == 0.0


def test_a_table_after_another() -> None:
    moved = Timing(np.array([0.0, 2.0]), np.array([0.0, 1.0]), "s", "note").after(10.0, 3.0)
    np.testing.assert_array_equal(moved.time_s, [13.0, 15.0])
    assert (moved.held_s.tolist(), moved.unit, moved.note) == ([0.0, 1.0], "s", "note")


FIRST = table([100.0, 101.0, 104.0], [0, 0, 1])


@pytest.mark.parametrize(
    ("begin", "wanted"),
    # After the first on its clock, in turn with it, before it, or right after it by its gap of 3 s if they overlap.
    [
        (110.0, [10.0, 12.0]),
        (104.0, [4.0, 6.0]),
        (103.0, [3.0, 5.0]),
        (60.0, [-40.0, -38.0]),
        (100.5, [7.0, 9.0]),
        (102.0, [7.0, 9.0]),
        (100.0, [7.0, 9.0]),
    ],
)
def test_one_clock_for_two_tables(begin: float, wanted: list[float]) -> None:
    one, two, in_turn = one_clock(FIRST, table([begin, begin + 2], [0, 1]))
    start = min(0.0, *wanted)
    np.testing.assert_array_equal(one.time_s, np.array([0, 1, 4]) - start)
    np.testing.assert_array_equal(two.time_s, np.array(wanted) - start)
    assert in_turn == (begin == 103.0)
    replaced = wanted[0] == 7.0
    assert (one.note, "the two tables overlap" in two.note) == ("", replaced)


def test_each_table_with_a_clock_of_its_own() -> None:
    """Twenty touches of one sample each from the same start, of which no two coincide but the first."""
    one, two, in_turn = one_clock(*(table((pace * np.arange(20)).tolist(), list(range(20))) for pace in (5.0, 5.1)))
    np.testing.assert_allclose(two.time_s - one.time_s.max(), 5.0 + 5.1 * np.arange(20))
    assert two.note and not in_turn


def test_one_good_clock_of_two_is_none() -> None:
    for first, second in ((FIRST, table([np.nan] * 3, [0, 0, 1])), (table([np.nan] * 3, [0, 0, 1]), FIRST)):
        one, two, in_turn = one_clock(first, second)
        assert not in_turn
        assert one.unit == two.unit == "touch"
        np.testing.assert_allclose(one.time_s, [0, 0.2, 1])
        # From the end of the first touch at 0.2 to the next at 1: a gap of 0.8.
        np.testing.assert_allclose(two.time_s, [1.8, 2.0, 2.8])


def test_a_gap_is_not_one_of_rounding() -> None:
    """Three touches of ten samples each, 5 s apart; times minus times held differ in their last digits."""
    samples = 0.1 * np.arange(10)
    time, held = np.concatenate([begin + samples for begin in (0.3, 6.2, 12.1)]), np.tile(samples, 3)
    steps = np.diff(time - held)
    # More of them than there are gaps.
    assert ((steps > 0) & (steps < 1e-9)).sum() > 2
    assert typical_gap(time, held) == pytest.approx(5.0)
    assert typical_gap(np.zeros(0), np.zeros(0)) == 0.0
    # A recording whose touches all begin at once has no gap.
    assert typical_gap(np.zeros(3), np.zeros(3)) == 0.0


def test_clock_in_the_unit_of_a_calibration() -> None:
    """A calibration without times counts touches, also where a table has times; the other way round they do not fit."""
    timed, untimed = table([10.0, 11.0, 20.0], [0, 0, 1]), table([np.nan] * 3, [0, 0, 1])
    found = Timing.in_unit(timed, "touch")
    np.testing.assert_array_equal(found.time_s, Timing.of(untimed).time_s)
    np.testing.assert_array_equal(found.held_s, Timing.of(untimed).held_s)
    assert found.unit == "touch"
    how = "the order of the rows is taken as time, one unit a touch."
    assert found.note == f"the touches of the calibration had no times: {how}"
    found = Timing.in_unit(untimed, "s")
    np.testing.assert_allclose(found.time_s, [0.0, 0.2, 1.0])
    assert found.unit == "touch"
    assert found.note == (f"times are missing: {how} The effects of the calibration have times in s, which do not fit.")
    for one, unit in ((timed, "s"), (untimed, "touch")):
        same = Timing.in_unit(one, unit)
        np.testing.assert_array_equal(same.time_s, Timing.of(one).time_s)
        assert (same.unit, same.note) == (unit, Timing.of(one).note)
