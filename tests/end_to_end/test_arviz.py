"""The workflow of ArviZ on files that the commands wrote: the script of the documentation, and each function."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import arviz as az
import matplotlib
import numpy as np
import pytest
import xarray as xr
from pad_simulation import line
from report_cases import FINGER

import bayestouch
from bayestouch.chain.kernels import HalfSpaceKernel
from bayestouch.commands.cli import main
from bayestouch.effects.stated import StatedModel
from bayestouch.priors.parameters import LogNormal

matplotlib.use("Agg")
ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "arviz.md").read_text("utf-8")
#: ArviZ 1 has other names for some functions.
NEW = not hasattr(az, "psens")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set, and what the commands of the page wrote of it."""
    folder = tmp_path_factory.mktemp("arviz")
    bayestouch.save_dataset(bayestouch.simulate(seed=3).dataset, folder / "my-finger")
    before = Path.cwd()
    os.chdir(folder)
    try:
        for line in re.findall(r"^\$ (bayestouch .+)$", PAGE, re.MULTILINE):
            assert main([*shlex.split(line)[1:], "--quiet"]) == 0, line
    finally:
        os.chdir(before)
    return folder


@pytest.fixture(scope="module")
def calibration(folder: Path) -> Any:
    return az.from_netcdf(folder / "calibration.nc")


@pytest.fixture(scope="module")
def touches(folder: Path) -> Any:
    return az.from_netcdf(folder / "posterior.nc")


@pytest.mark.slow
def test_the_script_of_the_page_runs_without_a_warning(folder: Path) -> None:
    """In an interpreter with the usual filters of warnings; that ArviZ 0.23 announces ArviZ 1 is left out."""
    (script,) = (block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "corner.corner" in block)
    command = [sys.executable, "-W", "ignore::FutureWarning", "-c", script]
    done = subprocess.run(command, cwd=folder, env={**os.environ, "MPLBACKEND": "Agg"}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "warning" not in done.stderr.lower(), done.stderr
    assert done.stdout.count("elpd_loo") == 2 and "theta_c" in done.stdout


def test_loo_leaves_out_touches(calibration: Any) -> None:
    """As many effective parameters as a finger has, and the same as from the densities."""
    loo = az.loo(calibration)
    log = np.asarray(calibration["log_likelihood"]["whole_touch"])
    t, elpd = log.shape[-1], float(loo.elpd if NEW else loo.elpd_loo)
    p_loo = float(loo.p if NEW else loo.p_loo)
    # 16 elements with three parameters and two of noise each, and three that all share: most are determined
    assert 48 < p_loo < 83
    within = np.log(np.exp(log - log.max()).mean(axis=(0, 1))).sum() + log.max() * t
    assert elpd == pytest.approx(within - p_loo, abs=0.01)


def test_compare(folder: Path, calibration: Any) -> None:
    """The finger was simulated with the layer; Hertz does not fit as well."""
    data = bayestouch.load_dataset(folder / "my-finger")
    hertz = bayestouch.calibrate(data, contact="hertz", groups="log_likelihood")
    table = az.compare({"layer": calibration, "hertz": hertz.to_arviz()})
    assert list(table.index) == ["layer", "hertz"]


@pytest.mark.slow
def test_compare_with_and_without_an_effect() -> None:
    """Crosstalk of 4 % that was simulated is found worth its parameters."""
    data = bayestouch.simulate(FINGER, effects={"crosstalk": 0.04}, seed=3).dataset
    model = StatedModel("finger", "layer", (("crosstalk", {}),))
    fits = {
        name: bayestouch.calibrate(data, model=stated, draws=400, groups="log_likelihood").to_arviz()
        for name, stated in (("without", None), ("with", model))
    }
    table = az.compare(fits)
    assert list(table.index) == ["with", "without"]


@pytest.mark.parametrize("right", [True, False])
def test_compare_the_model_of_a_pad_with_its_empirical_map(tmp_path: Path, right: bool) -> None:
    """The map wins where the kernel is wrong, a half-space read as a Gaussian; else it gains nothing."""
    kernel = HalfSpaceKernel(6.0, LogNormal(4.0, 0.2))
    pad = line(load_spread=0.0) if right else line(kernel, (4.0, 1.0), load_spread=0.0)
    rng = np.random.default_rng(4)
    touches = pad.touch(np.linspace(6, 32, 60)[:, None], rng, load=rng.uniform(0.9, 1.1, 60), measured=True, samples=2)
    files = {}
    for e_map in ("model", "empirical"):
        fit = bayestouch.calibrate(
            pad.dataset(touches), kernel="gaussian", e_map=e_map, draws=400, groups=["log_likelihood"]
        )
        fit.save(tmp_path / f"{e_map}.nc")
        files[e_map] = az.from_netcdf(tmp_path / f"{e_map}.nc")
    table = az.compare(files)
    difference, error = (float(table[name].iloc[1]) for name in (("elpd_diff", "dse")))
    if right:
        # Beyond four standard errors one would be called better than the other.
        assert abs(difference) < 4 * error + 4
    else:
        assert list(table.index) == ["empirical", "model"]
        assert abs(difference) > 4 * error


@pytest.mark.slow
def test_predictive_checks_and_prior_sensitivity(calibration: Any, touches: Any) -> None:
    if NEW:
        az.plot_ppc_dist(touches, var_names=["reading"], num_samples=20)
        az.plot_ppc_dist(touches, group="prior_predictive", var_names=["reading"], num_samples=20)
        az.plot_loo_pit(touches, var_names=["reading"])
        pit = np.asarray(az.loo_pit(touches, var_names="reading")["reading"])
        prior = az.psense_summary(calibration, var_names=["sigma", "mu"])["prior"].to_numpy()
        one = az.psense(touches.sel(touch=0), var_names=["R", "P"], group="likelihood", group_var_names=["whole_touch"])
    else:
        az.plot_ppc(touches, var_names=["reading"], num_pp_samples=20)
        az.plot_ppc(touches, group="prior", var_names=["reading"], num_pp_samples=20)
        az.plot_loo_pit(touches, y="reading")
        pit = np.asarray(az.loo_pit(touches, y="reading"))
        prior = np.array([float(az.psens(calibration)[name]) for name in ("sigma", "mu")])
        names = {"component": "likelihood", "component_var_names": ["whole_touch"]}
        one = az.psens(touches.sel(touch=0), var_names=["R", "P"], **names)
    # ranks are uniform: mean 1/2, sd 0.29 over 120 readings
    assert pit.shape == touches["observed_data"]["reading"].shape
    assert np.mean(pit) == pytest.approx(0.5, abs=0.1) and np.std(pit) == pytest.approx(0.289, abs=0.06)
    assert (prior > 0).all() and (prior < 1).all()
    assert 0 < float(one["R"]) < 1


def test_xarray_selects_by_tip_and_place(folder: Path) -> None:
    result = bayestouch.load(folder / "posterior.nc")
    draws = xr.open_datatree(folder / "posterior.nc", engine="h5netcdf")["posterior"].to_dataset()
    here = draws.set_index(touch=["tip", "place"]).sel(tip=3.9, place=-5.0)
    number = np.flatnonzero((result.rows.radius_mm == 3.9) & (result.reference["theta_c"] == -5.0))
    np.testing.assert_array_equal(here["R"], result.posterior["R"][..., number[0]])
