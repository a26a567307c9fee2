"""Input that cannot be used ends in one line with file, row and column; what can be is said in the notes."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from input_tables import FINGER, GOOD, SENSOR, error, notes, put
from same_touches import same_touches

from bayestouch.data.dataset import load_dataset, save_dataset
from bayestouch.errors import InputError


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    return partial(put, tmp_path)


def test_the_table_that_the_others_are_changed_from_is_good(write: Callable[..., Path]) -> None:
    assert notes(write(GOOD)) == []


CELLS = [  # what replaces what, and the place and message
    ("12,22", "abc,22", "row 4, column e01: expected a number, got 'abc'"),
    ("12,22", "1_2,22", "row 4, column e01: expected a number, got '1_2'"),
    ("12,22", "12,22 mV", "row 4, column e02: expected a number, got '22 mV'"),
    ("12,22", "True,22", "row 4, column e01: expected a number, got 'True'"),
    ("12,22", "12," + "9" * 99 + "x", f"row 4, column e02: expected a number, got '{'9' * 38}…"),
    ("12,22", "inf,22", "row 4, column e01: expected a finite number or nothing, got inf"),
    ("12,22", "12,-inf", "row 4, column e02: expected a finite number or nothing, got -inf"),
    ("12,22", "1e999,22", "row 4, column e01: expected a finite number or nothing, got inf"),
    ("2.5,2", "inf,2", "row 4, column x_mm: expected a finite number or nothing, got inf"),
    ("2.5,2", "2.5,inf", "row 4, column load_N: expected a finite number or nothing, got inf"),
    ("12,22", "12,-1e38", "row 4, column e02: expected a number from -1e12 to 1e12, got -1e+38"),
    ("2.5,2", "2.5,1e155", "row 4, column load_N: expected a number from -1e12 to 1e12, got 1e+155"),
    ("2.5,2", "1e30,2", "row 4, column x_mm: expected a number from -1e12 to 1e12, got 1e+30"),
    ("1,0,2.5", "1.5,0,2.5", "row 4, column touch: expected an integer below 2^53, got 1.5"),
    ("1,0,2.5", ",0,2.5", "row 4, column touch: expected an integer below 2^53, got nothing"),
    ("1,0,2.5", "x,0,2.5", "row 4, column touch: expected a number, got 'x'"),
    (
        "1,0,2.5",
        "9007199254740993,0,2.5",
        "row 4, column touch: expected an integer below 2^53, got 9007199254740992",
    ),
    ("1,0,2.5", "1,-1,2.5", "row 4, column sample: expected an integer from 0 up, got -1"),
    ("1,0,2.5", "1,,2.5", "row 4, column sample: expected an integer from 0 up, got nothing"),
    ("1,0,2.5", "0,1,2.5", "row 4, column sample: touch 0 has sample 1 twice, before in row 3"),
    ("12,22", "12", "row 4: expected 6 cells as in the header, got 5"),
    ("12,22", "12,22,32", "row 4: expected 6 cells as in the header, got 7"),
    ("12,22", '12,"22', "row 4: expected cells of a table: unexpected end of data"),
    ("12,22", '12,"22"x', "row 4: expected cells of a table: ',' expected after '\"'"),
    (
        "12,22",
        '12,"' + "2" * 200_000 + '"',
        "row 4: expected cells of a table: field larger than field limit (131072)",
    ),
]


@pytest.mark.parametrize(("old", "new", "message"), CELLS)
def test_a_cell_that_cannot_be(write: Callable[..., Path], old: str, new: str, message: str) -> None:
    assert GOOD.count(old) == 1
    assert error(write(GOOD.replace(old, new))).startswith(f"touches.csv, {message}")


@pytest.mark.parametrize(
    ("column", "value", "expected"),
    [
        (
            "indenter_radius_mm",
            "-1",
            "expected a radius from 0 (a knife edge) to inf (a flat) or nothing, got -1",
        ),
        (
            "indenter_radius_mm",
            "-inf",
            "expected a radius from 0 (a knife edge) to inf (a flat) or nothing, got -inf",
        ),
        ("depth_mm", "-0.5", "expected a number from 0 up or nothing, got -0.5"),
        ("depth_mm", "inf", "expected a number from 0 up or nothing, got inf"),
        ("contact", "2", "expected 0, 1 or nothing, got 2"),
        ("contact", "0.5", "expected 0, 1 or nothing, got 0.5"),
        ("contact", "yes", "expected a number, got 'yes'"),
        ("reads", "0", "expected an integer from 1 up or nothing, got 0"),
        ("reads", "2.5", "expected an integer from 1 up or nothing, got 2.5"),
        ("e02_sd", "-0.1", "expected a number from 0 up or nothing, got -0.1"),
        ("e02_sd", "inf", "expected a number from 0 up or nothing, got inf"),
        ("time_s", "inf", "expected a finite number or nothing, got inf"),
        ("time_s", "-2e30", "expected a number from -1e30 to 1e30, got -2e+30"),
        ("depth_mm", "1e38", "expected a number from -1e12 to 1e12, got 1e+38"),
        ("e02_sd", "1e13", "expected a number from -1e12 to 1e12, got 10000000000000"),
        ("indenter_radius_mm", "1e200", "expected a number from -1e12 to 1e12, got 1e+200"),
    ],
)
def test_a_value_that_its_column_cannot_hold(
    write: Callable[..., Path], column: str, value: str, expected: str
) -> None:
    table = f"touch,x_mm,e01,e02,{column}\n0,1,2,3,\n\n1,1,2,3,{value}\n"
    # The empty line is passed over and still counted: the value is in line 4 of the file.
    assert error(write(table)) == f"touches.csv, row 4, column {column}: {expected}"


def test_the_largest_numbers_can_be_read(write: Callable[..., Path]) -> None:
    """Ids have a limit of their own, and an infinite radius is a flat."""
    header = "touch,x_mm,e01,e02,indenter_radius_mm,time_s\n"
    path = write(header + "9007199254740991,-1e12,1e12,-1e12,inf,1e30\n1,1,2,3,1e12,-1e30\n")
    touches = load_dataset(path).touches
    assert touches.touch[0] == 2**53 - 1 and touches.indenter_radius_mm.tolist() == [np.inf, 1e12]
    assert touches.readings.tolist() == [[1e12, -1e12], [2, 3]] and touches.time_s.tolist() == [1e30, -1e30]


def test_two_indenters_in_a_touch(write: Callable[..., Path]) -> None:
    table = "touch,sample,x_mm,indenter_radius_mm,e01,e02\n3,0,1,,2,3\n3,1,1,2,2,3\n4,0,1,1,2,3\n3,2,1,inf,2,3\n"
    expected = "touch 3 is made with one indenter: expected 2 mm as in row 3, got inf"
    assert error(write(table)) == f"touches.csv, row 5, column indenter_radius_mm: {expected}"


def test_the_first_bad_row_is_named_whatever_its_column(write: Callable[..., Path]) -> None:
    table = GOOD.replace("1.5,2,11,21", "1.5,2,11,inf").replace("1,0,2.5", "1,-3,2.5")
    assert error(write(table)).startswith("touches.csv, row 3, column e02:")


def test_a_bad_row_far_down_is_still_named(write: Callable[..., Path]) -> None:
    n = 45_000  # more than two of the pieces in which tables are converted
    rows = [f"{i},1.5,{i % 7},2\n" for i in range(n)]
    rows[-1] = f"{n},1.5,oops,2\n"
    assert error(write("touch,x_mm,e01,e02\n" + "".join(rows))) == (
        f"touches.csv, row {n + 1}, column e01: expected a number, got 'oops'"
    )


TWO = "expected readings of 2 elements (e01 … e02), one for each of element_x_mm in sensor.toml"
HEADERS = [
    ("id,x_mm,e01,e02", "row 1, column touch: expected a header with this column, found id, x_mm, e01, e02"),
    ("0,1.5,2,3", "row 1, column touch: expected a header with this column, found 0, 1.5, 2, 3"),
    ("touch,e01,e02", "row 1, column x_mm: missing: the reference location on a pad"),
    ("touch,angle_deg,e01,e02", "row 1, column x_mm: missing: the reference location on a pad"),
    ("touch,x_mm,a,b", f"row 1, column e01: {TWO}, found none"),
    ("touch,x_mm,e01", f"row 1: {TWO}, found 1"),
    ("touch,x_mm,e01,e02,e03", f"row 1: {TWO}, found 3"),
    (
        "touch,x_mm,e01,e03",
        f"row 1, column e02: missing: {TWO}, found 2",
    ),
    ("touch,x_m,e01,e02", "row 1, column x_mm: missing: the reference location on a pad; is it x_m?"),
    ("touch,x_mm,e01,e_02,e03", f"row 1, column e02: missing: {TWO}, found 2; is it e_02?"),
    ("touch,x_mm,e00,e01", "row 1, column e00: elements are counted from e01"),
    ("touch,x_mm,e01,e1", "row 1, column e1: the same element as e01"),
    ("touch,x_mm,e01,e02,e01_sd,e1_sd", "row 1, column e1_sd: the same as e01_sd"),
    ("touch,x_mm,e01,e02,e01", "row 1, column e01: expected every column once, got this name twice"),
    (
        "touch,x_mm,e01,e02,load_N_per_m",
        "row 1, column load_N_per_m: expected load_N (N) on a pad, found load_N_per_m",
    ),
]


@pytest.mark.parametrize(("header", "message"), HEADERS)
def test_a_header_that_will_not_do(write: Callable[..., Path], header: str, message: str) -> None:
    row = ",".join("1" for _ in header.split(","))
    assert error(write(f"{header}\n{row}\n")) == f"touches.csv, {message}"


def test_a_pad_in_the_plane_needs_y(write: Callable[..., Path]) -> None:
    line = error(write(GOOD, SENSOR + "element_y_mm = [0, 6]\n"))
    assert line == "touches.csv, row 1, column y_mm: missing: the reference location on a pad in the plane"


def test_an_angle_array_of_the_wrong_length(write: Callable[..., Path]) -> None:
    finger = FINGER + "element_angles_deg=[0, 5, 10]\n"
    line = error(write("touch,angle_deg,e01,e02\n0,1,2,3\n", finger))
    assert line == (
        "touches.csv, row 1: expected readings of 3 elements (e01 … e03), "
        "one for each of element_angles_deg in sensor.toml, found 2"
    )


def test_the_load_of_a_pad_on_a_finger(write: Callable[..., Path]) -> None:
    finger = FINGER + "element_angles_deg=[0]\n"
    line = error(write("touch,angle_deg,load_N,e01\n0,1,2,3\n", finger))
    assert line == "touches.csv, row 1, column load_N: expected load_N_per_m (N/m) on a finger, found load_N"


@pytest.mark.parametrize("text", ["", "\n\n", "\ufeff"])
def test_an_empty_file(write: Callable[..., Path], text: str) -> None:
    assert error(write(text)) == "touches.csv: expected a header with column names, got an empty file"


@pytest.mark.parametrize("rest", ["", "\n", "\n\n\n", "\n,,,\n"])
def test_a_header_only(write: Callable[..., Path], rest: str) -> None:
    line = error(write("touch,x_mm,e01,e02" + rest))
    assert line == "touches.csv, row 1: expected at least one row under the header, got none"


def test_no_reading_at_all(write: Callable[..., Path]) -> None:
    line = error(write("touch,x_mm,e01,e02\n0,1,,\n1,2,,\n"))
    assert line == "touches.csv, column e01: no reading in any row of any element"


def test_bytes_that_are_no_utf8(write: Callable[..., Path]) -> None:
    path = write(
        GOOD.replace("e02\n", "e02,note\n").replace("20\n", "20,\n").replace("21\n", "21,5 µm\n").encode("latin-1")
    )
    assert error(path) == "touches.csv, row 3: expected UTF-8 text, got the byte 0xb5"
    assert error(write(GOOD.encode("utf-16"))) == "touches.csv, row 1: expected UTF-8 text, got the byte 0xff"


def test_a_file_of_zeros(write: Callable[..., Path]) -> None:
    assert error(write(b"\0" * 1000)).startswith("touches.csv, row 1, column touch: expected a header with this column")


def test_a_line_without_end(write: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bayestouch.data.tables.MAX_LINE", 1000)
    assert error(write(GOOD + "1" * 1001)) == "touches.csv, row 5: expected a line of at most 1000 characters"
    assert error(write("1" * 1001)) == "touches.csv, row 1: expected a line of at most 1000 characters"


def test_a_file_too_large_to_be_a_touch_table(write: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bayestouch.data.tables.MAX_BYTES", 10)
    assert error(write(GOOD)) == f"touches.csv: expected a table of at most 10 bytes, got {len(GOOD)}: split it"


def test_a_header_of_thousands_of_long_names_still_gives_a_short_line(write: Callable[..., Path]) -> None:
    names = [f"{'long' * 30}{i}" for i in range(5000)]
    assert error(write(",".join(names) + "\n")).startswith("touches.csv, row 1, column touch:")
    assert error(write(f"touch,x_mm,e01,e02,{'long' * 100},{'long' * 100}\n")).startswith(
        "touches.csv, row 1, column long"
    )


def test_a_missing_folder_or_file(tmp_path: Path, write: Callable[..., Path]) -> None:
    assert error(tmp_path / "none") == f"{tmp_path}/none: no such folder"
    assert error(tmp_path) == "sensor.toml: no such file"
    assert error(tmp_path / ("n" * 300)).endswith("nnn: cannot be read: File name too long")
    path = write(GOOD)
    assert (
        error(path / "touches.csv")
        == f"{path}/touches.csv: expected a folder with sensor.toml and touches.csv, got a file"
    )
    (path / "touches.csv").unlink()
    assert error(path) == "touches.csv: no such file"
    (path / "touches.csv").mkdir()
    assert error(path) == "touches.csv: expected a file, found something else of that name"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_not_waited_for(write: Callable[..., Path]) -> None:
    path = write(GOOD)
    (path / "touches.csv").unlink()
    os.mkfifo(path / "touches.csv")
    assert error(path) == "touches.csv: expected a file, found something else of that name"


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read(write: Callable[..., Path]) -> None:
    path = write(GOOD)
    (path / "touches.csv").chmod(0)
    assert error(path) == "touches.csv: cannot be read: Permission denied"


def test_errors_of_the_calibration_name_its_file(write: Callable[..., Path]) -> None:
    path = write(GOOD)
    (path / "calibration.csv").write_text(GOOD.replace("12,22", "12,x"))
    assert error(path) == "calibration.csv, row 4, column e02: expected a number, got 'x'"


def test_errors_of_the_sensor_name_its_file(write: Callable[..., Path]) -> None:
    assert error(write(GOOD, SENSOR.replace("6]", "'6']"))) == (
        "sensor.toml, row 3, column geometry.element_x_mm[1]: expected a number, got '6'"
    )


def test_both_formats_of_a_table(write: Callable[..., Path]) -> None:
    path = write(GOOD)
    (path / "touches.parquet").write_bytes(b"")
    with pytest.raises(InputError, match=r": expected touches.csv or touches.parquet, found both$"):
        load_dataset(path)


def test_parquet_that_is_none(write: Callable[..., Path]) -> None:
    pytest.importorskip("pyarrow")
    path = write(GOOD)
    (path / "touches.csv").rename(path / "touches.parquet")
    assert error(path).startswith("touches.parquet: expected a Parquet file: ")
    (path / "touches.parquet").write_bytes(b"PAR1" + b"\0" * 100 + b"PAR1")
    assert error(path).startswith("touches.parquet: expected a Parquet file: ")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"e01": [1.0, float("inf")]}, "row 3, column e01: expected a finite number or nothing, got inf"),
        ({"e01": [1.0, 3.4e38]}, "row 3, column e01: expected a number from -1e12 to 1e12, got 3.4e+38"),
        ({"e01": ["1", "x"]}, "row 3, column e01: expected a number, got 'x'"),
        ({"e01": [[1.0], [2.0]]}, "column e01: expected numbers, got list<element: double>"),
        ({"e01": []}, "expected at least one row, got none"),
        ({"touch": [None, 1]}, "row 2, column touch: expected an integer below 2^53, got nothing"),
        (
            {"touch": [2**60 + 1, 1]},
            "row 2, column touch: expected an integer below 2^53, got 1.152921504606847e+18",
        ),
        ({"e03": [1.0, 2.0]}, f"row 1: {TWO}, found 3"),
    ],
)
def test_bad_values_in_parquet(write: Callable[..., Path], changes: dict[str, list[object]], message: str) -> None:
    pa = pytest.importorskip("pyarrow")
    pq = pytest.importorskip("pyarrow.parquet")
    path = write(GOOD)
    (path / "touches.csv").unlink()
    columns = {"touch": [0, 1], "x_mm": [1.0, 2.0], "e01": [1.0, 2.0], "e02": [1.0, 2.0]} | changes
    n = min(map(len, columns.values()))
    pq.write_table(pa.table({name: values[:n] for name, values in columns.items()}), path / "touches.parquet")
    joint = ", " if message.startswith(("row", "column")) else ": "
    assert error(path) == f"touches.parquet{joint}{message}"


def test_parquet_without_pyarrow(write: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(GOOD)
    dataset = load_dataset(path)
    (path / "touches.csv").rename(path / "touches.parquet")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    advice = "Parquet needs pyarrow, which is not installed: pip install 'bayestouch[parquet]', or use CSV"
    assert error(path) == f"touches.parquet: {advice}"
    with pytest.raises(InputError, match="Parquet needs pyarrow"):
        save_dataset(dataset, path / "new", "parquet")
    assert list((path / "new").iterdir()) == []


def test_a_format_that_is_not_known(write: Callable[..., Path]) -> None:
    with pytest.raises(InputError, match=r"^expected the format csv or parquet, got 'xlsx'$"):
        save_dataset(load_dataset(write(GOOD)), write(GOOD), "xlsx")  # type: ignore[arg-type]


def test_a_folder_that_cannot_be_made(write: Callable[..., Path]) -> None:
    path = write(GOOD)
    with pytest.raises(InputError, match=r"touches.csv/new: cannot make this folder: Not a directory$"):
        save_dataset(load_dataset(path), path / "touches.csv" / "new")


@given(st.data())
@settings(max_examples=300, deadline=None)
def test_whatever_is_done_to_a_file_it_is_read_or_refused_in_one_line(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("fuzz")
    files = {"sensor.toml": SENSOR.encode(), "touches.csv": GOOD.encode()}
    name = data.draw(st.sampled_from(sorted(files)))
    bits = st.sampled_from(
        [b'"', b",", b";", b"\t", b"\n", b"\r", b"\0", b"nan", b"inf", b"-", b"1e999", b"e03", b"[", b"="]
    )
    for _ in range(data.draw(st.integers(1, 4))):
        content = files[name]
        start = data.draw(st.integers(0, len(content)))
        end = data.draw(st.integers(start, min(len(content), start + 10)))
        files[name] = content[:start] + data.draw(bits | st.binary(max_size=3)) + content[end:]
    for each, content in files.items():
        (path / each).write_bytes(content)
    try:
        dataset = load_dataset(path)
    except InputError as caught:
        assert len(str(caught).splitlines()) == 1
        assert str(caught).startswith(str(path / name)) or "sensor.toml" in str(caught)
    else:
        save_dataset(dataset, path / "again")
        assert same_touches(load_dataset(path / "again").touches, dataset.touches)
