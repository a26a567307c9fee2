"""Planned touches on a pad: the rebuilt posterior against that of the calibration, and against a new calibration."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pad_simulation import FORCE_NOISE, SimulatedPad, flattened, flattening, line, square

import bayestouch
from bayestouch.array_types import FloatArray
from bayestouch.chain.kernels import GaussianKernel
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.dataset import DataSet
from bayestouch.effects.stated import StatedModel
from bayestouch.model.split_data import joined_tables
from bayestouch.pad.planned import planned
from bayestouch.pad.reading.reader import PadReader
from bayestouch.reliability import pad_spots


@cache
def calibrated(name: str) -> tuple[SimulatedPad, DataSet, bayestouch.Calibration]:
    """A line with measured loads and a map; a plane with loads that are not measured, without a map."""
    rng = np.random.default_rng(4)
    if name == "line":
        pad = line()
        place = rng.uniform(7.0, 31.0, (60, 1))
        table = pad.touch(place, rng, load=rng.uniform(0.5, 1.5, 60), measured=True, samples=4)
        options = {"kernel": "gaussian"}
    else:
        pad = square()
        table = pad.touch(rng.uniform([5.0, 2.0], [17.0, 14.0], (50, 2)), rng, samples=4)
        options = {"kernel": "gaussian"}
    dataset = pad.dataset(table)
    return pad, dataset, bayestouch.calibrate(dataset, draws=400, **options)


@pytest.mark.parametrize("name", ["line", "square"])
def test_the_posterior_of_the_chain_is_that_of_the_calibration(name: str) -> None:
    _, _, one = calibrated(name)
    d = len(one.layout)
    found = planned(one, bayestouch.candidate_touches(one)).readings.covariance[:d, :d]
    sd = np.sqrt(np.diag(one.covariance))
    np.testing.assert_allclose(np.sqrt(np.diag(found))[:-1], sd[:-1], rtol=0.02)
    # The kernel has one parameter, whose sd is that of the draws; the other covariance is a normal approximation.
    assert found[-1, -1] ** 0.5 == pytest.approx(one.posterior[one.layout[-1]].std(ddof=1), rel=1e-6)
    found[-1] *= sd[-1] / found[-1, -1] ** 0.5
    found[:, -1] *= sd[-1] / found[-1, -1] ** 0.5
    np.testing.assert_allclose(found / np.outer(sd, sd), one.covariance / np.outer(sd, sd), atol=0.03)


@cache
def of_four_elements() -> DataSet:
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 6.0, 12.0, 18.0), element_y_mm=None, n_touches=60, load_range=(1.99, 2.01)
    )
    return bayestouch.simulate(design, seed=1).dataset


@pytest.mark.slow
def test_a_parameter_at_its_bound_is_as_uncertain_as_in_the_draws() -> None:
    """At its mode, zero, the readings do not depend on `a`: its sd was that of its prior, 2, whatever was touched."""
    one = bayestouch.calibrate(of_four_elements(), seed=1)
    assert one.mode["a"] < 1e-6
    told = bayestouch.next_touches(one, count=2)
    for name, before in zip(told.quantities, told.before, strict=True):
        drawn = np.sqrt(np.mean(np.var(one.posterior[name], axis=(0, 1))))
        # Gains and places are normal given the kernel: an approximation that is good to some percent.
        assert before == pytest.approx(drawn, rel=2e-3 if name in {"h", "depth_share", "sigma", "a"} else 0.06)
    assert told.after[-1][told.quantities.index("a")] < told.before[told.quantities.index("a")]


@cache
def with_map() -> bayestouch.Calibration:
    """A pad whose kernel is not quite Gaussian: the rest is its map."""
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 6.0, 12.0), element_y_mm=None, calibration_step_mm=0.5, n_touches=30
    )
    return bayestouch.calibrate(bayestouch.simulate(design, seed=3).dataset, kernel="gaussian", draws=200)


def test_the_uncertainty_of_readings_is_that_of_the_tables_with_a_map() -> None:
    """The tables have the variance at each place; here the map is written out as functions with weights."""
    one = with_map()
    assert one.settings["empirical_map"] == "yes"
    table = bayestouch.candidate_touches(one)
    map_ = PadMap.from_arrays(one.extra)
    assert table.x_mm is not None
    _, variance, covariance = map_.at(table.x_mm[:, None], table.load)
    expected = map_.reading_variance(variance, covariance, table.load)
    expected += ((table.load[:, None, None] * map_.shared_at(table.x_mm[:, None])) ** 2).sum(axis=1)
    readings = planned(one, table).readings
    found = np.einsum("nmd,de,nme->nm", readings.columns, readings.covariance, readings.columns)
    # The functions leave out a variance below 3 % of the noise; the tables have the noise of the fit, which is
    # estimated once more after it.
    noise = np.diagonal(readings.noise, axis1=1, axis2=2)
    assert np.abs(found - expected).max() < 0.1 * noise.min()


def test_the_sensitivity_is_asked_for_where_there_is_a_map() -> None:
    """Its variance is that of the tables, at the places of the calibration (25, all of them)."""
    one = with_map()
    planned_touches = planned(one, bayestouch.candidate_touches(one))
    group = planned_touches.parameters[-1]
    assert group.name == "sensitivity" and group.unit == "counts/N"
    assert "sensitivity" not in {each.name for each in planned(calibrated("line")[2], _few()).parameters}
    found = np.einsum("kd,de,ke->k", group.rows, planned_touches.readings.covariance, group.rows)
    _, variance, _ = PadMap.from_arrays(one.extra).at(one.rows.location["x"][:, None], one.rows.load)
    # As above, the tables have the noise of the fit, and the functions leave out what is far below the noise.
    np.testing.assert_allclose(np.sqrt(found.mean()), np.sqrt(variance.mean()), rtol=0.03)


def _few() -> bayestouch.Touches:
    return bayestouch.candidate_touches(calibrated("line")[2], places=[12.0])


def test_slopes_over_the_touch_are_differences() -> None:
    one = with_map()
    table = bayestouch.candidate_touches(one, places=[2.0, 7.0], loads=[1.5])
    assert table.x_mm is not None
    step = 1e-3
    by_place = [planned(one, table.with_(x_mm=table.x_mm + s * step)).readings.mean for s in (1, -1)]
    by_load = [planned(one, table.with_(load=table.load + s * step)).readings.mean for s in (1, -1)]
    slopes = planned(one, table).slopes
    scale = np.abs(slopes).max(axis=(0, 1))
    np.testing.assert_allclose((by_place[0] - by_place[1]) / (2 * step), slopes[:, :, 0], atol=1e-4 * scale[0])
    np.testing.assert_allclose((by_load[0] - by_load[1]) / (2 * step), slopes[:, :, 1], atol=1e-4 * scale[1])


def test_the_bias_of_places_is_that_of_the_maps() -> None:
    """Both count what elements share. The tables have the noise of the fit."""
    _, _, one = calibrated("line")
    table = bayestouch.candidate_touches(one, places=[12.0, 16.0, 20.0], samples=4)
    (bias,) = planned(one, table).biases(np.arange(3))
    found = planned(one, table).readings.covariance
    sd = np.sqrt(np.einsum("td,de,te->t", bias.rows, found, bias.rows))
    assert table.x_mm is not None
    spots = pad_spots(PadReader.from_calibration(one), table.x_mm[:, None], reads=4)
    np.testing.assert_allclose(sd, spots.bias_rms[:, 0], rtol=0.08)  # 0.05 found


def test_the_sds_are_those_of_a_calibration_with_the_chosen_touches() -> None:
    pad, dataset, one = calibrated("line")
    rng = np.random.default_rng(9)
    place, load = rng.uniform(7.0, 31.0, (80, 1)), rng.uniform(0.5, 1.5, 80)
    candidates = pad.touch(place, rng, load=load, measured=True, samples=4)
    chosen = bayestouch.next_touches(one, candidates, count=20)
    more = candidates.select(np.isin(candidates.touch, chosen.chosen))
    assert dataset.calibration is not None
    table = joined_tables(dataset.calibration, more)
    again = bayestouch.calibrate(replace(dataset, calibration=table), kernel="gaussian", draws=400)
    # The noise of the calibration is estimated again: the prediction is made with the new one, for it is not of it.
    told = bayestouch.next_touches(replace(one, noise=again.noise), candidates, count=20)
    sd = np.sqrt(np.diag(again.covariance))
    rms = [_rms(sd, again.layout, name) for name in told.quantities]
    np.testing.assert_allclose(told.after[-1], rms, rtol=0.06)
    assert (told.after[-1] < 0.9 * told.before).all()


def _rms(sd: FloatArray, layout: tuple[str, ...], name: str) -> float:
    return float(np.sqrt(np.mean([s**2 for s, row in zip(sd, layout, strict=True) if row.split("[")[0] == name])))


def test_loads_that_are_not_measured_vary_as_those_of_the_calibration() -> None:
    _, _, one = calibrated("square")
    assert not one.settings["load_measured"]
    table = bayestouch.candidate_touches(one, places=[[10.0, 6.0]])
    readings = planned(one, table).readings
    signal = readings.mean[0] - PadMap.from_arrays(one.extra).offset
    reads = float(np.median(one.rows.counts.max(axis=1)))
    expected = np.diag(one.noise.mean_variance(np.full(4, reads), signal))
    expected += np.outer(signal, signal) * float(one.settings["load_sd"]) ** 2
    np.testing.assert_allclose(readings.noise[0], expected, rtol=1e-3, atol=1e-9)


def test_kernel_is_known() -> None:
    _, _, one = calibrated("line")
    names = {parameter.name for parameter in GaussianKernel(6.0).parameters}
    assert names < {group.name for group in planned(one, bayestouch.candidate_touches(one)).parameters}


def test_a_constant_about_which_there_is_a_map_has_no_kernel_to_know() -> None:
    one = bayestouch.calibrate(of_four_elements(), kernel="constant", draws=64, seed=1)
    told = bayestouch.next_touches(one)
    assert told.quantities == ("gain", "x_s", "sensitivity")
    sd = np.sqrt(np.diag(one.covariance))
    np.testing.assert_allclose(told.before[:2], [_rms(sd, one.layout, name) for name in ("gain", "x_s")], rtol=0.01)


def test_stated_loads_are_as_read_where_the_response_flattens() -> None:
    """The readings are those of the acting loads; slope and error of P are those of the true load."""
    pad, one = flattening()
    read = np.array([0.8, 2.0, 3.8])
    table = bayestouch.candidate_touches(one, places=[16.0], loads=read, samples=4)
    found = planned(one, table)
    expected = pad.chain.predict(np.full((3, 1), 16.0), flattened(read))
    # Elements by the load: their noise is a percent of the signal, of which the calibration has two hundred touches.
    np.testing.assert_allclose(found.readings.mean, expected, rtol=0.02, atol=0.1)
    step = 1e-3
    up, down = (planned(one, table.with_(load=read + s * step)).readings.mean for s in (1, -1))
    np.testing.assert_allclose(found.slopes[:, :, -1], (up - down) / (2 * step), rtol=1e-3, atol=1e-3)
    # Four samples of the force sensor; and the load scatter, an error of the acting load.
    slope = (flattened(read + step) - flattened(read - step)) / (2 * step)
    expected = np.hypot(FORCE_NOISE / 2, one.noise.load_scatter / slope)
    np.testing.assert_allclose(found.precision[:, -1] ** -0.5, expected, rtol=0.02)


def test_a_load_that_is_not_stated_is_the_mean_load_as_read() -> None:
    _, one = flattening()
    usual = bayestouch.candidate_touches(one, places=[16.0])
    # The loads of the calibration are uniform from 0.5 to 4 N: two hundred of them have a mean error of 0.07 N.
    assert usual.load == pytest.approx(2.25, abs=0.2)
    stated, unstated = (planned(one, each).readings.mean for each in (usual, usual.with_(load=np.array([np.nan]))))
    np.testing.assert_array_equal(stated, unstated)


def test_noise_of_the_signal_and_of_all_elements() -> None:
    """With the numbers on file, written out: six samples of each touch."""
    _, dataset, _ = calibrated("line")
    model = StatedModel("pad", "", (("signal_dependent_noise", {}), ("common_mode_noise", {})))
    one = bayestouch.calibrate(dataset, kernel="gaussian", model=model, draws=64)
    added = json.loads(str(one.settings["effects"]))["noise"] | {"common": 0.01, "common_touch": 0.004}
    effects = json.loads(str(one.settings["effects"])) | {"noise": added}
    one = replace(one, settings={**one.settings, "effects": json.dumps(effects)})
    table = bayestouch.candidate_touches(one, places=[14.0, 21.0], loads=[1.2], samples=6)
    readings, peak = planned(one, table).readings, one.extra["effect_peak"]
    signal = readings.mean - PadMap.from_arrays(one.extra).offset
    force = one.noise.force_sd / np.sqrt(6)
    together = peak ** (1 - added["common_shared"]) * peak.mean() ** added["common_shared"]
    for t in range(2):
        read = one.extra["effect_zero"] + signal[t]
        own = one.noise.tactile_sd**2 + (added["share"] * peak * np.abs(read / peak) ** added["power"]) ** 2
        expected = np.diag(own / 6 + one.noise.discrepancy_sd**2 + (one.noise.signal_share * signal[t]) ** 2)
        expected += (0.01**2 / 6 + 0.004**2) * np.outer(together, together)
        expected += np.outer(signal[t], signal[t]) / 1.2**2 * (force**2 + one.noise.load_scatter**2)
        found = readings.noise[t]
        scale = np.sqrt(np.diag(expected))
        np.testing.assert_allclose(found / np.outer(scale, scale), expected / np.outer(scale, scale), atol=0.03)
