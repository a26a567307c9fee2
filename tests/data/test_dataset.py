"""Data sets: read, written, the same again; and the measured and practice ones as they are."""

from __future__ import annotations

import stat
from pathlib import Path

import numpy as np
import pytest
from data_strategies import sensors, touches_for
from hypothesis import given, settings
from hypothesis import strategies as st
from same_touches import same_touches

from bayestouch.data.dataset import DataSet, load_dataset, save_dataset
from bayestouch.data.sensor import Finger, Pad, Sensor
from bayestouch.data.touch_table import read_touches, write_touches
from bayestouch.data.touches import Touches, touches_from
from bayestouch.errors import InputError

PAD = 'body = "pad"\n[geometry]\nelement_x_mm = [0, 6]\n'
FINGER = """[geometry]
core_radius_mm = 9.4
outer_radius_mm = 12.7
sensing_radius_mm = 9.9
element_angles_deg = [-4.4, 4.4]
"""

MEASURED = {  # touches, rows, elements, rows in contact
    "measured/array8-soft": (2800, 2800, 8, 2800),
    "measured/baro-line": (60, 180, 4, 120),
    "measured/fluid-oil-1.5": (779, 779, 2, 779),
}


def folder(path: Path, sensor: str = PAD, **tables: str) -> Path:
    path.mkdir(exist_ok=True)
    (path / "sensor.toml").write_text(sensor)
    for name, text in tables.items():
        (path / f"{name}.csv").write_bytes(text.encode())
    return path


@st.composite
def datasets(draw: st.DrawFn) -> DataSet:
    sensor = draw(sensors())
    touches = draw(touches_for(sensor))
    calibration = draw(st.none() | touches_for(sensor))
    # A table that calibrates must have a location; unknown in every row is allowed.
    body = sensor.body

    def located(table: Touches) -> Touches:
        absent = {name: np.full(table.n_rows, np.nan) for name in body.location_columns if getattr(table, name) is None}
        return table.with_(**absent)

    return (
        DataSet(sensor, None, located(touches))
        if calibration is None
        else DataSet(sensor, located(calibration), touches)
    )


@pytest.mark.parametrize("format", ["csv", "parquet"])
@given(data=st.data())
@settings(max_examples=100, deadline=None)
def test_saved_and_read_back_is_the_same_data_set(
    tmp_path_factory: pytest.TempPathFactory, format: str, data: st.DataObject
) -> None:
    if format == "parquet":
        pytest.importorskip("pyarrow")
    dataset = data.draw(datasets())
    path = tmp_path_factory.mktemp("data") / "new" / "set"
    save_dataset(dataset, path, format)  # type: ignore[arg-type]
    again = load_dataset(path)
    assert again.sensor == dataset.sensor
    assert same_touches(again.touches, dataset.touches)
    assert (again.calibration is None) == (dataset.calibration is None)
    if again.calibration is not None and dataset.calibration is not None:
        assert same_touches(again.calibration, dataset.calibration)


def test_every_column_of_a_finger(tmp_path: Path) -> None:
    text = (
        "e02,touch,angle_deg,sample,time_s,load_N_per_m,indenter_radius_mm,depth_mm,contact,e1,e01_sd,reads,operator\n"
        "2.5,7,-20,1,0.25,101.5,inf,0.5,1,1.5,0.1,10,Ann\n"
        ",7,-20,0,,,,,,-1e3,,,\n"
    )
    touches = load_dataset(folder(tmp_path / "d", FINGER, touches=text)).touches
    nan = np.nan
    expected = Touches(
        touch=np.array([7, 7]),
        sample=np.array([1, 0]),
        time_s=np.array([0.25, nan]),
        indenter_radius_mm=np.array([np.inf, nan]),
        angle_deg=np.array([-20.0, -20.0]),
        x_mm=None,
        y_mm=None,
        load=np.array([101.5, nan]),
        depth_mm=np.array([0.5, nan]),
        contact=np.array([1, nan]),
        readings=np.array([[1.5, 2.5], [-1000.0, nan]]),
        readings_sd=np.array([[0.1, nan], [nan, nan]]),
        reads=np.array([10, nan]),
        extra={"operator": np.array(["Ann", ""], dtype=object)},
    )
    assert same_touches(touches, expected)
    assert "touches.csv: columns not known here, kept and not used: operator" in touches.notes


def test_a_pad_in_the_plane(tmp_path: Path) -> None:
    sensor = PAD + "element_y_mm = [0, 0]\n"
    path = folder(tmp_path / "d", sensor, touches="touch,x_mm,y_mm,load_N,e01,e02\n0,1,2,3,4,5\n1,2,3,4,5,6\n")
    touches = load_dataset(path).touches
    assert touches.x_mm is not None and touches.x_mm.tolist() == [1.0, 2.0]
    assert touches.y_mm is not None and touches.y_mm.tolist() == [2.0, 3.0]
    assert touches.load.tolist() == [3.0, 4.0] and touches.angle_deg is None


def test_y_on_a_line_is_a_further_column(tmp_path: Path) -> None:
    touches = load_dataset(folder(tmp_path / "d", touches="touch,x_mm,y_mm,e01,e02\n0,1,2,4,5\n1,2,3,5,6\n")).touches
    assert touches.y_mm is None and touches.extra["y_mm"].tolist() == ["2", "3"]


def test_rows_of_a_touch_are_numbered_where_sample_is_absent(tmp_path: Path) -> None:
    touches = load_dataset(folder(tmp_path / "d", touches="touch,x_mm,e01,e02\n4,1,4,5\n2,2,5,6\n4,1,6,7\n")).touches
    assert touches.sample.tolist() == [0, 0, 1]
    assert "touches.csv: no column sample, rows of the same touch are numbered in order" in touches.notes


def test_touches_to_be_read_need_no_location_where_there_is_a_calibration(tmp_path: Path) -> None:
    path = folder(
        tmp_path / "d",
        calibration="touch,x_mm,e01,e02\n0,1,4,5\n1,2,5,6\n",
        touches="touch,e01,e02\n0,4,5\n1,4,6\n",
    )
    dataset = load_dataset(path)
    assert dataset.touches.x_mm is None and "touches.csv: no reference location" in dataset.notes
    with pytest.raises(InputError, match=r"touches.csv, row 1, column x_mm: missing: the reference location on a pad$"):
        read_touches(path / "touches.csv", dataset.sensor, location=True)


def test_notes_of_all_files_come_together(tmp_path: Path) -> None:
    table = "touch,x_mm,load_N,e01,e02,who\n0,1,1,4,5,me\n1,2,1,5,6,me\n"
    dataset = load_dataset(folder(tmp_path / "d", PAD + "height = 3\n", calibration=table, touches=table))
    assert dataset.notes == (
        "sensor.toml: geometry.height is not known here, kept and not used",
        "calibration.csv: columns not known here, kept and not used: who",
        "touches.csv: columns not known here, kept and not used: who",
    )


def test_parquet_with_other_types_of_column(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    pq = pytest.importorskip("pyarrow.parquet")
    path = folder(tmp_path / "d")
    columns = {
        "touch": pa.array([1, 2, 3], pa.int16()),
        "x_mm": pa.array(["1.5", None, "2"], pa.string()),
        "contact": pa.array([True, False, None], pa.bool_()),
        "e01": pa.array([1.5, None, 2.5], pa.float32()),
        "e02": pa.array([1, 2, None], pa.int64()),
        "when": pa.array([1, None, 3], pa.timestamp("s")),
    }
    pq.write_table(pa.table(columns), path / "touches.parquet")
    touches = load_dataset(path).touches
    np.testing.assert_array_equal(touches.x_mm, [1.5, np.nan, 2.0])
    np.testing.assert_array_equal(touches.contact, [1, 0, np.nan])
    np.testing.assert_array_equal(touches.readings, [[1.5, 1], [np.nan, 2], [2.5, np.nan]])
    assert touches.extra["when"].tolist() == ["1970-01-01 00:00:01", "", "1970-01-01 00:00:03"]


def small(n: int = 3) -> Touches:
    return touches_from(range(n), np.arange(2.0 * n).reshape(n, 2), x_mm=np.arange(n, dtype=float))


def test_saving_replaces_the_whole_data_set_and_nothing_else(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    sensor = Sensor("s", Pad((0, 6)))
    save_dataset(DataSet(sensor, small(2), small(3)), tmp_path)
    (tmp_path / "readme.txt").write_text("mine")
    save_dataset(DataSet(sensor, None, small(4)), tmp_path, "parquet")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["readme.txt", "sensor.toml", "touches.parquet"]
    assert same_touches(load_dataset(tmp_path).touches, small(4))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"readings": [[1.0, 2.0], [3.0, np.inf], [np.inf, 4.0]]}, "row 1, column e02: expected a finite number or {}"),
        ({"readings": [[1.0, 2.0], [3.0, 4.0], [-1.1e12, 4.0]]}, "row 2, column e01: expected a number from -1e12 to"),
        (
            {"readings_sd": [[1.0, 2.0], [-0.1, np.nan], [1.0, 1.0]]},
            "row 1, column e01_sd: expected a number from 0 up",
        ),
        ({"load": [1.0, np.nan, -np.inf]}, "row 2, column load: expected a finite number or {}, got -inf"),
        ({"load": [1.1e12, 1.0, 1.0]}, "row 0, column load: expected a number from -1e12 to 1e12"),
        ({"time_s": [1e13, 1e29, np.inf]}, "row 2, column time_s: expected a finite number or {}"),
        ({"time_s": [1e13, 1e31, 0.0]}, "row 1, column time_s: expected a number from -1e30 to 1e30, got 1e[+]31"),
        ({"x_mm": [0.0, np.nan, np.inf]}, "row 2, column x_mm: expected a finite number or {}"),
        ({"depth_mm": [0.0, -1.0, 1.0]}, "row 1, column depth_mm: expected a number from 0 up or {}, got -1"),
        ({"indenter_radius_mm": [0.0, np.inf, -1.0]}, "row 2, column indenter_radius_mm: expected a radius from 0"),
        ({"contact": [0.0, 1.0, 2.0]}, "row 2, column contact: expected 0, 1 or {}, got 2"),
        ({"reads": [np.nan, 0.0, 1.0]}, "row 1, column reads: expected an integer from 1 up or {}, got 0"),
    ],
)
def test_tables_in_memory_have_only_values_that_files_may_have(changes: dict[str, object], message: str) -> None:
    sensor, made = Sensor("s", Pad((0, 6))), small(3).with_(**changes)
    expected = message.replace("{}", "nothing") + ".* \\(rows counted from 0\\)$"
    with pytest.raises(InputError, match="^touches, " + expected) as caught:
        DataSet(sensor, None, made)
    assert str(caught.value.row) in message and caught.value.column in message
    with pytest.raises(InputError, match="^calibration, " + expected):
        DataSet(sensor, made, small(3))


def test_unknown_values_and_the_largest_ones_are_allowed_in_memory() -> None:
    most = small(3).with_(
        readings=[[np.nan, 1e12], [-1e12, 0.0], [1.0, 2.0]],
        readings_sd=[[np.nan, 0.0], [1e12, 0.0], [1.0, 2.0]],
        load=[1e12, np.nan, -1e12],
        indenter_radius_mm=[0.0, np.inf, np.nan],
        time_s=[1e30, -1e30, np.nan],
        reads=[1.0, 2.0**52, np.nan],
    )
    assert DataSet(Sensor("s", Pad((0, 6))), None, most).touches is most
    assert DataSet(Sensor("s", Pad((0, 6))), None, most.select([])).touches.n_rows == 0


def test_a_failed_save_changes_nothing(tmp_path: Path) -> None:
    sensor = Sensor("s", Pad((0, 6)))
    save_dataset(DataSet(sensor, None, small(3)), tmp_path)
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    for touches in (
        small().with_(sample=[0, -1, 0]),
        small().with_(extra={"e03": ["", "", ""]}),
        small().with_(extra={" note": ["", "", ""]}),
        small().with_(extra={"note": ["", "lone \ud800", ""]}),
        small().with_(extra={"note": ["", "x" * 200_000, ""]}),
        small().select([]),
    ):
        with pytest.raises(InputError) as caught:
            save_dataset(DataSet(Sensor("other", Pad((0, 6))), small(2), touches), tmp_path)
        assert "touches.csv" in str(caught.value)
        assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_a_table_that_breaks_off_while_written_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full_disk(*_: object) -> list[str]:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("bayestouch.data.table_writing._cells", full_disk)
    with pytest.raises(InputError, match=r"touches.csv: cannot be written: No space left on device$"):
        write_touches(small(), tmp_path / "touches.csv", Sensor("s", Pad((0, 6))))
    assert list(tmp_path.iterdir()) == []


def test_files_get_the_rights_that_others_of_the_user_have(tmp_path: Path) -> None:
    (tmp_path / "plain").touch()
    write_touches(small(), tmp_path / "touches.csv", Sensor("s", Pad((0, 6))))
    rights = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("plain", "touches.csv")]
    assert rights[0] == rights[1]


@pytest.mark.parametrize(
    ("body", "touches", "message"),
    [
        (Pad((0, 6, 12)), small(), "touches: expected readings of 3 elements, got 2"),
        (Pad((0, 6), (0, 0)), small(), "touches: expected the location in x_mm and y_mm, got x_mm"),
        (Finger(1, 3, 2, (0, 1)), small(), "touches: expected the location in angle_deg, got x_mm"),
    ],
)
def test_touches_of_another_sensor(body: Pad | Finger, touches: Touches, message: str) -> None:
    with pytest.raises(InputError, match=f"^{message}$"):
        DataSet(Sensor("s", body), None, touches)


@pytest.mark.parametrize("name", MEASURED)
def test_measured_data_load(shared_folder: Path, name: str, tmp_path: Path) -> None:
    path = shared_folder / name
    if not path.is_dir():
        pytest.skip(f"{path} is not there")
    dataset = load_dataset(path)
    touches = dataset.touches
    found = (touches.n_touches, touches.n_rows, touches.n_elements, int(touches.in_contact.sum()))
    assert found == MEASURED[name]
    assert dataset.calibration is None and "repository" in dataset.sensor.source
    # Nothing in these tables is odd but what their README says.
    said = {note.split(": ", 1)[1] for note in dataset.notes}
    assert said <= {"no load measured", "60 of 180 rows without contact (contact, depth or load is 0)"}
    save_dataset(dataset, tmp_path)
    again = load_dataset(tmp_path)
    assert again.sensor == dataset.sensor and same_touches(again.touches, touches)


@pytest.mark.parametrize("letter", "abcde")
def test_practice_data_load(shared_folder: Path, letter: str) -> None:
    path = shared_folder / "practice" / f"finger-{letter}"
    if not path.is_dir():
        pytest.skip(f"{path} is not there")
    dataset = load_dataset(path)
    assert dataset.notes == ()
    assert isinstance(dataset.sensor.body, Finger) and dataset.sensor.n_elements == 16
    assert dataset.calibration is not None
    assert (dataset.calibration.n_touches, dataset.calibration.n_rows) == (242, 1210)
    assert (dataset.touches.n_touches, dataset.touches.n_rows) == (451, 2255)
    assert set(np.unique(dataset.calibration.indenter_radius_mm)) == {0.0, np.inf}
    exam = shared_folder / "practice" / "truth" / f"finger-{letter}" / "exam.csv"
    if exam.is_file():
        assert read_touches(exam, dataset.sensor, location=True).averaged().counts.tolist() == [[5] * 16] * 240


@pytest.mark.parametrize("name", ["sensor.toml", "touches.csv", "touches.parquet", "calibration.csv"])
def test_a_folder_of_the_name_of_a_file_keeps_the_data_set_as_it_was(tmp_path: Path, name: str) -> None:
    text = "touch,x_mm,e01,e02\n0,1,4,5\n1,2,5,6\n"
    new = load_dataset(folder(tmp_path / "new", touches=text))
    old = folder(tmp_path / "old", touches="old", calibration="old")
    (old / name).unlink(missing_ok=True)
    (old / name).mkdir()
    before = {path.name: path.is_file() and path.read_bytes() for path in old.iterdir()}
    with pytest.raises(InputError, match=rf"{name}: expected .* folder"):
        save_dataset(new, old)
    assert {path.name: path.is_file() and path.read_bytes() for path in old.iterdir()} == before


def test_a_frame_becomes_the_same_touches_again() -> None:
    made = touches_from(
        [3, 3, 8],
        [[1.0, np.nan], [2.0, 5.0], [3.0, 6.0]],
        load=[1.5, np.nan, 2.5],
        x_mm=[0.0, 0.0, 4.0],
        time_s=[0.0, 0.5, 7.0],
        indenter_radius_mm=np.inf,
    )
    frame = DataSet(Sensor("pad", Pad((0.0, 6.0))), None, made).to_dataframe()
    names = ["touch", "sample", "time_s", "x_mm", "indenter_radius_mm"]
    again = touches_from(readings=frame.filter(regex="^e[0-9]+$"), load=frame["load_N"], **frame[names])
    assert same_touches(again, made)


def test_a_data_set_without_rows_has_a_frame_without_rows() -> None:
    none = touches_from([0], [[4.0, 5.0]]).select([])
    frame = DataSet(Sensor("pad", Pad((0.0, 6.0))), none, none).to_dataframe()
    assert (len(frame), list(frame.columns)) == (0, ["table"])


def test_a_further_column_does_not_take_the_place_of_the_name_of_the_table(tmp_path: Path) -> None:
    text = "touch,x_mm,e01,e02,table\n0,1,4,5,mine\n1,2,5,6,mine\n"
    frame = load_dataset(folder(tmp_path / "d", touches=text, calibration=text)).to_dataframe()
    assert frame["table"].tolist() == ["calibration"] * 2 + ["touches"] * 2 and frame.columns[0] == "table"
