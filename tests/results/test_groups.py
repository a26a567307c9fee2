"""Groups of a result: what ArviZ expects in them, and texts that are no UTF-8."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import arviz
import matplotlib
import numpy as np
import pytest
from posterior_cases import calibration, same, touches

import bayestouch
from bayestouch.results.from_groups import calibration_from_groups
from bayestouch.results.groups import calibration_groups


def test_notes_and_settings_name_files_of_any_name(tmp_path: Path) -> None:
    """The name of a file may hold a byte that is no UTF-8, in Python a lone surrogate."""
    notes, settings = ("t\udcff.csv: read µ",), {"table": "t\udcff.csv"}
    for made in (calibration(), touches()):
        made = replace(made, notes=notes, settings=settings)
        made.save(tmp_path / "saved.nc")
        again = bayestouch.load(tmp_path / "saved.nc")
        assert again.notes == ("t?.csv: read µ",) and again.settings["table"] == "t?.csv"


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_predictions_of_a_calibration_are_compared_with_readings_alone(tmp_path: Path) -> None:
    """ArviZ plots every variable of `observed_data`: loads are given to the model, and are no prediction of it."""
    matplotlib.use("Agg")
    made = calibration()
    reading = np.random.default_rng(3).normal(size=(4, 25, *made.rows.observed.shape))
    made = replace(made, groups={"posterior_predictive": {"reading": reading}})
    made = replace(made, rows=replace(made.rows, observed=np.nan_to_num(made.rows.observed)))
    made.save(tmp_path / "c.nc")
    data = arviz.from_netcdf(tmp_path / "c.nc")
    assert list(data["observed_data"].data_vars) == list(data["posterior_predictive"].data_vars) == ["reading"]
    np.testing.assert_array_equal(data["constant_data"]["load"], [400.0, np.nan] * 3)
    assert data["constant_data"]["load"].attrs["units"] == "N/m"
    plot = arviz.plot_ppc_dist if hasattr(arviz, "plot_ppc_dist") else arviz.plot_ppc
    assert plot(data) is not None


def test_loads_among_the_observed_data_of_an_older_file_are_read() -> None:
    groups, attributes = calibration_groups(calibration())
    load = groups["constant_data"]["load"]
    older = groups | {
        "observed_data": groups["observed_data"].assign(load=load),
        "constant_data": groups["constant_data"].drop_vars("load"),
    }
    same(calibration_from_groups(older, attributes), calibration_from_groups(groups, attributes))
