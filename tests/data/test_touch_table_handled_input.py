"""Odd input that can still be used: the same touches come out, and the notes say what was handled."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from input_tables import GOOD, error, good, notes, put
from same_touches import same_touches

from bayestouch.data.remarks import Tally, remarks
from bayestouch.data.sensor import Pad, Sensor
from bayestouch.data.touch_table import read_touches
from bayestouch.data.touches import touches_from


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    return partial(put, tmp_path)


WINDOWS = "read with Windows line ends"
BOM = "a byte order mark was skipped"


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("\ufeff" + GOOD, [BOM]),
        (GOOD.replace("\n", "\r\n"), [WINDOWS]),
        ("\ufeff" + GOOD.replace("\n", "\r\n"), [BOM, WINDOWS]),
        (GOOD.replace("\n", "\r"), []),
        (GOOD.replace(",", ";"), ["read with semicolons between the columns"]),
        (GOOD.replace(",", "\t"), ["read with tabs between the columns"]),
        (
            GOOD.replace(",", ";").replace(".", ","),
            ["read with semicolons between the columns", "read with decimal commas"],
        ),
        (
            GOOD.replace(",", "\t").replace(".", ","),
            ["read with tabs between the columns", "read with decimal commas"],
        ),
        (GOOD.rstrip("\n"), []),
        ("\n" + GOOD.replace("\n", "\n\n"), []),
        (GOOD + ",,,,,\n,,,,,\n", ["2 empty rows skipped"]),
        (GOOD.replace(",", " , ").replace("touch", "  touch"), []),
        (GOOD.replace("touch", '"touch"').replace("1.5", '"1.5"'), []),
        (GOOD.replace("1,0,2.5", "1.0,0.0,2.5e0"), []),
    ],
)
def test_other_ways_to_write_the_same_table(write: Callable[..., Path], table: str, said: list[str]) -> None:
    expected = good(write(GOOD))
    path = write(table)
    assert same_touches(good(path), expected)
    assert notes(path) == said


def test_decimal_commas_and_points_in_one_file(write: Callable[..., Path]) -> None:
    table = GOOD.replace(",", ";").replace("1.5", "1,5")
    assert (
        error(write(table))
        == "touches.csv, row 4, column x_mm: expected a decimal comma as elsewhere in the file, got '2.5'"
    )
    line = error(write(table.replace("2.5", "2,5").replace("12;22", "12;1.234,5")))
    assert line == "touches.csv, row 4, column e02: expected a number, got '1.234,5'"


def test_words_for_a_missing_number(write: Callable[..., Path]) -> None:
    path = write(GOOD.replace("10,20", "NaN,20").replace("12,22", "12, n/a"))
    np.testing.assert_array_equal(good(path).readings, [[np.nan, 20], [11, 21], [12, np.nan]])
    assert notes(path) == [
        "2 cells with a word for a missing number, taken as missing; the first in row 2, column e01",
        "2 readings missing, the most in e01 (33.3 % of its rows)",
    ]


def test_all_readings_of_an_element_missing(write: Callable[..., Path]) -> None:
    path = write(GOOD.replace("20\n", "\n").replace("21\n", "\n").replace("22\n", "\n"))
    assert notes(path) == ["e02: no reading in any row, so nothing is learnt from this element"]
    assert good(path).usable_elements.tolist() == [True, False]


def test_a_row_without_readings(write: Callable[..., Path]) -> None:
    assert notes(write(GOOD.replace("11,21", ","))) == [
        "2 readings missing, the most in e01 (33.3 % of its rows)",
        "1 of 3 rows without any reading",
    ]


def test_one_touch_only(write: Callable[..., Path]) -> None:
    path = write("touch,x_mm,load_N,e01,e02\n0,1,2,3,4\n")
    assert good(path).n_touches == 1
    assert notes(path) == ["one touch only: there is nothing to compare it with"]


def table_of(readings: np.ndarray, **columns: object) -> str:
    names = ["touch", "x_mm", "load_N", *columns, "e01", "e02"]
    n = len(readings)
    given = [np.broadcast_to(np.asarray(v), n) for v in columns.values()]
    rows = zip(range(n), range(n), [1] * n, *given, *readings.T.tolist(), strict=True)
    return ",".join(names) + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows)


def test_a_saturated_column(write: Callable[..., Path]) -> None:
    generator = np.random.default_rng(0)
    readings = generator.normal(size=(100, 2)).round(3)
    assert notes(write(table_of(readings))) == []
    readings[:, 1] = np.minimum(readings[:, 1], np.quantile(readings[:, 1], 0.75).round(3))
    share = np.mean(readings[:, 1] == readings[:, 1].max())
    assert share > 0.2
    assert notes(write(table_of(readings))) == [
        f"e02: {100 * share:.0f} % of the readings in contact are exactly its largest, "
        f"{readings[:, 1].max():g}: the element may be saturated there"
    ]
    # Rows without contact do not count: there an element rests.
    rests = table_of(readings, contact=(readings[:, 1] < readings[:, 1].max()).astype(int))
    assert [note for note in notes(write(rests)) if "saturated" in note] == []


def test_a_column_clipped_at_the_bottom(write: Callable[..., Path]) -> None:
    readings = np.maximum(np.random.default_rng(1).normal(size=(60, 2)).round(3), 0.0)
    said = notes(write(table_of(readings)))
    assert len(said) == 2 and all(
        "exactly its smallest, 0: the element may be saturated there" in note for note in said
    )


@pytest.mark.parametrize(("step", "coarse"), [(0.5, False), (1.5, False), (10.0, True), (100.0, True)])
def test_coarse_steps_are_told_from_saturation(step: float, coarse: bool) -> None:
    """Three touches in four are far from the element: its smallest reading is a quarter of all, or more.

    A reading of noise 1 that is cut off below zero piles up there with fine steps; without a cut only coarse steps do.
    """
    generator = np.random.default_rng(2)
    touch, signal = np.repeat(np.arange(400), 10), np.repeat(generator.uniform(-150, 50, 400).clip(0), 10)
    reading = np.round((signal + generator.normal(size=4000)).clip(0 if step < 2 else -1e9) / step) * step
    table = touches_from(touch=touch, readings=reading[:, None])
    (said,) = [each for each in remarks(Tally.of(table)) if "exactly" in each]
    assert "exactly its smallest" in said
    assert said.endswith(
        "steps of the readout are larger than twice the noise, or the element is saturated there"
        if coarse
        else ": the element may be saturated there"
    )


def test_a_constant_column(write: Callable[..., Path]) -> None:
    readings = np.stack([np.arange(20.0), np.full(20, 3.5)], axis=1)
    path = write(table_of(readings))
    assert notes(path) == ["e02: constant at 3.5, so nothing is learnt from this element"]
    assert good(path).usable_elements.tolist() == [True, False]


def test_loads_below_zero_and_missing_are_kept_and_said(write: Callable[..., Path]) -> None:
    path = write(GOOD.replace("1.5,2,10", "1.5,-0.25,10").replace("2.5,2", "2.5,"))
    np.testing.assert_array_equal(good(path).load, [-0.25, 2, np.nan])
    assert good(path).in_contact.all()
    assert notes(path) == [
        "1 of 3 rows without a measured load",
        "1 of 3 rows with a load below zero (lowest -0.25), kept: noise or offset of the force sensor",
    ]


INSTEAD = "where times matter, the order of the touches is used in their place"
SORTED = "where times matter, touches are sorted by them, or taken in this order if they overlap in time"


@pytest.mark.parametrize(
    ("times", "said"),
    [
        ("0 1 5 6 9 10", []),
        (
            "0 1 5 6 5 4",
            [f"times become smaller from one touch to the next (1 touch began before the one above): {SORTED}"],
        ),
        (
            "9 8 5 6 0 1",
            [f"times become smaller from one touch to the next (2 touches began before the one above): {SORTED}"],
        ),
        ("0 1  6 9 10", [f"1 of 6 rows without a time: {INSTEAD}"]),
        ("     ", []),  # unknown, as with no such column
    ],
)
def test_times_that_restart_or_are_missing_are_said(write: Callable[..., Path], times: str, said: list[str]) -> None:
    """The last touch begins with its second row, the first in time."""
    rows = [f"{k // 2},{k % 2},1,{time},{k},{k * k}" for k, time in enumerate(times.split(" "))]
    path = write("\n".join(["touch,sample,x_mm,time_s,e01,e02", *rows, ""]))
    assert [note for note in notes(path) if "time" in note] == said


def test_no_load_and_missing_locations_are_said(write: Callable[..., Path]) -> None:
    assert notes(write("touch,x_mm,e01,e02\n0,,2,3\n1,1,2,4\n")) == [
        "no load measured",
        "1 of 2 rows without a reference location",
        "e01: constant at 2, so nothing is learnt from this element",
    ]


def test_rows_without_contact_are_counted_and_contradictions_said(write: Callable[..., Path]) -> None:
    path = write(
        "touch,x_mm,load_N,depth_mm,contact,e01,e02\n0,1,1,1,1,1,2\n1,1,1,0,1,2,3\n2,1,1,1,0,3,4\n3,1,0,1,,4,5\n"
    )
    assert good(path).in_contact.tolist() == [True, False, False, False]
    assert notes(path) == [
        "3 of 4 rows without contact (contact, depth or load is 0)",
        "1 of 4 rows with contact = 1 but a depth or a load of 0, taken as without contact",
    ]


def test_a_misspelt_column_is_kept_and_the_right_name_asked_for(write: Callable[..., Path]) -> None:
    path = write("touch,x_mm,lod_N,operator,e01,e02\n0,5,1,7,2,3\n1,6,1,7,3,4\n")
    assert good(path).load.tolist() == pytest.approx([np.nan, np.nan], nan_ok=True)
    assert notes(path)[0] == "columns not known here, kept and not used: lod_N, operator; did you mean load_N?"


def test_a_column_without_a_name_is_kept(write: Callable[..., Path]) -> None:
    path = write(",touch,x_mm,load_N,e01,e02\n0,5,1,1,2,3\n1,6,1,1,3,4\n")
    assert good(path).extra["column_1"].tolist() == ["0", "1"]
    assert notes(path) == ["columns not known here, kept and not used: column_1"]


def test_times_are_counted_in_pieces_as_in_the_whole() -> None:
    time = np.array([np.nan, 0.0, 3.0, 4.0, 2.0, 5.0, 1.0])
    touches = touches_from(np.arange(7), np.ones((7, 2)), x_mm=1.0, time_s=time)
    known = touches.select(slice(1, None))
    for cut in range(1, 6):
        pieces = [Tally.of(known.select(part)) for part in (slice(0, cut), slice(cut, None))]
        assert (pieces[0] + pieces[1]).begun_before == Tally.of(known).begun_before == 2
    whole = Tally.of(touches.select([0])) + Tally.of(known) + Tally.of(touches.select([0]))
    assert (whole.begun, whole.begun_last, whole.begun_before, whole.time_missing) == (0.0, 1.0, 2, 2)


def test_reading_one_table_by_itself(write: Callable[..., Path]) -> None:
    path = write(GOOD) / "touches.csv"
    assert read_touches(path, Sensor("s", Pad((0, 6)))).n_rows == 3
    assert read_touches(str(path), Sensor("s", Pad((0, 6)))).n_rows == 3
