"""What files have of the ArviZ schema: coordinates of touches, units, attributes; and files of version 0.1.0."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from posterior_cases import FINGER, PAD, calibration, same, touches

import bayestouch
from bayestouch.errors import InputError
from bayestouch.results import netcdf
from bayestouch.results.groups import calibration_groups, touch_groups
from bayestouch.results.reading import load
from bayestouch.results.schema import GROUPS, chosen_groups, schema_attributes, touch_coordinates

OLD = Path(__file__).parent / "files_of_0_1"


def test_files_of_version_0_1_load() -> None:
    """As version 0.1.0 wrote them: without coordinates of touches, attributes of the schema and reads of a touch.

    Each touch then has the samples of the element that was read most, and as many loads, at least one.
    """
    for file, wanted in (("calibration.nc", calibration()), ("posterior.nc", touches())):
        samples = np.array([float(max(row)) for row in wanted.rows.counts])
        rows = replace(wanted.rows, samples=samples, load_reads=np.where(samples > 0, samples, 1.0))
        same(load(OLD / file), replace(wanted, rows=rows))


def test_groups_by_name() -> None:
    assert chosen_groups("all") == GROUPS
    assert chosen_groups("") == chosen_groups(()) == ()
    assert chosen_groups("prior, log_likelihood") == chosen_groups(["log_likelihood", "prior"])
    with pytest.raises(InputError, match=r"expected all, or some of .*got 'likelihood'"):
        chosen_groups("likelihood")


@pytest.mark.parametrize("sensor", [FINGER, PAD], ids=["finger", "pad"])
def test_touches_are_chosen_by_tip_and_place(sensor: bayestouch.Sensor, tmp_path: Path) -> None:
    """With xarray alone."""
    result = touches(sensor)
    axis = next(iter(result.rows.location))
    places = {**result.rows.location, axis: np.array([10.0, 20.0, 10.0 + 1e-9, 20.0, 30.0])}
    radius = np.array([0.0, 0.0, np.inf, np.inf, 3.2])
    result = replace(result, rows=replace(result.rows, radius_mm=radius, location=places))
    result.save(tmp_path / "p.nc")
    with xr.open_datatree(tmp_path / "p.nc", engine="h5netcdf") as tree:
        draws = tree["posterior"].to_dataset()
        name = "place" if sensor is FINGER else f"place_{axis}"
        one = draws.set_index(touch=["tip", name]).sel({"tip": np.inf, name: 10.0})
        np.testing.assert_array_equal(one["P"], result.posterior["P"][..., 2])
        flat = draws.set_xindex("tip").sel(tip=np.inf)
        np.testing.assert_array_equal(flat["P"], result.posterior["P"][..., 2:4])
        np.testing.assert_array_equal(draws["index"], np.arange(5))
        assert draws["tip"].attrs["units"] == "mm"
        assert draws[name].attrs["units"] == ("degree" if sensor is FINGER else "mm")
        for group in ("posterior", "sample_stats", "observed_data", "constant_data"):
            assert {"index", "tip", name} <= set(tree[group].coords)


def test_positions_go_on_from_block_to_block() -> None:
    np.testing.assert_array_equal(touch_coordinates(touches().rows, 512)["index"], 512 + np.arange(5))


def plot_label(axes: Axes) -> str:
    """Unit in the label of an axis: what stands in parentheses at its end."""
    found = re.search(r"\(([^()]*)\)$", axes.get_xlabel())
    return found[1] if found else ""


def test_units_on_every_variable_as_in_plots() -> None:
    for groups, _ in (calibration_groups(calibration()), touch_groups(touches()), touch_groups(touches(PAD))):
        for name, group in groups.items():
            for variable in group.data_vars:
                assert "units" in group[variable].attrs, (name, variable)
    groups, _ = calibration_groups(calibration())
    for name in ("sigma", "mu"):
        assert groups["posterior"][name].attrs["units"] == plot_label(calibration().plot_parameter(name))
    groups, _ = touch_groups(touches())
    assert groups["rows"]["location_theta_c"].attrs["units"] == "degree"
    assert groups["rows"]["radius_mm"].attrs["units"] == "mm"
    assert groups["observed_data"]["load"].attrs["units"] == "N/m"
    label = touches().plot_estimates("theta_c").get_ylabel()
    assert f"({groups['posterior']['theta_c'].attrs['units']})" in label


def test_attributes_of_the_schema(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    touches().save(tmp_path / "p.nc")
    with xr.open_datatree(tmp_path / "p.nc", engine="h5netcdf") as tree:
        for node in (tree, tree["posterior"], tree["observed_data"]):
            assert node.attrs["created_at"] == "1970-01-02T00:00:00+00:00"
            assert node.attrs["inference_library"] == "bayestouch"
            assert node.attrs["inference_library_version"] == bayestouch.__version__
            assert node.attrs["creation_library_language"] == "Python"
    assert touches().to_arviz()["posterior"].attrs == schema_attributes()
    monkeypatch.delenv("SOURCE_DATE_EPOCH")
    assert abs(np.datetime64(schema_attributes()["created_at"][:19]) - np.datetime64("now")) < np.timedelta64(60, "s")


def test_groups_come_back_and_large_ones_stay_on_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    groups = {
        "log_likelihood": {
            "reading": rng.normal(size=(4, 50, 5, 3)).astype(np.float32),
            "load": rng.normal(size=(4, 50, 5)),
        },
        "sample_stats": {"lp": rng.normal(size=(4, 50, 5))},
    }
    result = replace(touches(), groups=groups)
    result.save(tmp_path / "p.nc")
    same(load(tmp_path / "p.nc"), result)
    with xr.open_datatree(tmp_path / "p.nc", engine="h5netcdf") as tree:
        assert tree["log_likelihood"]["reading"].dims == ("chain", "draw", "touch", "element")
        assert tree["sample_stats"]["lp"].dims == ("chain", "draw", "touch")
        assert tree["log_likelihood"]["reading"].attrs["units"] == ""
    in_all = sum(values.nbytes for group in groups.values() for values in group.values())
    monkeypatch.setattr(netcdf, "LARGEST_IN_MEMORY", in_all - 1)
    left = load(tmp_path / "p.nc")
    assert left.groups == {} and "ess_bulk" in left.sample_stats
    assert left.notes[len(result.notes) :] == (
        "not read, because they take more than 1 GB together: log_likelihood (open the file with xarray)",
    )
    left[:2].save(tmp_path / "part.nc")
    monkeypatch.undo()
    assert load(tmp_path / "part.nc").notes == result.notes  # this file has no such group
    in_calibration = {
        "log_likelihood": {"whole_touch": rng.normal(size=(4, 25, 6))},
        "log_prior": {"r_s": rng.normal(size=(4, 25, 3))},
    }
    known = replace(calibration(), groups=in_calibration)
    known.save(tmp_path / "c.nc")
    same(load(tmp_path / "c.nc"), known)
    with xr.open_datatree(tmp_path / "c.nc", engine="h5netcdf") as tree:
        assert tree["log_likelihood"]["whole_touch"].dims == ("chain", "draw", "touch")
        assert tree["log_prior"]["r_s"].dims == ("chain", "draw", "element")
