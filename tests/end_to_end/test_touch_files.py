"""Files of touches: which draw belongs to which touch, thinning, units, summaries and references, by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import written_out as w
import xarray as xr
from calibrated_files import Calibrated
from pad_simulation import grid, square

import bayestouch
from bayestouch.data.touches import Touches
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.results.reading import load_touches

TIPS = np.array([2.0, 5.0, 9.0, 20.0, 40.0, 3.0])
PLACES = np.array([-15.0, 12.0, -6.0, 9.0, 3.0, -11.0])
LOADS = np.array([150.0, 170.0, 190.0, 210.0, 230.0, 250.0])
#: Numbers of the touches, in no order.
IDS = np.array([40, 7, 113, 2, 88, 51])


def scattered() -> Touches:
    """Six touches far apart in tip, place and load."""
    pressed = w.Pressed(1 / (1 / w.OUTER + 1 / TIPS), np.radians(PLACES), LOADS)
    table = w.recorded(w.true_finger(), pressed, np.random.default_rng(4), samples=16, noise=4.0, force_noise=0.1)
    return table.with_(touch=IDS[table.touch])


@pytest.fixture(scope="module")
def calibration(well_known: Calibrated) -> bayestouch.Calibration:
    return well_known.load()


def variables(path: Path, group: str) -> dict[str, np.ndarray]:
    with xr.open_datatree(path) as tree:
        return {str(name): np.array(values) for name, values in tree[group].data_vars.items()}


def test_draws_on_file_belong_to_their_touches(calibration: bayestouch.Calibration, tmp_path: Path) -> None:
    """Every touch's number, tip, place (degrees) and load beside its own draws; every fourth of each chain is kept."""
    options = {"draws": 256, "seed": 3, "check_sensor": False}
    whole, path = bayestouch.infer(scattered(), calibration, **options), tmp_path / "touches.nc"
    bayestouch.infer(scattered(), calibration, thin=4, output=path, **options)
    draws = variables(path, "posterior")
    with xr.open_datatree(path) as tree:
        np.testing.assert_array_equal(tree["posterior"]["touch"], IDS)
        assert tree["posterior"]["R"].dims == ("chain", "draw", "touch")
        units = {name: tree["posterior"][name].attrs["units"] for name in draws}
    assert units == {"r_c": "mm", "R": "mm", "theta_c": "degree", "P": "N/m"}
    for name, values in whole.posterior.items():
        assert values.shape == (4, 64, 6)
        np.testing.assert_array_equal(draws[name], values[:, ::4])
    for name, truth in {"theta_c": PLACES, "P": LOADS, "R": 1 / (1 / w.OUTER + 1 / TIPS)}.items():
        mean, sd = draws[name].mean(axis=(0, 1)), draws[name].std(axis=(0, 1))
        # no touch is within 6 sds of another's truth in the place
        assert np.all(np.abs(mean - truth) < 6 * sd), name
    assert np.diff(np.sort(PLACES)).min() > 6 * draws["theta_c"].std(axis=(0, 1)).max()
    np.testing.assert_allclose(1 / draws["R"], 1 / w.OUTER + 1 / draws["r_c"], rtol=1e-9)


def test_references_on_file_are_those_of_the_table(calibration: bayestouch.Calibration, tmp_path: Path) -> None:
    path, table = tmp_path / "touches.nc", scattered()
    bayestouch.infer(table, calibration, draws=64, check_sensor=False).save(path)
    found = variables(path, "constant_data")
    np.testing.assert_allclose(found["r_c"], TIPS, rtol=1e-9)
    np.testing.assert_allclose(found["R"], TIPS * w.OUTER / (TIPS + w.OUTER), rtol=1e-9)
    np.testing.assert_allclose(found["theta_c"], PLACES, rtol=1e-9)
    np.testing.assert_allclose(found["P"], table.load.reshape(6, 16).mean(axis=1), rtol=1e-9)


def test_summaries_are_of_all_draws(calibration: bayestouch.Calibration, tmp_path: Path) -> None:
    """Mean, sd and quantiles on file and by method, against numpy on every draw, also where few were kept."""
    options = {"draws": 256, "seed": 3, "check_sensor": False}
    whole, path = bayestouch.infer(scattered(), calibration, **options), tmp_path / "touches.nc"
    bayestouch.infer(scattered(), calibration, thin=8, output=path, **options)
    read, summary = load_touches(path), variables(path, "summary")
    for name, values in whole.posterior.items():
        flat = values.reshape(-1, 6)
        expected = [flat.mean(axis=0), flat.std(axis=0), *np.quantile(flat, [0.05, 0.5, 0.95], axis=0)]
        np.testing.assert_allclose(summary[name], expected, rtol=1e-9)
        for each in (whole, read):
            np.testing.assert_allclose(each.mean(name), expected[0], rtol=1e-9)
            np.testing.assert_allclose(each.sd(name), expected[1], rtol=1e-9)
            np.testing.assert_allclose(each.interval(name), (expected[2], expected[4]), rtol=1e-9)
        half = np.quantile(flat, [0.25, 0.75], axis=0)
        np.testing.assert_allclose(whole.interval(name, 0.5), half, rtol=1e-9)


def test_draws_of_a_pad_on_file_belong_to_their_touches(tmp_path: Path) -> None:
    """x, y and the load of five touches far apart, under numbers in no order."""
    pad, rng = square(floor=0.002, share=0.002), np.random.default_rng(2)
    place = grid(5, 17, 9, 2)
    load = rng.uniform(0.8, 1.2, len(place))
    calibration = calibrate_pad(
        pad.dataset(pad.touch(place, rng, load=load, measured=True)), kernel="gaussian", empirical=False, draws=8
    )
    truth, loads = np.array([[7.0, 13.0], [14.0, 6.0], [10.0, 8.0], [8.0, 6.8], [13.0, 12.0]]), np.linspace(0.8, 1.2, 5)
    table = pad.touch(truth, rng, load=loads, measured=True)
    table, path = table.with_(touch=IDS[table.touch]), tmp_path / "touches.nc"
    bayestouch.infer(table, calibration, draws=256, output=path)
    draws = variables(path, "posterior")
    with xr.open_datatree(path) as tree:
        np.testing.assert_array_equal(tree["posterior"]["touch"], IDS[:5])
        assert [tree["posterior"][name].attrs["units"] for name in ("x", "y", "P")] == ["mm", "mm", "N"]
    for name, expected in (("x", truth[:, 0]), ("y", truth[:, 1]), ("P", loads)):
        mean, sd = draws[name].mean(axis=(0, 1)), draws[name].std(axis=(0, 1))
        assert np.all(np.abs(mean - expected) < 6 * sd), name
        assert np.diff(np.sort(expected)).min() > 3 * sd.max(), name
