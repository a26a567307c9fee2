"""The density of touches on a pad, written out: kernel, what its calibration leaves, noise, load.

A line of four elements with Gaussian kernels, ``reading = offset + P gain exp(-ρ²/2w²)``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pad_files import SAMPLES, SETTINGS, Kernel, M, OnFile, on_file
from pad_simulation import line
from scipy import stats

from bayestouch.inference import infer
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.pad.known_touches import pad_readings
from bayestouch.pad.reading.reader import PadReader


@pytest.fixture(scope="module", params=[True, False], ids=["loads measured", "loads not measured"])
def pad(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> OnFile:
    return on_file(tmp_path_factory.mktemp("pad"), 3, touches=20, measured=request.param, draws=8000)


@pytest.mark.parametrize("exact", [False, True])
def test_density_of_a_touch_is_the_one_written_out(pad: OnFile, exact: bool) -> None:
    """Differences of the log density between places and loads, to the spline's error (a millionth of the peak).

    Where loads were not measured the elements share errors, of which only what moves a touch is kept: see the next
    test.
    """
    rng = np.random.default_rng(8)
    reader = PadReader.from_calibration(pad.calibration(), plug_in=exact)
    if reader.map.n_shared:
        assert not exact and not reader.load_measured
        return
    simulated = line(**SETTINGS)
    table = simulated.touch(rng.uniform(9, 30, (12, 1)), rng, load=rng.uniform(0.8, 1.2, 12), measured=True, samples=5)
    readings = pad_readings(table, 1, "mean")
    known, means = reader.touches(readings), table.averaged()
    settings = pad.calibration().settings
    for t in range(12):
        x = table.x_mm[5 * t] + rng.uniform(-0.6, 0.6, 40)
        load = means.load[t] * rng.uniform(0.9, 1.1, 40)
        found = reader.log_density(known, np.stack([x, load], axis=-1)[None], np.array([t]))[0]
        sd = np.sqrt(pad.variance(x, load, 5, exact=exact))
        expected_reading = Kernel(pad.flat("mode")).readings(x, load)
        log = stats.norm(expected_reading, sd).logpdf(means.readings[t]).sum(axis=1)
        if settings["load_measured"]:
            # The sampler's load is the one that the elements felt.
            noise = pad.group("noise")
            felt_sd = np.hypot(float(noise["force_sd"]) / np.sqrt(5), float(noise["load_scatter"]))
            log += stats.norm(means.load[t], felt_sd).logpdf(load)
        else:
            log += stats.norm(1.0, float(settings["load_sd"])).logpdf(load)
        assert np.ptp(log) > 10
        np.testing.assert_allclose(found - found[0], log - log[0], rtol=1e-3, atol=1e-2)


def test_draws_of_touches_are_those_of_that_density(pad: OnFile) -> None:
    """Means and sds of location and load, against sums over a dense grid.

    The sd of 1,500 effective draws is good to 1.8 %, the mean ratio over 24 touches to 0.4 %.
    """
    rng, calibration = np.random.default_rng(9), pad.calibration()
    simulated, n = line(**SETTINGS), 24
    measured = bool(calibration.settings["load_measured"])
    load = rng.uniform(0.8, 1.2, n) if measured else 1 + 0.05 * rng.standard_normal(n)
    table = simulated.touch(rng.uniform(10, 29, (n, 1)), rng, load=load, measured=measured, samples=16)
    read = infer(table, calibration, draws=2400, seed=1, workers=1)
    assert set(read.posterior) == {"x", "P"}
    means, kernel = table.averaged(), Kernel(pad.flat("mode"))
    ratios, offs = [], []
    for t in range(n):
        draws = np.stack([read.posterior[name][..., t].ravel() for name in ("x", "P")], axis=1)
        axes = [m + s * np.linspace(-6, 6, 61) for m, s in zip(draws.mean(axis=0), draws.std(axis=0), strict=True)]
        x, p = (each.ravel() for each in np.meshgrid(*axes, indexing="ij"))
        if measured:
            # What the elements share is an error of the load: readings with a covariance, in terms of the true load.
            offset, scatter = pad.group("mode")["offset"], float(pad.group("noise")["load_scatter"])
            sensitivity = (kernel.readings(x, p) - offset) / p[:, None]
            covariance = pad.variance(x, p, 16)[:, :, None] * np.eye(M)
            covariance = covariance + scatter**2 * sensitivity[:, :, None] * sensitivity[:, None]
            miss = means.readings[t] - kernel.readings(x, p)
            squares = np.einsum("ni,ni->n", miss, np.linalg.solve(covariance, miss[:, :, None])[:, :, 0])
            log = -0.5 * (squares + np.linalg.slogdet(covariance)[1])
            log += stats.norm(means.load[t], float(pad.group("noise")["force_sd"]) / 4).logpdf(p)
        else:
            covariance = pad.covariance(x, p, 16)
            miss = (means.readings[t] - kernel.readings(x, p))[:, :, None]
            log = -0.5 * (miss * np.linalg.solve(covariance, miss)).sum(axis=(1, 2))
            log -= 0.5 * np.linalg.slogdet(covariance)[1]
            log += stats.norm(1.0, float(calibration.settings["load_sd"])).logpdf(p)
        weight = np.exp(log - log.max()) / np.exp(log - log.max()).sum()
        mean = np.array([weight @ x, weight @ p])
        sd = np.sqrt([weight @ (x - mean[0]) ** 2, weight @ (p - mean[1]) ** 2])
        ratios.append(draws.std(axis=0) / sd)
        offs.append((draws.mean(axis=0) - mean) / sd)
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1, atol=0.016)
    assert np.abs(offs).max() < 0.14


@pytest.mark.parametrize("use_load", [True, False])
def test_loads_of_touches_with_load_scatter(use_load: bool) -> None:
    """Mean and sd of location and true load, and their correlation, against sums over a dense grid."""
    simulated, rng = line(**SETTINGS), np.random.default_rng(5)
    load = rng.uniform(0.8, 1.2, 30)
    table = simulated.touch(np.linspace(6, 34, 30)[:, None], rng, load=load, measured=True)
    calibration = calibrate_pad(simulated.dataset(table), kernel="gaussian", empirical=False, draws=64)
    force, scatter = 0.04, 0.06
    calibration = replace(calibration, noise=replace(calibration.noise, force_sd=force, load_scatter=scatter))
    reader = PadReader.from_calibration(calibration)
    place, load = np.linspace(10, 29, 8), rng.uniform(0.8, 1.2, 8)
    touches = simulated.touch(place[:, None], rng, load=load, measured=True)
    read = infer(touches, calibration, draws=4000, seed=3, workers=1, use_load=use_load, check_sensor=False)
    for t in range(8):
        draws = np.stack([read.posterior[name][..., t].ravel() for name in ("x", "P")], axis=1)
        axes = [m + s * np.linspace(-6, 6, 81) for m, s in zip(draws.mean(axis=0), draws.std(axis=0), strict=True)]
        x, p = (each.ravel() for each in np.meshgrid(*axes, indexing="ij"))
        signal, variance = reader.predict(x[:, None], p, np.ones((len(x), M), dtype=np.int64))
        shared = scatter * signal / p[:, None]
        covariance = variance[:, :, None] * np.eye(M) + shared[:, :, None] * shared[:, None]
        miss = touches.readings[t] - reader.map.offset - signal
        squares = np.einsum("ni,ni->n", miss, np.linalg.solve(covariance, miss[:, :, None])[:, :, 0])
        log = -0.5 * (squares + np.linalg.slogdet(covariance)[1])
        about = (load[t], force) if use_load else (reader.load, reader.load_sd)
        weight = np.exp(log + stats.norm(*about).logpdf(p) - log.max())
        weight /= weight.sum()
        mean = np.array([weight @ x, weight @ p])
        off = np.stack([x, p], axis=1) - mean
        covariance = off.T @ (weight[:, None] * off)
        sd = np.sqrt(np.diag(covariance))
        # 4,000 draws, of which 2,000 are effective: 1.6 % of an sd, 0.022 of a mean and of a correlation
        np.testing.assert_allclose(draws.std(axis=0) / sd, 1, atol=0.065)
        assert np.abs((draws.mean(axis=0) - mean) / sd).max() < 0.09
        correlation = covariance[0, 1] / sd.prod()
        assert np.corrcoef(draws.T)[0, 1] == pytest.approx(correlation, abs=0.09)


def test_covariance_on_file_is_that_of_the_touches(pad: OnFile) -> None:
    """Information of the readings, written out, with the error of a load in common to the elements.

    The noise is that at the signal of the fit before the posterior: 1 % of a variance.
    """
    flat, settings = pad.flat("mode"), pad.calibration().settings
    slope = Kernel(flat).slopes(pad.place, pad.load)
    noise, signal = pad.group("noise"), Kernel(flat).readings(pad.place, pad.load) - pad.group("mode")["offset"]
    variance = noise["tactile_sd"] ** 2 / SAMPLES + noise["discrepancy_sd"] ** 2
    variance = variance + (float(noise["signal_share"]) * signal) ** 2
    force = np.hypot(float(noise["force_sd"]) / np.sqrt(SAMPLES), float(noise["load_scatter"])) / pad.load
    spread = force if settings["load_measured"] else np.full(len(pad.load), float(settings["load_sd"]))
    by_load = spread[:, None] * signal
    whole = variance[:, :, None] * np.eye(M) + by_load[:, :, None] * by_load[:, None, :]
    total = np.einsum("dnm,nmk,enk->de", slope, np.linalg.inv(whole), slope)
    size = np.abs(pad.readings - np.median(pad.readings, axis=0))
    amplitude = pad.readings.std(axis=0) if settings["load_measured"] else np.quantile(size, 0.995, axis=0)
    wide = np.concatenate([10 * amplitude, 3 * amplitude, np.full(M, 3.0)])
    total[np.arange(3 * M), np.arange(3 * M)] += wide**-2.0
    total[-1, -1] += 1 / (flat[-1] * np.log(2.0)) ** 2
    found, expected = pad.group("laplace")["covariance"], np.linalg.inv(total)
    ratio = np.trace(np.linalg.solve(expected, found)) / len(found)
    assert ratio == pytest.approx(1, abs=0.04)
    draws = pad.flat("posterior").reshape(-1, len(flat))
    # 8,000 draws, of which at least 3,000 are effective: each sd to 1.3 %. The posterior is normal but for terms of
    # second order in the uncertainty of the width, which is 2 %.
    assert pad.calibration().statistics["ess_bulk"] > 3000
    np.testing.assert_allclose(draws.std(axis=0) / np.sqrt(np.diag(found)), 1, atol=0.05)
    assert np.abs((draws.mean(axis=0) - flat) / draws.std(axis=0)).max() < 4.5 / np.sqrt(3000) + 0.05
