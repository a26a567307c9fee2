"""The sensor and `sensor.toml`."""

from __future__ import annotations

import math
import pickle
from dataclasses import astuple

import pytest
from data_strategies import sensors
from hypothesis import given, settings

from bayestouch.data.files import write_together
from bayestouch.data.sensor import Finger, Pad, Rubber, Sensor
from bayestouch.data.sensor_toml import read_sensor, sensor_from_toml, sensor_to_toml, sensor_writer
from bayestouch.errors import InputError

FINGER = """
name = "f"
[geometry]
core_radius_mm = 9.4
outer_radius_mm = 12.7
sensing_radius_mm = 9.9
element_angles_deg = [-4.4, 4.4, 13]
[rubber]
shear_modulus_MPa = 0.15
poisson_ratio = 0.46
[force_sensor]
noise_sd_N_per_m = 1.0
[readings]
unit = "counts"
quantity = "capacitance"
[source]
note = "made up"
year = 1995
"""

PAD = """
body = "pad"
[geometry]
element_x_mm = [0, 6]
element_y_mm = [0, 0]
thickness_mm = 4
depth_mm = 3.5
[force_sensor]
noise_sd_N = 0.1
"""


def test_a_finger_is_read_as_written() -> None:
    sensor = sensor_from_toml(FINGER)
    assert sensor == Sensor(
        name="f",
        body=Finger(9.4, 12.7, 9.9, (-4.4, 4.4, 13.0)),
        rubber=Rubber(0.15, 0.46),
        force_noise_sd=1.0,
        reading_unit="counts",
        reading_quantity="capacitance",
        source={"note": "made up", "year": "1995"},
    )
    assert sensor.n_elements == 3
    assert sensor.notes == ()


def test_a_pad_is_read_as_written() -> None:
    sensor = sensor_from_toml(PAD, default_name="folder")
    assert sensor == Sensor(name="folder", body=Pad((0.0, 6.0), (0.0, 0.0), 4.0, 3.5), force_noise_sd=0.1)
    assert sensor.body.location_columns == ("x_mm", "y_mm")
    assert sensor.rubber == Rubber(None, None)


def test_dimensions_of_a_pad() -> None:
    assert Pad((0.0, 1.0)).dimensions == 1
    assert Pad((0.0, 1.0), (0.0, 0.0)).dimensions == 2


@given(sensor=sensors())
@settings(max_examples=150, deadline=None)
def test_saved_and_read_back_is_the_same_sensor(sensor: Sensor) -> None:
    again = sensor_from_toml(sensor_to_toml(sensor), default_name="another")
    assert again == sensor
    # Equality takes -0.0 for 0.0; the text of a float does not.
    one, other = ((*astuple(s.body), *astuple(s.rubber), s.force_noise_sd) for s in (again, sensor))
    assert repr(one) == repr(other)


def test_a_sensor_without_a_name_is_called_after_its_folder(tmp_path) -> None:
    folder = tmp_path / "thumb"
    folder.mkdir()
    (folder / "sensor.toml").write_text(PAD)
    assert read_sensor(folder / "sensor.toml").name == "thumb"


def test_unknown_keys_are_kept_said_and_written_back() -> None:
    sensor = sensor_from_toml(FINGER.replace("[rubber]", "[rubber]\nbatch = 7") + "\n[circuit]\nboard = 'B'\n")
    assert sensor.extra == {"rubber": {"batch": 7}, "circuit": {"board": "B"}}
    assert set(sensor.notes) == {
        "sensor.toml: rubber.batch is not known here, kept and not used",
        "sensor.toml: circuit is not known here, kept and not used",
    }
    assert sensor_from_toml(sensor_to_toml(sensor)) == sensor


def test_a_misspelt_key_is_asked_for() -> None:
    text = FINGER.replace("[rubber]", "[rubber]\npoison_ratio = 0.4\nbatch = 7") + "\n[foce_sensor]\nnoise = 1\n"
    assert set(sensor_from_toml(text).notes) == {
        "sensor.toml: rubber.poison_ratio is not known here, kept and not used; did you mean poisson_ratio?",
        "sensor.toml: rubber.batch is not known here, kept and not used",
        "sensor.toml: foce_sensor is not known here, kept and not used; did you mean force_sensor?",
    }


def test_byte_order_mark_and_windows_line_ends(tmp_path) -> None:
    file = tmp_path / "sensor.toml"
    file.write_bytes(b"\xef\xbb\xbf" + FINGER.replace("\n", "\r\n").encode())
    sensor = read_sensor(file)
    assert sensor == sensor_from_toml(FINGER)
    assert sensor.notes == ("sensor.toml: a byte order mark was skipped",)


def bad(text: str, old: str, new: str) -> InputError:
    assert text.count(old) == 1
    with pytest.raises(InputError) as caught:
        sensor_from_toml(text.replace(old, new), file="here/sensor.toml")
    assert "\n" not in str(caught.value)
    return caught.value


BETWEEN = "expected a radius between core and outer, 9.4 and 12.7 mm, got"
ANGLES, ANGLES_KEY = "[-4.4, 4.4, 13]", "geometry.element_angles_deg"


@pytest.mark.parametrize(
    ("old", "new", "row", "key", "message"),
    [
        ("9.4", "-9.4", 4, "geometry.core_radius_mm", "expected a number above zero, got -9.4"),
        (
            "9.4",
            "12.7",
            4,
            "geometry.core_radius_mm",
            "expected a core smaller than the outer radius 12.7 mm, got 12.7",
        ),
        ("12.7", "0", 5, "geometry.outer_radius_mm", "expected a number above zero, got 0.0"),
        ("9.9", "9.4", 6, "geometry.sensing_radius_mm", f"{BETWEEN} 9.4"),
        ("9.9", "12.8", 6, "geometry.sensing_radius_mm", f"{BETWEEN} 12.8"),
        ("12.7", "nan", 5, "geometry.outer_radius_mm", "expected a finite number, got nan"),
        ("12.7", "inf", 5, "geometry.outer_radius_mm", "expected a finite number, got inf"),
        ("12.7", '"12.7"', 5, "geometry.outer_radius_mm", "expected a number, got '12.7'"),
        ("12.7", "true", 5, "geometry.outer_radius_mm", "expected a number, got True"),
        ("12.7", "9" * 400, 5, "geometry.outer_radius_mm", f"expected a finite number, got {'9' * 39}…"),
        (ANGLES, "[[-4.4, 4.4], 13]", 7, f"{ANGLES_KEY}[0]", "expected a number, got [-4.4, 4.4]"),
        (ANGLES, "[-4.4, nan]", 7, f"{ANGLES_KEY}[1]", "expected a finite number, got nan"),
        (ANGLES, "[]", 7, ANGLES_KEY, "expected one number for each element, got none"),
        (ANGLES, "13", 7, ANGLES_KEY, "expected an array of numbers, got 13"),
        (ANGLES, "'a'", 7, ANGLES_KEY, "expected an array of numbers, got 'a'"),
        ("0.46", "0.6", 10, "rubber.poisson_ratio", "expected a ratio from 0 to 0.5, got 0.6"),
        ("0.15", "0", 9, "rubber.shear_modulus_MPa", "expected a number above zero, got 0.0"),
        ("= 1.0", "= -1.0", 12, "force_sensor.noise_sd_N_per_m", "expected a number above zero, got -1.0"),
        ("_N_per_m", "_N", 12, "force_sensor.noise_sd_N", "expected noise_sd_N_per_m on a finger"),
        ('unit = "counts"', "unit = 3", 14, "readings.unit", "expected text, got 3"),
        ('name = "f"', "name = 3", 2, "name", "expected text, got 3"),
        ('name = "f"', 'body = "foot"', 2, "body", 'expected "finger" or "pad", got \'foot\''),
    ],
)
def test_a_bad_value_on_a_finger(old: str, new: str, row: int, key: str, message: str) -> None:
    assert str(bad(FINGER, old, new)) == f"here/sensor.toml, row {row}, column {key}: {message}"


@pytest.mark.parametrize(
    ("old", "new", "row", "key", "message"),
    [
        ("[0, 0]", "[0, 0, 1]", 5, "geometry.element_y_mm", "expected 2 values as in element_x_mm, got 3"),
        ("= 3.5", "= 4.5", 7, "geometry.depth_mm", "expected elements within the layer of 4.0 mm, got 4.5"),
        ("= 4\n", "= -4\n", 6, "geometry.thickness_mm", "expected a number above zero, got -4.0"),
    ],
)
def test_a_bad_value_on_a_pad(old: str, new: str, row: int, key: str, message: str) -> None:
    assert str(bad(PAD, old, new)) == f"here/sensor.toml, row {row}, column {key}: {message}"


FINGER_NEEDS = "core_radius_mm, outer_radius_mm, sensing_radius_mm, element_angles_deg under [geometry]"
PAD_NEEDS = "element_x_mm under [geometry]"


@pytest.mark.parametrize(
    ("text", "old", "new", "key", "message"),
    [
        (
            FINGER,
            "core_radius_mm",
            "core_radius",
            "core_radius_mm",
            f"a finger needs {FINGER_NEEDS}; is it core_radius?",
        ),
        (
            FINGER,
            'name = "f"',
            'body = "pad"',
            "element_x_mm",
            f'a pad needs {PAD_NEEDS}, or body = "finger" at the top',
        ),
        (PAD, "[geometry]", "[geometri]", "element_x_mm", f"a pad needs {PAD_NEEDS}"),
        (
            PAD,
            'body = "pad"',
            "",
            "core_radius_mm",
            f'a finger needs {FINGER_NEEDS}, or body = "pad" at the top',
        ),
    ],
)
def test_a_missing_value(text: str, old: str, new: str, key: str, message: str) -> None:
    assert str(bad(text, old, new)) == f"here/sensor.toml, column geometry.{key}: missing; {message}"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        # What follows is Python's own wording, which changes with its version.
        ('name = "f"', 'name = "f', ", row 2: expected TOML"),
        ('name = "f"', "rubber = 3", ", row 8: expected TOML"),
        ("12.7", "1" + "0" * 9000, ": expected TOML"),
        (ANGLES, "[" * 5000, ": expected TOML"),
    ],
)
def test_what_is_no_toml(old: str, new: str, message: str) -> None:
    assert str(bad(FINGER, old, new)).startswith(f"here/sensor.toml{message}")


def test_a_table_that_is_none() -> None:
    with pytest.raises(InputError, match=r"^sensor.toml, row 1, column rubber: expected a table \[rubber\], got 3$"):
        sensor_from_toml('rubber = 3\nbody = "pad"\n[geometry]\nelement_x_mm = [0]\n')


def test_not_utf8(tmp_path) -> None:
    file = tmp_path / "sensor.toml"
    file.write_bytes(b'name = "f"\n# \xb5m\n')
    with pytest.raises(InputError) as caught:
        read_sensor(file)
    assert str(caught.value) == f"{file}, row 2: expected UTF-8 text, got the byte 0xb5"


def test_too_large_a_file_is_not_read(tmp_path, monkeypatch) -> None:
    file = tmp_path / "sensor.toml"
    file.write_text(FINGER)
    monkeypatch.setattr("bayestouch.data.toml_text.MAX_BYTES", 10)
    with pytest.raises(InputError, match=r"sensor.toml: expected a description of at most 10 bytes$"):
        read_sensor(file)


def test_what_toml_cannot_hold_is_refused_and_nothing_written(tmp_path) -> None:
    file = tmp_path / "sensor.toml"
    with pytest.raises(InputError, match="cannot be written as TOML"):
        write_together({file: sensor_writer(Sensor("lone \ud800", Pad((0.0,))))})
    assert list(tmp_path.iterdir()) == []


def test_the_classes_check_what_code_gives_them() -> None:
    with pytest.raises(InputError, match=r"^column core_radius_mm: expected a core smaller"):
        Finger(3, 2, 2.5, (0,))
    with pytest.raises(InputError, match=r"^column element_x_mm\[1\]: expected a finite number, got inf"):
        Pad((0, math.inf))
    with pytest.raises(InputError, match=r"^column noise_sd_N: expected a number above zero"):
        Sensor("s", Pad((0,)), force_noise_sd=0)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("body", "pad", "expected a Finger or a Pad, got 'pad'"),
        ("body", Pad, "expected a Finger or a Pad, got <class"),
        ("rubber", (0.15, 0.46), r"expected a Rubber, got \(0.15, 0.46\)"),
        ("source", 3, "expected a dict, got 3"),
        ("source.year", {"year": 1995}, "expected text, got 1995"),
        ("extra", 3, "expected a dict, got 3"),
        ("notes", 3, "expected a tuple of text, got 3"),
    ],
)
def test_a_sensor_refuses_what_its_fields_cannot_be(name: str, value: object, message: str) -> None:
    given = {"body": Pad((0.0,)), name.partition(".")[0]: value}
    with pytest.raises(InputError, match=f"^column {name}: {message}"):
        Sensor("s", **given)


def test_an_error_survives_the_way_between_processes() -> None:
    error = InputError("expected a number", file="touches.csv", row=3, column="e01")
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "touches.csv, row 3, column e01: expected a number"
    assert (again.file, again.row, again.column, again.message) == (
        "touches.csv",
        3,
        "e01",
        "expected a number",
    )
