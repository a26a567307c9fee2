"""The noise that readers use: of single samples, of averaged rows, of the force sensor; and what is subtracted at rest.

What is expected are the numbers on file (which other tests here hold against the touches), written out by hand.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import crosstalk
import handed_over as handed
import numpy as np
import pytest
import written_out as w
import xarray as xr
from calibrated_files import Calibrated

import bayestouch
from bayestouch.data.touches import Touches, touches_from

M = w.ELEMENTS


@pytest.mark.parametrize("load", [True, False])
def test_single_samples_are_read_with_the_noise_of_one(hardly_known: Calibrated, load: bool) -> None:
    """Calibration taken as exact: a noise that is 5 % too small makes sds 5 % too small, and 1.5 % is noticed."""
    table = handed.touched(seed=5, samples=1)
    options = {"draws": 1600, "seed": 2, "plug_in": True, "use_load": load, "check_sensor": False}
    mean, sd = handed.moments(bayestouch.infer(table, hardly_known.load(), **options))
    _, expected = handed.by_quadrature(hardly_known, table, 1, (mean, sd), exact=True, load=load)
    # R of one sample reaches the ends of its prior: a box of 25 points is good to half a per cent there
    np.testing.assert_allclose((sd / expected).mean(axis=0), 1, atol=0.02)


def test_each_sample_is_read_as_one(hardly_known: Calibrated) -> None:
    """The samples of a touch one by one, as touches of their own with one read each."""
    table = handed.touched(seed=6, samples=2)
    apart = table.with_(touch=np.arange(table.n_rows), sample=np.zeros(table.n_rows, dtype=np.int64))
    one, other = (
        bayestouch.infer(each, hardly_known.load(), draws=64, seed=2, check_sensor=False, each_sample=by_sample)
        for each, by_sample in ((table, True), (apart, False))
    )
    for name in ("R", "theta_c", "P"):
        np.testing.assert_array_equal(one.posterior[name], other.posterior[name])
    np.testing.assert_array_equal(one.rows.touch, table.touch)


def averaged_rows(table: Touches) -> Touches:
    """One row a touch: the mean of its samples, their sd (with n - 1 below) and how many they were."""
    ids = np.unique(table.touch)
    parts = [np.flatnonzero(table.touch == one) for one in ids]
    return touches_from(
        touch=ids,
        readings=np.stack([table.readings[rows].mean(axis=0) for rows in parts]),
        readings_sd=np.stack([table.readings[rows].std(axis=0, ddof=1) for rows in parts]),
        reads=np.array([float(len(rows)) for rows in parts]),
        indenter_radius_mm=np.array([table.indenter_radius_mm[rows[0]] for rows in parts]),
        angle_deg=np.array([table.angle_deg[rows[0]] for rows in parts]),
        load=np.array([table.load[rows].mean() for rows in parts]),
    )


def test_averaged_rows_say_what_their_samples_say(hardly_known: Calibrated) -> None:
    """Means, counts, and the variance of one read with its degrees of freedom, by hand; and the same posteriors."""
    table = handed.touched(seed=7, samples=8)
    rows = averaged_rows(table)
    raw = table.readings.reshape(-1, 8, M)
    for each in (table.averaged(), rows.averaged()):
        np.testing.assert_allclose(each.readings, raw.mean(axis=1), rtol=1e-12)
        np.testing.assert_array_equal(each.counts, 8)
        np.testing.assert_allclose(each.pure_error_variance, raw.var(axis=1, ddof=1).mean(axis=0), rtol=1e-9)
        np.testing.assert_array_equal(each.pure_error_dof, 7 * len(raw))
    one, other = (
        bayestouch.infer(each, hardly_known.load(), draws=256, seed=2, check_sensor=False) for each in (table, rows)
    )
    for name in ("R", "theta_c", "P"):
        # one count less or more in eight would change each sd by 6 %
        np.testing.assert_allclose(one.sd(name), other.sd(name), rtol=1e-3)
        np.testing.assert_allclose(one.mean(name), other.mean(name), atol=1e-3 * one.sd(name).max())


def test_averaged_rows_calibrate_as_their_samples_do(hardly_known: Calibrated) -> None:
    """Noise of one read and of a mean: a calibration of averaged rows knows as much of the readings."""
    rng = np.random.default_rng(3)
    table = w.recorded(w.true_finger(), w.calibrating(rng, 4.0), rng, samples=8)
    both = [bayestouch.calibrate(w.dataset(each, each), draws=8) for each in (table, averaged_rows(table))]
    np.testing.assert_allclose(both[0].mode["noise_sd"], both[1].mode["noise_sd"], rtol=0.02)
    np.testing.assert_allclose(both[0].mode["r_s"], both[1].mode["r_s"], atol=0.02)


def test_rows_on_file_state_the_noise_of_their_means(hardly_known: Calibrated, tmp_path: Path) -> None:
    """``sd`` beside the predictions: noise over the root of the reads, and what the model misses."""
    table = handed.touched(seed=8, samples=3)
    path = tmp_path / "touches.nc"
    bayestouch.infer(table, hardly_known.load(), draws=64, check_sensor=False, output=path)
    noise = hardly_known.group("noise")
    expected = np.sqrt(noise["tactile_sd"] ** 2 / 3 + noise["discrepancy_sd"] ** 2)
    with xr.open_datatree(path) as tree:
        np.testing.assert_allclose(tree["rows"]["sd"], np.tile(expected, (30, 1)), rtol=1e-12)
        np.testing.assert_array_equal(tree["rows"]["counts"], 3)


def resting(table: Touches, offset: np.ndarray, rows: int, own: bool) -> Touches:
    """The table moved by an offset, with no-contact rows that read the offset: of each touch, or in front of all."""
    ids = np.unique(table.touch) if own else np.array([-1])
    rest = touches_from(
        touch=np.repeat(ids, rows),
        sample=np.tile(np.arange(-rows, 0), len(ids)) + 100,
        readings=np.tile(offset, (rows * len(ids), 1)),
        indenter_radius_mm=np.full(rows * len(ids), np.nan),
        angle_deg=np.zeros(rows * len(ids)),
        load=np.zeros(rows * len(ids)),
        time_s=np.zeros(rows * len(ids)),
    )
    return table.with_(
        **{
            name: np.concatenate([getattr(rest, name), getattr(table, name) + (offset if name == "readings" else 0)])
            for name in ("touch", "sample", "readings", "indenter_radius_mm", "angle_deg", "load", "time_s")
        },
        contact=np.full(rest.n_rows + table.n_rows, np.nan),
        depth_mm=np.full(rest.n_rows + table.n_rows, np.nan),
    )


@pytest.mark.parametrize("own", [True, False])
def test_rest_readings_are_subtracted_once(hardly_known: Calibrated, own: bool) -> None:
    """Zeros of hundreds of counts, with rows that show them, change no calibration and no touch.

    Three rows that are equal have no noise.
    """
    offset, plain = np.linspace(-400, 700, M), hardly_known.table
    moved = resting(plain, offset, 3, own)
    one, other = (bayestouch.calibrate(w.dataset(each, each), draws=8) for each in (plain, moved))
    for name in ("response", "r_s", "theta_s", "sigma", "mu", "noise_sd"):
        np.testing.assert_allclose(other.mode[name], one.mode[name], rtol=1e-6, atol=1e-9)
    table = handed.touched(seed=9, samples=2)
    expected = bayestouch.infer(table, one, draws=64, check_sensor=False)
    with_rest = resting(table, offset, 3, own)
    without_rest = table.with_(readings=table.readings + offset)
    for each in (with_rest, without_rest):
        # a table without rows at rest takes the rest reading of the calibration
        read = bayestouch.infer(each, other, draws=64, check_sensor=False)
        np.testing.assert_allclose(read.mean("theta_c"), expected.mean("theta_c"), atol=1e-3)
        np.testing.assert_allclose(read.rows.observed, expected.rows.observed, atol=1e-6)


def test_effects_of_the_noise_are_read_with(with_crosstalk: Calibrated) -> None:
    """Single samples through crosstalk, the calibration exact: sds as the noise on file has them, to 2 %."""
    rng = np.random.default_rng(15)
    pressed = w.Pressed(rng.uniform(2.5, 8, 30), np.radians(rng.uniform(-17, 17, 30)), rng.uniform(160, 240, 30))
    table = w.recorded(w.true_finger(), pressed, rng, samples=2, after=crosstalk.leaked)
    read = bayestouch.infer(table, with_crosstalk.load(), draws=1600, seed=4, plug_in=True, check_sensor=False)
    mean, sd = handed.moments(read)
    mode, noise, means = with_crosstalk.group("mode"), with_crosstalk.group("noise"), table.averaged()
    values = np.array([mode[f"crosstalk_{name}"] for name in ("share", "reach", "lean")])
    chain = w.finger_at(w.parameters_of(mode))
    variance = noise["tactile_sd"] ** 2 / 2 + noise["discrepancy_sd"] ** 2
    found = [
        w.touch_posterior(
            lambda *touch: crosstalk.leaked(chain.predict(*touch), values),
            means.readings[k],
            np.diag(variance),
            (means.load[k], float(noise["force_sd"]) / np.sqrt(2)),
            mean[k],
            sd[k],
        ).sd
        for k in range(30)
    ]
    np.testing.assert_allclose((sd / np.stack(found)).mean(axis=0), 1, atol=0.02)


def test_an_excess_that_the_check_finds_widens_the_noise(hardly_known: Calibrated) -> None:
    """Readings that miss the model by more than its noise are read with that much more."""
    table = handed.touched(seed=11, samples=4)
    rng = np.random.default_rng(0)
    loud = replace(table, readings=table.readings + 60 * rng.standard_normal(table.readings.shape))
    options = {"draws": 400, "use_load": False, "plug_in": True}
    plain = bayestouch.infer(loud, hardly_known.load(), check_sensor=False, **options)
    checked = bayestouch.infer(loud, hardly_known.load(), **options)
    excess = float(checked.settings["noise_widened"])
    assert excess > 2
    # where a touch is not near the ends of what the prior allows, its sd goes with the noise; a tenth for the others
    assert np.median(checked.sd("theta_c") / plain.sd("theta_c")) == pytest.approx(excess, rel=0.1)
