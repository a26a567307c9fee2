"""Posterior files: everything comes back, ArviZ and xarray open them, and nothing else is taken for one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import arviz as az
import numpy as np
import pytest
import xarray as xr

from bayestouch.chain.noise import Noise
from bayestouch.data.sensor import Finger, Pad, Rubber, Sensor
from bayestouch.errors import InputError
from bayestouch.priors.parameter_text import PriorOfOtherCode, parameters_from_json, parameters_to_json
from bayestouch.priors.parameters import LogNormal, Normal, Parameter, Uniform
from bayestouch.results.data import TouchRows
from bayestouch.results.files import save_calibration, save_touches, to_arviz, to_dataframe
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.results.reading import load, load_calibration, load_touches

FINGER = Sensor(
    name="fingér",
    body=Finger(9.5, 12.7, 10.6, (-30.0, -10.0, 10.0)),
    rubber=Rubber(0.2, None),
    force_noise_sd=0.7,
    reading_unit="counts",
    reading_quantity="capacitance",
    source={"paper": "Nicolson and Fearing\n1995"},
    extra={"bench": {"operator": "µ", "table": [1, 2.5]}},
    notes=("sensor.toml: bench is not known here, kept and not used",),
)
PAD = Sensor(name="pad", body=Pad((0.0, 4.0, 0.0), (0.0, 0.0, 4.0), 5.0, 2.0))

PARAMETERS = (
    Parameter("sigma", "σ", r"\sigma", "", Normal(0.45, 0.05, 0.0, 0.5), "Poisson's ratio"),
    Parameter("mu", "μ", r"\mu", "MPa", LogNormal(0.2, 0.5)),
    Parameter("r_s", "r_s", "r_s", "mm", Uniform(9.6, 12.6)),
)
TOUCH_PARAMETERS = (
    Parameter("R", "R", "R", "mm", Uniform(0.0, 12.7)),
    Parameter("theta_c", "θ_c", r"\theta_c", "degree", Uniform(-50.0, 50.0)),
    Parameter("P", "P", "P", "N/m", Uniform(0.0, 600.0)),
)


def _rows(t: int, m: int, *axes: str) -> TouchRows:
    rng = np.random.default_rng(t)
    observed = rng.normal(size=(t, m))
    observed[0, 0] = np.nan
    return TouchRows(
        touch=np.arange(t)[::-1] * 2,
        location={axis: rng.normal(size=t) for axis in axes},
        radius_mm=np.resize([0.0, np.inf, np.nan, 3.2], t),
        load=np.resize([400.0, np.nan], t),
        observed=observed,
        predicted=rng.normal(size=(t, m)),
        sd=np.full((t, m), 0.1),
        counts=rng.integers(0, 20, size=(t, m)),
    )


def calibration() -> Calibration:
    rng = np.random.default_rng(1)
    shapes = {"sigma": (), "mu": (), "r_s": (3,), "gain": (3,), "theta_s": (3,)}
    return Calibration(
        sensor=FINGER,
        parameters=PARAMETERS,
        mode={name: rng.normal(size=shape) for name, shape in shapes.items()},
        posterior={name: rng.normal(size=(4, 25, *shape)) for name, shape in shapes.items()},
        covariance=np.cov(rng.normal(size=(5, 20))),
        layout=("sigma", "mu", "r_s[0]", "r_s[1]", "r_s[2]"),
        noise=Noise(np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.01, 0.0]), 0.02, np.nan),
        rows=_rows(6, 3, "theta_c"),
        settings={"contact": "layer", "seed": 3.0, "samples": np.float64(5), "typical_load": np.inf},
        statistics={"lack_of_fit": 1.25, "error_percent_peak": np.nan},
        extra={"rest_reading": np.array([1.0, np.nan, 3.0]), "map": rng.normal(size=(2, 5)), "scale": np.array(2.0)},
        notes=("one", "two: “θ”"),
    )


def touches(sensor: Sensor = FINGER) -> TouchPosteriors:
    rng = np.random.default_rng(2)
    names = ("r_c", "R", "theta_c", "P") if isinstance(sensor.body, Finger) else ("x", "y", "P")
    axes = ("theta_c",) if isinstance(sensor.body, Finger) else ("x", "y")
    return TouchPosteriors(
        sensor=sensor,
        parameters=TOUCH_PARAMETERS if isinstance(sensor.body, Finger) else (),
        posterior={name: rng.normal(size=(4, 50, 5)) for name in names},
        sample_stats={name: rng.normal(size=5) for name in ("ess_bulk", "rhat", "acceptance")},
        reference={name: np.array([1.0, np.nan, np.inf, 0.0, 2.0]) for name in names},
        rows=_rows(5, 3, *axes),
        settings={"plug_in": 0.0},
        notes=(),
    )


def same(first: Any, second: Any) -> None:
    """Equal to the last bit, NaN included, with the same types of arrays."""
    if isinstance(first, np.ndarray):
        assert isinstance(second, np.ndarray) and first.dtype == second.dtype
        np.testing.assert_array_equal(first, second)
    elif is_dataclass(first) and not isinstance(first, type):
        assert type(first) is type(second)
        for field in fields(first):
            same(getattr(first, field.name), getattr(second, field.name))
    elif isinstance(first, dict):
        assert set(first) == set(second)
        for key in first:
            same(first[key], second[key])
    elif isinstance(first, tuple | list):
        assert len(first) == len(second)
        for one, other in zip(first, second, strict=True):
            same(one, other)
    elif isinstance(first, float) and np.isnan(first):
        assert np.isnan(second)
    else:
        assert first == second


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


def test_a_calibration_comes_back_whole(calibration_file: Path) -> None:
    same(calibration(), load_calibration(calibration_file))
    same(calibration(), load(calibration_file))


@pytest.mark.parametrize("sensor", [FINGER, PAD], ids=["finger", "pad"])
def test_touches_come_back_whole(sensor: Sensor, tmp_path: Path) -> None:
    path = tmp_path / "posterior.nc"
    save_touches(touches(sensor), path)
    same(touches(sensor), load_touches(path))
    same(touches(sensor), load(path))


def test_draws_that_lie_otherwise_in_memory_come_back(tmp_path: Path) -> None:
    draws = np.moveaxis(np.arange(4.0 * 50 * 5).reshape(5, 4, 50), 0, -1)
    save_touches(replace(touches(), posterior={"R": draws}), tmp_path / "p.nc")
    same({"R": np.ascontiguousarray(draws)}, dict(load_touches(tmp_path / "p.nc").posterior))


def test_the_file_is_as_promised(touch_file: Path, calibration_file: Path) -> None:
    """Names, dimensions and units of FORMAT, by xarray's own reader."""
    with xr.open_datatree(touch_file, engine="h5netcdf") as tree:
        posterior = tree["posterior"]
        assert list(posterior.data_vars) == ["r_c", "R", "theta_c", "P"]
        assert all(posterior[name].dims == ("chain", "draw", "touch") for name in posterior.data_vars)
        units = {str(name): variable.attrs["units"] for name, variable in posterior.data_vars.items()}
        assert units == {"r_c": "mm", "R": "mm", "theta_c": "degree", "P": "N/m"}
        np.testing.assert_array_equal(posterior["touch"], touches().rows.touch)
        assert set(tree["constant_data"].data_vars) == {"r_c", "R", "theta_c", "P"}
        assert {"ess_bulk", "rhat", "acceptance"} <= set(tree["sample_stats"].data_vars)
        assert tree["sample_stats"]["rhat"].dims == ("touch",)
        np.testing.assert_array_equal(tree["observed_data"]["reading"], touches().rows.observed)
    with xr.open_datatree(calibration_file, engine="h5netcdf") as tree:
        posterior = tree["posterior"]
        assert posterior["gain"].dims == ("chain", "draw", "element") and posterior["sigma"].dims == ("chain", "draw")
        assert list(posterior["element"].values) == ["e01", "e02", "e03"]
        assert (posterior["r_s"].attrs["units"], posterior["gain"].attrs["units"]) == ("mm", "counts")


def test_arviz_opens_the_files(touch_file: Path, calibration_file: Path) -> None:
    data = az.from_netcdf(touch_file)
    np.testing.assert_array_equal(data["posterior"]["R"], touches().posterior["R"])
    assert float(az.rhat(data["posterior"])["R"][0]) == pytest.approx(float(az.rhat(touches().posterior["R"][..., 0])))
    data = az.from_netcdf(calibration_file)
    summary = az.summary(data["posterior"], var_names=["gain"])
    assert list(summary.index) == ["gain[e01]", "gain[e02]", "gain[e03]"]


def test_what_arviz_writes_again_is_still_read(calibration_file: Path, tmp_path: Path) -> None:
    """Compressed, and with attributes of its own."""
    data = az.from_netcdf(calibration_file)
    data.to_netcdf(tmp_path / "again.nc")
    same(calibration(), load(tmp_path / "again.nc"))


@pytest.mark.parametrize("result", [calibration(), touches()], ids=["calibration", "touches"])
def test_to_arviz(result: Calibration | TouchPosteriors) -> None:
    data = to_arviz(result)
    for name, draws in result.posterior.items():
        np.testing.assert_array_equal(data["posterior"][name], draws)
    assert data.attrs["sensor"].startswith("name")


def test_to_arviz_from_version_1_on_is_a_data_tree(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(vars(az), "InferenceData", raising=False)
    data = to_arviz(touches())
    assert isinstance(data, xr.DataTree)
    np.testing.assert_array_equal(data["posterior"]["P"], touches().posterior["P"])


def test_to_dataframe_of_touches() -> None:
    result = touches()
    frame = to_dataframe(result)
    assert list(frame.columns) == ["parameter", "touch", "unit", "mean", "sd", "q5", "q50", "q95", "reference"]
    assert len(frame) == 4 * 5
    loads = frame[frame["parameter"] == "P"]
    np.testing.assert_array_equal(loads["touch"], result.rows.touch)
    np.testing.assert_allclose(loads["mean"], result.mean("P"), rtol=1e-12)
    np.testing.assert_allclose(loads["sd"], result.sd("P"), rtol=1e-12)
    np.testing.assert_allclose(loads["q95"], result.interval("P")[1], rtol=1e-12)
    np.testing.assert_array_equal(loads["reference"], result.reference["P"])
    assert set(loads["unit"]) == {"N/m"}
    assert "q2.5" in to_dataframe(result, probabilities=[0.025])


def test_to_dataframe_of_a_calibration() -> None:
    result = calibration()
    frame = to_dataframe(result)
    assert len(frame) == 2 + 3 * 3
    gain = frame[frame["parameter"] == "gain"]
    assert list(gain["element"]) == [1, 2, 3]
    np.testing.assert_allclose(gain["mean"], result.posterior["gain"].mean(axis=(0, 1)), rtol=1e-12)
    assert frame[frame["parameter"] == "sigma"]["element"].isna().all()
    assert "reference" not in frame


def test_priors_come_back_from_text() -> None:
    again = parameters_from_json(parameters_to_json(PARAMETERS))
    assert again == PARAMETERS
    unbounded = (replace(PARAMETERS[0], prior=Normal(1.0, 2.0)),)
    assert parameters_from_json(parameters_to_json(unbounded)) == unbounded
    json.loads(parameters_to_json(unbounded), parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


def test_a_prior_of_other_code_keeps_its_description() -> None:
    class Uniform(Normal):  # the name of one of ours
        def __str__(self) -> str:
            return "flat, they say"

    once = parameters_from_json(parameters_to_json([replace(PARAMETERS[0], prior=Uniform(0.0, 1.0, -2.0))]))
    twice = parameters_from_json(parameters_to_json(once))
    assert once == twice
    assert twice[0].prior == PriorOfOtherCode("flat, they say", -2.0, np.inf)
    assert str(twice[0].prior) == "flat, they say" and twice[0].prior.support == (-2.0, np.inf)
    with pytest.raises(InputError, match="flat, they say"):
        twice[0].prior.log_density(0.0)


def test_a_failed_save_leaves_the_old_file(calibration_file: Path) -> None:
    before = calibration_file.read_bytes()
    bad = replace(calibration(), posterior={"sigma": np.zeros((4, 25)), "mu": np.zeros((3, 25))})
    with pytest.raises(ValueError):
        save_calibration(bad, calibration_file)
    assert calibration_file.read_bytes() == before
    assert list(calibration_file.parent.iterdir()) == [calibration_file]
    with pytest.raises(InputError, match="cannot be written"):
        save_calibration(calibration(), calibration_file.parent / "absent" / "c.nc")
    with pytest.raises(InputError, match="cannot be saved"):
        save_calibration(replace(calibration(), settings={"a": object()}), calibration_file)  # type: ignore[dict-item]


def test_neither_a_home_nor_arviz_is_needed(tmp_path: Path) -> None:
    path = tmp_path / "p.nc"
    touches().save(path)
    code = (
        "import sys; from bayestouch.results.reading import load\n"
        f"result = load({str(path)!r}); result.save({str(tmp_path / 'again.nc')!r})\n"
        "print([m for m in ('arviz', 'emcee', 'matplotlib', 'scipy.stats') if m in sys.modules])"
    )
    homeless = {**os.environ, "HOME": "/proc/no-home", "XDG_CACHE_HOME": "/proc/no-cache"}
    done = subprocess.run([sys.executable, "-c", code], env=homeless, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    same(touches(), load(tmp_path / "again.nc"))
