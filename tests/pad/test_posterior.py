"""Groups of a pad's calibration that are written on request, and its log posterior density."""

from __future__ import annotations

import numpy as np
import pytest
from pad_simulation import line
from scipy.stats import kstest, norm

import bayestouch
from bayestouch.effects.stated import StatedModel
from bayestouch.errors import InputError
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.priors.parameters import LogNormal

PREDICTIONS = ("prior_predictive", "posterior_predictive")
DESIGN = bayestouch.PadDesign(element_x_mm=(0.0, 5.0, 10.0), element_y_mm=None, samples_per_touch=8)


def test_log_posterior_is_likelihood_and_prior() -> None:
    """Without a map touches are independent: their densities and the priors add up to the density that was drawn."""
    pad = line()
    touches = pad.touch(np.linspace(6, 34, 29)[:, None], np.random.default_rng(0), measured=True)
    groups = ("log_likelihood", "log_prior")
    fit = calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=False, draws=64, groups=groups)
    log, prior = fit.groups["log_likelihood"]["whole_touch"], fit.groups["log_prior"]
    assert log.shape == (4, 16, 29) and set(prior) == set(fit.posterior)
    by_name = {parameter.name: parameter.prior for parameter in fit.parameters}
    jacobian = sum(
        np.log(draws).reshape(4, 16, -1).sum(axis=-1)
        for name, draws in fit.posterior.items()
        if isinstance(by_name[name], LogNormal)
    )
    total = log.sum(axis=-1) + sum(a.reshape(4, 16, -1).sum(axis=-1) for a in prior.values()) + jacobian
    difference = fit.groups["sample_stats"]["lp"] - total
    assert np.std(total) > 1 and np.ptp(difference) < 1e-6
    # readings of a touch at one draw, written out; the noise is that of the fit
    residual = np.abs(fit.rows.observed - fit.rows.predicted)
    typical = norm(0, fit.rows.sd).logpdf(residual).sum()
    assert log.sum(axis=-1).mean() == pytest.approx(typical, rel=0.1)


def test_simulated_readings_have_the_noise_and_the_errors_of_the_loads() -> None:
    """Without a map: about the prediction of each draw, the noise of the fit and the load's error times the signal."""
    pad = line()
    touches = pad.touch(np.linspace(6, 34, 29)[:, None], np.random.default_rng(0), measured=True)
    fit = calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=False, draws=2000, groups=PREDICTIONS)
    again = fit.groups["posterior_predictive"]["reading"].reshape(2000, 29, -1)
    draws = {name: each.reshape(2000, 1, *each.shape[2:]) for name, each in fit.posterior.items()}
    distance = touches.x_mm[:, None] - draws["x_s"]
    signal = draws["gain"] * np.exp(-(distance**2) / (2 * draws["w"][..., None] ** 2)) * touches.load[:, None]
    about = again - draws["offset"] - signal
    by_load = fit.noise.force_sd * signal / touches.load[:, None]
    wanted = fit.noise.mean_sd(fit.rows.counts, signal) ** 2 + by_load**2
    # A variance of 2000 draws is known to 3 %: four standard errors, with 100 readings.
    assert (about.var(axis=0) / wanted.mean(axis=0)) == pytest.approx(np.ones(about.shape[1:]), abs=0.14)
    assert about.var(axis=0).sum() == pytest.approx(wanted.mean(axis=0).sum(), rel=0.03)


def test_simulated_readings_have_the_map_that_the_readings_show() -> None:
    """With a map: about the readings, with little more than their noise. Before any reading the map is unknown."""
    pad = line()
    touches = pad.touch(np.linspace(6, 34, 29)[:, None], np.random.default_rng(0), measured=True)
    shown = touches.with_(readings=touches.readings + 0.2 * np.sin(touches.x_mm)[:, None] * touches.readings)
    fit = calibrate_pad(pad.dataset(shown), kernel="gaussian", empirical=True, draws=800, groups=PREDICTIONS)
    again = fit.groups["posterior_predictive"]["reading"].reshape(800, 29, -1)
    mean, sd = again.mean(axis=0), again.std(axis=0)
    assert np.sqrt(np.mean(((fit.rows.observed - mean) / sd) ** 2)) < 1
    noise = np.hypot(fit.noise.mean_sd(fit.rows.counts, mean), fit.noise.force_sd * mean / touches.load[:, None])
    assert 0.97 < np.median(sd / noise) < 1.5
    before = fit.groups["prior_predictive"]["reading"]
    assert np.isfinite(before).all() and (before.reshape(800, 29, -1).std(axis=0) > 3 * sd).all()


def test_draws_of_the_prior() -> None:
    pad = line()
    touches = pad.touch(np.linspace(6, 34, 29)[:, None], np.random.default_rng(0), measured=True)
    fit = calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=False, draws=400, groups=("prior",))
    by_name = {parameter.name: parameter.prior for parameter in fit.parameters}
    assert set(fit.groups["prior"]) == set(fit.posterior)
    share = np.linspace(0.01, 0.99, 99)
    for name in ("gain", "offset", "w"):
        drawn = fit.groups["prior"][name]
        cumulative = np.interp(drawn.ravel(), by_name[name].quantile(share), share, 0, 1)
        assert kstest(cumulative[(cumulative > 0) & (cumulative < 1)], "uniform", (0.01, 0.98)).pvalue > 1e-4


def test_a_pad_with_effects_has_the_groups_without_simulated_readings() -> None:
    made = bayestouch.simulate(DESIGN, effects={"creep": 0.1}, seed=2).dataset
    stated = StatedModel("pad", "", (("creep", {}),))
    fit = bayestouch.calibrate(made, model=stated, draws=40, groups=("log_likelihood", "log_prior", "prior"))
    assert fit.groups["log_likelihood"]["whole_touch"].shape == (4, 10, len(fit.rows.touch))
    assert set(fit.groups["prior"]) == set(fit.groups["log_prior"]) == set(fit.posterior)
    with pytest.raises(InputError, match="groups: a calibration of a pad with effects has corrected readings"):
        bayestouch.calibrate(made, model=stated, draws=40, groups="all")
