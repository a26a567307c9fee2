"""The split of a table into touches to calibrate with and touches to be read."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Finger, Pad, Sensor
from bayestouch.data.splits import checkerboard, default_cell, with_calibration
from bayestouch.data.touches import Touches, touches_from
from bayestouch.errors import InputError


def along(x: object, **columns: object) -> Touches:
    n = len(np.asarray(x))
    return touches_from(columns.pop("touch", range(n)), np.arange(n, dtype=float)[:, None], x_mm=x, **columns)


def plane(x: np.ndarray, y: np.ndarray) -> Touches:
    return along(x, y_mm=y)


def test_every_other_position_along_a_line() -> None:
    x = np.array([3.0, 1.0, 1.0, 2.5, 0.0, 3.0])
    assert checkerboard(along(x)).tolist() == [False, False, False, True, True, False]


def test_the_same_place_with_other_last_digits_is_one_place() -> None:
    x = np.array([0.1 + 0.2, 0.3, 0.0, 0.9])
    assert checkerboard(along(x)).tolist() == [False, False, True, True]


def test_angles_a_full_turn_apart_are_one_place() -> None:
    angles = [-180.0, 180.0, -90.0, 0.0, 90.0, 270.0]
    chosen = checkerboard(touches_from(range(6), np.ones((6, 1)), angle_deg=angles))
    assert chosen.tolist() == [True, True, False, True, False, False]


def test_a_sweep_about_zero_is_one_row() -> None:
    """Nine positions from -16 to 16 degree, in any order and one a turn on: every other one, also at zero."""
    angles = np.array([-16.0, 8.0, 4.0, 348.0, 0.0, -8.0, 12.0, -4.0, 16.0])
    chosen = checkerboard(touches_from(range(9), np.ones((9, 1)), angle_deg=angles))
    assert sorted(angles[chosen]) == [-16.0, -8.0, 0.0, 8.0, 16.0]


def test_a_grid_is_split_like_a_checkerboard_though_its_lines_are_uneven() -> None:
    lines = np.cumsum([2.05, 0.4, 0.6, 0.4, 0.6, 0.4])
    x, y = (v.ravel() for v in np.meshgrid(lines, lines))
    i, j = (v.ravel() for v in np.meshgrid(range(6), range(6)))
    touches = plane(x, y)
    assert default_cell(touches) is None
    np.testing.assert_array_equal(checkerboard(touches), (i + j) % 2 == 0)


def test_scattered_places_are_split_by_cells_about_as_large_as_their_spacing() -> None:
    generator = np.random.default_rng(3)
    x, y = generator.uniform(0, 10, 400), generator.uniform(0, 40, 400)
    touches = plane(x, y)
    cell = default_cell(touches)
    assert cell == pytest.approx(1.0, rel=0.02)  # √(10·40/400), less the ends that no touch reached
    colour = np.floor((x - x.min()) / cell + 1e-9) + np.floor((y - y.min()) / cell + 1e-9)
    np.testing.assert_array_equal(checkerboard(touches), colour % 2 == 0)


def test_a_cell_of_ones_own() -> None:
    x = np.arange(12) / 10
    assert checkerboard(along(x), cell=0.3).tolist() == ([True] * 3 + [False] * 3) * 2


@given(
    st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)), min_size=2, max_size=40),
    st.sampled_from([None, 1.0, 2.0]),
)
@settings(deadline=None)
def test_touches_and_places_are_never_divided(places: list[tuple[int, int]], cell: float | None) -> None:
    x, y = np.array(places, dtype=float).T
    touches = touches_from(
        np.repeat(range(len(x)), 3), np.ones((3 * len(x), 1)), x_mm=np.repeat(x, 3), y_mm=np.repeat(y, 3)
    )
    try:
        chosen = checkerboard(touches, cell)
    except InputError as error:
        assert "in one cell" in str(error)
        return
    colour_of: dict[tuple[int, int], set[bool]] = {}
    for place, colour in zip(np.repeat(places, 3, axis=0).tolist(), chosen.tolist(), strict=True):
        colour_of.setdefault(tuple(place), set()).add(colour)
    assert all(len(colours) == 1 for colours in colour_of.values())
    assert chosen.any() and not chosen.all()


def test_a_touch_goes_by_its_first_place_in_contact() -> None:
    touches = along([0.0, 1.0, 2.0, 0.0], touch=[5, 5, 5, 6], contact=[0, 1, 1, 1])
    # Touch 5 is at 1 mm: not where it was before the contact, nor where it slid to.
    assert checkerboard(touches).tolist() == [False, False, False, True]


def test_touches_without_a_place_are_not_chosen() -> None:
    assert checkerboard(along([np.nan, 0.0, 1.0, np.nan])).tolist() == [False, True, False, False]


@pytest.mark.parametrize("cell", [None, 1.0])
@pytest.mark.parametrize("first", [0, 1])
def test_a_staggered_grid_is_split(first: int, cell: float | None) -> None:
    """Every other line is shifted by half a step, so that all places are on one colour of a checkerboard.

    Along each line every other place calibrates.
    """
    places = [(2 * i + (j + first) % 2, j) for j in range(4) for i in range(4)]
    chosen = checkerboard(plane(*np.array(places, dtype=float).T), cell)
    wanted = [[True, False, True, False], [False, True, False, True]] * 2
    np.testing.assert_array_equal(chosen.reshape(4, 4), wanted)


@pytest.mark.parametrize(
    ("touches", "cell", "message"),
    [
        (touches_from([1, 2], np.ones((2, 1))), None, "without a reference location cannot be split"),
        (along([np.nan, np.nan]), None, "without a reference location cannot be split"),
        (along([1.0]).select([]), None, "the table of touches has no rows"),
        (along([1.0, 1.0]), None, "all touches are in one cell"),
        (along([0.0, 1.0]), 2.0, "all touches are in one cell"),
        (along([0.0, 1.0]), 0.0, "expected a cell above zero, got 0.0"),
        (along([0.0, 1.0]), np.nan, "expected a cell above zero, got nan"),
    ],
)
def test_what_cannot_be_split(touches: Touches, cell: float | None, message: str) -> None:
    with pytest.raises(InputError, match=message):
        checkerboard(touches, cell)


def test_a_data_set_without_calibration_gets_one_and_says_how() -> None:
    touches = along([0.0, 1.0, 2.0, 3.0, np.nan], contact=[1, 1, 1, 1, 0])
    split = with_calibration(DataSet(Sensor("s", Pad((0.0,))), None, touches, notes=("before",)))
    assert split.calibration is not None
    # The no-contact touch without a place is the baseline of both.
    assert split.calibration.touch.tolist() == [0, 2, 4]
    assert split.touches.touch.tolist() == [1, 3, 4]
    assert split.notes == (
        "before",
        "no calibration table: touches in every other position calibrate (3 touches), the others are read (3)",
    )
    assert with_calibration(split) is split


def test_the_note_names_the_cell() -> None:
    x, y = (v.ravel() for v in np.meshgrid(range(4), range(4)))
    split = with_calibration(DataSet(Sensor("s", Pad((0.0,), (0.0,))), None, plane(x, y)), cell=2)
    assert "touches in a checkerboard of cells of 2 mm calibrate (8 touches)" in split.notes[-1]
    finger = Sensor("f", Finger(1, 3, 2, (0.0,)))
    angles = touches_from(range(4), np.ones((4, 1)), angle_deg=[0, 10, 20, 30])
    assert (
        "every other cell of 20 degree calibrate (2 touches)"
        in with_calibration(DataSet(finger, None, angles), 20).notes[-1]
    )


@pytest.mark.parametrize("cell", [None, 8.0])
def test_a_rounding_error_below_a_whole_turn_is_no_place_of_its_own(cell: float | None) -> None:
    """Places 0, 10 and 20 degree; 360 would be the next one, and in cell 45 of 8 degree."""
    angles = [0.0, -1e-14, 360 - 1e-13, 10.0, 20.0, -360.0]
    table = touches_from(range(6), np.ones((6, 1)), angle_deg=angles)
    assert checkerboard(table, cell).tolist() == [True, True, True, False, True, True]
