"""Units of variables in files: of loads that were measured, and of loads that are shares of the usual load."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pad_simulation import grid, square
from posterior_cases import PAD, calibration

import bayestouch
from bayestouch.results.units import load_unit, units_of

# What a pad's file has per load: unit with loads in N, and of shares of the usual load.
OF_LOADS = {
    "load": ("N", ""),
    "load_scatter": ("N", ""),
    "map_loads": ("N", ""),
    "map_sensitivity": ("kPa/N", "kPa"),
    "map_variance": ("(kPa/N)^2", "(kPa)^2"),
    "map_covariance": ("(kPa)^2/N", "(kPa)^2"),
    "map_shared": ("kPa/N", "kPa"),
    "map_by_effect": ("kPa/N", "kPa"),
    "map_by_load": ("kPa/N", "kPa"),
    "map_variance_by_load": ("(kPa/N)^2", "(kPa)^2"),
    "map_offset_by_effect": ("kPa", "kPa"),
    "force_sd": ("N", "N"),
}


@pytest.mark.parametrize("measured", [True, False])
def test_units_of_a_calibrated_pad(measured: bool) -> None:
    settings = {"load_measured": float(measured)}
    made = replace(calibration(), sensor=replace(PAD, reading_unit="kPa"), parameters=(), settings=settings)
    units = units_of(made)
    assert {name: units[name] for name in OF_LOADS} == {name: of[not measured] for name, of in OF_LOADS.items()}
    assert units_of(replace(made, sensor=PAD))["map_sensitivity"] == ("reading/N" if measured else "")


def test_a_finger_is_in_the_unit_of_its_force_sensor() -> None:
    units = units_of(calibration())
    assert units["load_scatter"] == units["force_sd"] == "N/m" and units["gain"] == "counts/strain"


def test_loads_that_were_not_measured_have_no_unit_in_files_and_results(tmp_path: Path) -> None:
    """Also where touches that are read have measured loads: these are not used, and are no reference."""
    import xarray as xr

    pad, rng = square(), np.random.default_rng(0)
    table = pad.touch(grid(3, 19, 6, 2), rng)
    calibrated = bayestouch.calibrate(pad.dataset(table), kernel="gaussian", e_map="model", draws=8)
    read = bayestouch.infer(table.with_(load=np.full(table.n_rows, 2.0)), calibrated, draws=64)
    assert load_unit(calibrated) == load_unit(read) == ""
    assert np.isnan(read.rows.load).all() and np.isnan(read.reference["P"]).all()
    for name, result in (("calibrated.nc", calibrated), ("read.nc", read)):
        result.save(tmp_path / name)
        with xr.open_datatree(tmp_path / name, engine="h5netcdf") as tree:
            units = {str(key): v.attrs["units"] for node in tree.subtree for key, v in node.data_vars.items()}
        assert units["load"] == "" and not any("N" in unit for key, unit in units.items() if key != "force_sd")
