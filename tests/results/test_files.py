"""Posterior files: everything comes back, ArviZ and xarray open them, and nothing else is taken for one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import arviz as az
import numpy as np
import pytest
import xarray as xr
from posterior_cases import FINGER, PAD, PARAMETERS, calibration, same, touches

from bayestouch.data.sensor import Sensor
from bayestouch.errors import InputError
from bayestouch.priors.parameter_text import PriorOfOtherCode, parameters_from_json, parameters_to_json
from bayestouch.priors.parameters import Normal
from bayestouch.results.files import save_calibration, save_touches, to_arviz, to_dataframe
from bayestouch.results.objects import Calibration, TouchPosteriors
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
        assert (posterior["r_s"].attrs["units"], posterior["gain"].attrs["units"]) == ("mm", "counts/strain")


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
