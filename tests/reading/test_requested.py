"""Groups of touches that are written on request: against likelihoods written out, and against the sampler's density."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import known_fingers as k
import numpy as np
import pytest
from pad_simulation import SimulatedPad, line
from scipy.stats import kstest, multivariate_normal, norm

import bayestouch
from bayestouch.errors import InputError
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.reading.touch_reader import FingerTouchReader
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.pad.reading.touch_reader import PadTouchReader
from bayestouch.reading import driver
from bayestouch.reading.options import Options
from bayestouch.results.reading import load_touches

DRAWS = 256
TOUCHES = k.known_touches(7, step=15.0)


@pytest.fixture(scope="module")
def calibration() -> bayestouch.Calibration:
    return bayestouch.calibrate(k.dataset(k.known_touches(1, step=4.0)), draws=200)


@pytest.fixture(scope="module")
def plugged_in(calibration: bayestouch.Calibration) -> bayestouch.TouchPosteriors:
    return read(calibration, plug_in=True)


@pytest.fixture(scope="module")
def propagated(calibration: bayestouch.Calibration) -> bayestouch.TouchPosteriors:
    return read(calibration)


def read(calibration: bayestouch.Calibration, **options: object) -> bayestouch.TouchPosteriors:
    return bayestouch.infer(TOUCHES, calibration, groups="all", draws=DRAWS, seed=2, **options)  # type: ignore[arg-type]


def predicted(calibration: bayestouch.Calibration, draws: dict[str, np.ndarray]) -> np.ndarray:
    """By the chain itself, no table, (chain, draw, t, m)."""
    return finger_chain(calibration).predict(draws["R"], np.radians(draws["theta_c"]), draws["P"])


def reading_sd(calibration: bayestouch.Calibration) -> np.ndarray:
    noise = calibration.noise
    return np.hypot(noise.tactile_sd / np.sqrt(k.SAMPLES), noise.discrepancy_sd)


def test_likelihood_of_readings_and_load_written_out(
    calibration: bayestouch.Calibration, plugged_in: bayestouch.TouchPosteriors
) -> None:
    """With the calibration as exact, readings are independent."""
    posterior, log = dict(plugged_in.posterior), plugged_in.groups["log_likelihood"]
    expected = norm(predicted(calibration, posterior), reading_sd(calibration)).logpdf(plugged_in.rows.observed)
    # the table's readings are good to 0.01 standard deviations, and residuals are three at most
    np.testing.assert_allclose(log["reading"], expected, atol=0.05)
    load = norm(posterior["P"], calibration.noise.force_sd / np.sqrt(k.SAMPLES)).logpdf(plugged_in.rows.load)
    np.testing.assert_allclose(log["load"], load, rtol=1e-9)
    np.testing.assert_allclose(log["whole_touch"], expected.sum(axis=-1) + load, atol=0.1)


def test_log_posterior_is_the_density_that_was_sampled(
    calibration: bayestouch.Calibration, propagated: bayestouch.TouchPosteriors
) -> None:
    """Up to a constant for each touch, in the sampler's own coordinates, with the uncertainty of the calibration."""
    reader = FingerTouchReader.from_calibration(calibration, Options())
    block = reader.ready(reader.average(TOUCHES))
    (group,) = reader.sampler.groups(reader.unknown(block), np.arange(block.n_touches))
    draws, outer = propagated.posterior, calibration.sensor.body.outer_radius_mm
    radius = draws["R"]
    w = np.log(radius / (outer - radius))
    x = np.stack([w, np.radians(draws["theta_c"]), draws["P"]], axis=-1)
    x = np.moveaxis(x, 2, 0).reshape(block.n_touches, -1, 3)
    sampled = group.log_density(x, np.arange(block.n_touches)).T.reshape(radius.shape)
    jacobian = np.log(radius * (outer - radius) / outer)
    difference = sampled - propagated.groups["sample_stats"]["lp"] - jacobian
    # float32 in the residuals, 1e-4 of a squared one
    assert np.ptp(difference, axis=(0, 1)).max() < 0.02
    prior = propagated.groups["log_prior"]
    np.testing.assert_allclose(prior["R"], -np.log(outer))
    np.testing.assert_allclose(
        propagated.groups["sample_stats"]["lp"],
        propagated.groups["log_likelihood"]["whole_touch"] + prior["R"] + prior["theta_c"] + prior["P"],
    )


def test_the_other_readings_of_a_touch_say_what_the_calibration_leaves_open(
    plugged_in: bayestouch.TouchPosteriors, propagated: bayestouch.TouchPosteriors
) -> None:
    """The sum of conditional densities is not the joint density where readings are correlated, and is where not."""
    for result, least, most in ((plugged_in, 0.0, 1e-3), (propagated, 1e-2, np.inf)):
        log = result.groups["log_likelihood"]
        apart = np.abs(log["reading"].sum(axis=-1) + log["load"] - log["whole_touch"]).max()
        assert least <= apart <= most


def test_predictions_have_the_noise_of_means(
    calibration: bayestouch.Calibration, plugged_in: bayestouch.TouchPosteriors
) -> None:
    load_sd = calibration.noise.force_sd / np.sqrt(k.SAMPLES)
    pairs = (("posterior_predictive", dict(plugged_in.posterior)), ("prior_predictive", plugged_in.groups["prior"]))
    for group, draws in pairs:
        made = plugged_in.groups[group]
        z = (made["reading"] - predicted(calibration, draws)) / reading_sd(calibration)
        # 19,712 numbers: 0.7 % of the mean, 0.5 % of the sd; the table adds 0.01 sd near, and the prior goes far
        assert np.mean(z) == pytest.approx(0, abs=0.04)
        assert np.std(z) == pytest.approx(1, abs=0.025)
        z = (made["load"] - draws["P"]) / load_sd
        assert np.mean(z) == pytest.approx(0, abs=0.08) and np.std(z) == pytest.approx(1, abs=0.05)


def test_draws_of_the_prior(plugged_in: bayestouch.TouchPosteriors) -> None:
    prior = plugged_in.groups["prior"]
    for parameter in plugged_in.parameters:
        low, high = parameter.prior.support
        assert kstest(prior[parameter.name].ravel(), "uniform", (low, high - low)).pvalue > 1e-4
    outer = 12.7
    np.testing.assert_allclose(1 / prior["R"], 1 / prior["r_c"] + 1 / outer, rtol=1e-9)
    # no touch has the draws of another
    assert len(np.unique(prior["R"])) == prior["R"].size


def test_groups_change_no_draw(calibration: bayestouch.Calibration, propagated: bayestouch.TouchPosteriors) -> None:
    without = bayestouch.infer(TOUCHES, calibration, draws=DRAWS, seed=2)
    assert without.groups == {}
    for name, draws in without.posterior.items():
        np.testing.assert_array_equal(draws, propagated.posterior[name])


def test_a_file_in_blocks_holds_the_same(
    calibration: bayestouch.Calibration,
    propagated: bayestouch.TouchPosteriors,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Blocks of four touches, in memory and on file; thinned draws are the same draws."""
    monkeypatch.setattr(driver, "BLOCK_UNIT", 4)
    monkeypatch.setattr(driver, "BLOCK_DRAWS", 4 * DRAWS)
    joined = read(calibration)
    read(calibration, output=tmp_path / "p.nc")
    grown = load_touches(tmp_path / "p.nc")
    for group, values in propagated.groups.items():
        for name, array in values.items():
            np.testing.assert_array_equal(joined.groups[group][name], grown.groups[group][name])
            # another grouping of touches rounds differently in the last bits of the draws
            np.testing.assert_allclose(joined.groups[group][name], array, rtol=1e-3, atol=1e-3)
    thin = bayestouch.infer(TOUCHES, calibration, groups="log_likelihood", draws=DRAWS, seed=2, thin=4)
    whole = propagated.groups["log_likelihood"]["whole_touch"]
    np.testing.assert_allclose(thin.groups["log_likelihood"]["whole_touch"], whole[:, ::4])


def test_without_draws_there_are_no_groups(calibration: bayestouch.Calibration) -> None:
    with pytest.raises(InputError, match=r"groups: .*no draw is kept"):
        bayestouch.infer(TOUCHES, calibration, groups="prior", summary_only=True)


@pytest.fixture(scope="module")
def pad() -> tuple[SimulatedPad, bayestouch.Calibration]:
    pad = line()
    touches = pad.touch(np.linspace(6, 34, 57)[:, None], np.random.default_rng(0), measured=True)
    return pad, calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=False, draws=8)


@pytest.mark.parametrize("use_load", [True, False])
def test_pads(pad: tuple[SimulatedPad, bayestouch.Calibration], use_load: bool) -> None:
    """Without load scatter, readings are independent, and likelihood and prior are the density that was sampled."""
    simulated, calibration = pad
    calibration = replace(calibration, noise=replace(calibration.noise, load_scatter=0.0))
    touches = simulated.touch(np.linspace(8, 30, 6)[:, None], np.random.default_rng(1), measured=True)
    options = {"use_load": use_load, "check_sensor": False}
    result = bayestouch.infer(touches, calibration, groups="all", draws=128, seed=2, **options)  # type: ignore[arg-type]
    reader = PadTouchReader.from_calibration(calibration, Options(use_load=use_load))
    known = reader.sampler.reader.touches(reader.ready(reader.average(touches)))
    x = np.stack([result.posterior["x"], result.posterior["P"]], axis=-1)
    flat = np.moveaxis(x, 2, 0).reshape(known.n_touches, -1, 2)
    sampled = reader.sampler.reader.log_density(known, flat, np.arange(known.n_touches)).T.reshape(x.shape[:3])
    lp, log = result.groups["sample_stats"]["lp"], result.groups["log_likelihood"]
    assert np.ptp(sampled - lp, axis=(0, 1)).max() < 1e-6
    parts = log["reading"].sum(axis=-1) + np.nan_to_num(log["load"])
    np.testing.assert_allclose(parts, log["whole_touch"], rtol=1e-5, atol=1e-3)
    assert np.isfinite(log["load"]).all() == use_load
    assert (result.groups["log_prior"]["P"] == 0).all() == use_load
    signal, variance = reader.sampler.reader.predict(x[..., :-1], x[..., -1], known.counts)
    expected = norm(calibration.mode["offset"] + signal, np.sqrt(variance)).logpdf(result.rows.observed)
    # the map's offset is the mode, to the last digits of the fit
    np.testing.assert_allclose(log["reading"], expected, atol=0.02)
    z = (result.groups["posterior_predictive"]["reading"] - calibration.mode["offset"] - signal) / np.sqrt(variance)
    # 3,072 numbers: 1.3 % of the sd
    assert np.std(z) == pytest.approx(1, abs=0.05)


def test_pads_with_load_scatter(pad: tuple[SimulatedPad, bayestouch.Calibration]) -> None:
    """Readings share an error of the load: a normal density with a covariance, and of each reading given the others."""
    simulated, calibration = pad
    scatter = 0.02
    calibration = replace(calibration, noise=replace(calibration.noise, load_scatter=scatter))
    touches = simulated.touch(np.linspace(8, 30, 3)[:, None], np.random.default_rng(1), measured=True)
    result = bayestouch.infer(touches, calibration, groups="all", draws=400, seed=2, check_sensor=False)
    reader = PadTouchReader.from_calibration(calibration, Options()).sampler.reader
    x = np.stack([result.posterior["x"], result.posterior["P"]], axis=-1)
    counts = np.ones((3, 4), dtype=np.int64)
    signal, variance = reader.predict(x[..., :-1], x[..., -1], counts)
    shared = scatter * signal / x[..., -1:]
    log = result.groups["log_likelihood"]
    for chain, draw, t in np.ndindex(1, 5, 3):
        at = (chain, draw, t)
        covariance = np.diag(variance[at]) + np.outer(shared[at], shared[at])
        off = result.rows.observed[t] - calibration.mode["offset"] - signal[at]
        whole = multivariate_normal(cov=covariance).logpdf(off)
        for e in range(4):
            rest = np.delete(np.arange(4), e)
            others = multivariate_normal(cov=covariance[np.ix_(rest, rest)]).logpdf(off[rest])
            assert log["reading"][(*at, e)] == pytest.approx(whole - others, abs=0.02)
        assert log["whole_touch"][at] - log["load"][at] == pytest.approx(whole, abs=0.02)
    replicated = result.groups["posterior_predictive"]["reading"] - calibration.mode["offset"] - signal
    for t in range(3):
        found = np.cov(replicated[:, :, t].reshape(-1, 4).T)
        here = variance[:, :, t].mean(axis=(0, 1)), shared[:, :, t].reshape(-1, 4)
        expected = np.diag(here[0]) + here[1].T @ here[1] / len(here[1])
        size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        # 400 draws: 5 % of a correlation, 7 % of a variance
        np.testing.assert_allclose(found / size, expected / size, atol=0.28)
