"""What is no posterior file, or a damaged one, is refused in one line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr
from posterior_cases import calibration, touches

from bayestouch.errors import InputError
from bayestouch.priors.parameter_text import parameters_from_json
from bayestouch.results.reading import load, load_calibration, load_touches


@pytest.fixture
def calibration_file(tmp_path: Path) -> Path:
    path = tmp_path / "calibration.nc"
    calibration().save(path)
    return path


@pytest.fixture
def touch_file(tmp_path: Path) -> Path:
    path = tmp_path / "posterior.nc"
    touches().save(path)
    return path


@pytest.mark.parametrize(
    "prior", [{"kind": "InputError"}, {"kind": "np"}, {"kind": "Parameter"}, {"kind": "Uniform"}, {"low": 1}, [], None]
)
def test_a_prior_from_a_file_is_not_trusted(prior: Any) -> None:
    plain = [{name: "a" for name in ("name", "symbol", "latex", "unit", "description")} | {"prior": prior}]
    with pytest.raises(InputError):
        parameters_from_json(json.dumps(plain))


def test_the_other_kind_of_file_is_refused(touch_file: Path, calibration_file: Path) -> None:
    with pytest.raises(InputError, match=r"calibration\.nc: expected posteriors of touches, found a calibration"):
        load_touches(calibration_file)
    with pytest.raises(InputError, match=r"posterior\.nc: expected a calibration, found posteriors of touches"):
        load_calibration(touch_file)


def _one_line(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        load(path)
    line = str(caught.value)
    assert line.startswith(str(path)) and "\n" not in line and len(line) < len(str(path)) + 300
    return line


def test_what_is_no_posterior_file_is_refused(tmp_path: Path) -> None:
    assert "no such file" in _one_line(tmp_path / "absent.nc")
    assert "expected a file" in _one_line(tmp_path)
    for name, content in {
        "empty": b"",
        "text": b"touch,e01\n1,2\n",
        "signature": b"\x89HDF\r\n\x1a\n" + bytes(50),
    }.items():
        (tmp_path / name).write_bytes(content)
        _one_line(tmp_path / name)
    xr.Dataset({"a": ("x", np.zeros(3))}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    assert "another netCDF file" in _one_line(tmp_path / "other.nc")
    with h5py.File(tmp_path / "plain.h5", "w") as file:
        file["a"] = np.zeros(3)
    _one_line(tmp_path / "plain.h5")


@pytest.mark.parametrize("kind", ["calibration", "touches"])
def test_a_file_with_something_missing_is_refused(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "file.nc"
    (calibration() if kind == "calibration" else touches()).save(path)
    content = path.read_bytes()
    own = ["mode", "laplace", "noise"] if kind == "calibration" else ["sample_stats"]
    texts = ["bayestouch", "bayestouch_format", "sensor", "sensor_notes", "parameters", "settings", "notes"]
    arrays = ["rows/predicted", "rows/radius_mm", "rows/touch", "observed_data/reading"]
    arrays += ["constant_data/load" if kind == "calibration" else "observed_data/load"]
    if kind == "calibration":
        texts += ["statistics"]
        arrays += ["laplace/covariance", "laplace/row", "noise/tactile_sd", "noise/force_sd"]
    for name in ["posterior", "rows", "observed_data", "constant_data", *own, *arrays]:
        path.write_bytes(content)
        with h5py.File(path, "a") as file:
            del file[name]
        _one_line(path)
    for name in texts:
        path.write_bytes(content)
        with h5py.File(path, "a") as file:
            del file.attrs[name]
        _one_line(path)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("bayestouch", "something"),
        ("bayestouch_format", "99"),
        ("sensor", "name = ["),
        ("sensor", 'name = "a"'),
        ("parameters", "[{}]"),
        ("parameters", "[" * 100_000),
        ("settings", "[]"),
        ("settings", "{"),
        ("notes", '{"a": 1}'),
        ("statistics", "3"),
        ("sensor_notes", ""),
    ],
)
def test_broken_text_is_refused(name: str, text: str, calibration_file: Path) -> None:
    with h5py.File(calibration_file, "a") as file:
        file.attrs[name] = text
    _one_line(calibration_file)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("rows/predicted", np.zeros((6, 4))),
        ("rows/predicted", np.zeros(6)),
        ("noise/tactile_sd", np.zeros(7)),
        ("noise/force_sd", np.zeros(2)),
        ("laplace/covariance", np.zeros((2, 3))),
        ("posterior/sigma", np.zeros(3)),
    ],
)
def test_arrays_that_do_not_fit_are_refused(name: str, values: np.ndarray, calibration_file: Path) -> None:
    with h5py.File(calibration_file, "a") as file:
        del file[name]
        file[name] = values
        for axis, size in enumerate(values.shape):  # netCDF dimensions of the right length
            dimension = file.create_dataset(f"{name}_axis{axis}", data=np.zeros(size))
            dimension.make_scale(f"axis{axis}")
            file[name].dims[axis].attach_scale(dimension)
    _one_line(calibration_file)


def test_text_where_numbers_belong_is_refused(touch_file: Path) -> None:
    with h5py.File(touch_file, "a") as file:
        scale = file["sample_stats/touch"]
        del file["sample_stats/rhat"]
        file["sample_stats/rhat"] = np.array(["a"] * 5, dtype=h5py.string_dtype())
        file["sample_stats/rhat"].dims[0].attach_scale(scale)
    assert "rhat" in _one_line(touch_file)


def test_a_file_that_declares_more_than_it_holds_is_refused(touch_file: Path) -> None:
    """An array without content takes no room in the file and would take all the memory there is."""
    with h5py.File(touch_file, "a") as file:
        file.create_dataset("posterior/bomb", shape=(1 << 40,), dtype="f8", chunks=(1 << 20,))
    assert "more than it can hold" in _one_line(touch_file)


@pytest.mark.parametrize("kind", ["calibration", "touches"])
def test_damaged_files_are_refused(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "file.nc"
    (calibration() if kind == "calibration" else touches()).save(path)
    content = path.read_bytes()
    rng = np.random.default_rng(0)
    for length in rng.integers(8, len(content), size=10):
        path.write_bytes(content[:length])
        _one_line(path)
    for _ in range(30):
        damaged = bytearray(content)
        for place in rng.integers(8, min(len(content), 20_000), size=20):
            damaged[place] = rng.integers(256)
        path.write_bytes(bytes(damaged))
        try:
            load(path)  # damage to a number cannot be seen
        except InputError as error:
            assert str(error).startswith(str(path)) and "\n" not in str(error)
