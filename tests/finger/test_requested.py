"""Groups of a finger's calibration that are written on request: against the likelihood, written out with scipy."""

from __future__ import annotations

from dataclasses import replace

import known_fingers as k
import numpy as np
import pytest
from scipy.stats import kstest, multivariate_normal

import bayestouch
from bayestouch.chain.finger import FingerChain
from bayestouch.contact import composite_radius
from bayestouch.data.averages import TouchMeans
from bayestouch.effects.stated import StatedModel
from bayestouch.errors import InputError
from bayestouch.finger.density import FingerDensity
from bayestouch.finger.fit import fit_finger
from bayestouch.finger.place.fit import fit_with_places
from bayestouch.finger.place.functions import PlaceFunctions, Process
from bayestouch.finger.priors import FingerPriors

KNOWN = k.known_touches(1, step=6.0)
DATA = k.dataset(KNOWN)


@pytest.fixture(scope="module")
def calibration() -> bayestouch.Calibration:
    return bayestouch.calibrate(DATA, draws=400, groups="all", seed=1)


def draw_of(calibration: bayestouch.Calibration, n: int) -> dict[str, np.ndarray]:
    return {name: draws.reshape(-1, *draws.shape[2:])[n] for name, draws in calibration.posterior.items()}


def predicted(draw: dict[str, np.ndarray], rows: bayestouch.TouchPosteriors, load: np.ndarray) -> np.ndarray:
    chain = FingerChain(
        core_radius_mm=9.4,
        outer_radius_mm=12.7,
        response=draw["response"],
        sensing_radius_mm=draw["r_s"],
        angle=np.radians(draw["theta_s"]),
        offset=np.zeros(len(k.ANGLES)),
        poisson_ratio=float(draw["sigma"]),
        shear_modulus_MPa=float(draw["mu"]),
        largest_load=300.0,
    )
    return chain.predict(composite_radius(rows.radius_mm, 12.7), np.radians(rows.location["theta_c"]), load)


def distribution(calibration: bayestouch.Calibration, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean (t, m) and covariance (t, m, m) of the touches' mean readings at one draw."""
    draw, rows = draw_of(calibration, n), calibration.rows
    mean = predicted(draw, rows, rows.load)
    slope = (predicted(draw, rows, 1.01 * rows.load) - predicted(draw, rows, 0.99 * rows.load)) / (
        0.02 * rows.load[:, None]
    )
    own = np.diag(draw["noise_sd"] ** 2 / k.SAMPLES + draw["discrepancy_sd"] ** 2)
    force = draw["force_noise_sd"] ** 2 / k.SAMPLES
    return mean, own + force * slope[:, :, None] * slope[:, None, :]


def test_likelihood_of_each_touch_written_out(calibration: bayestouch.Calibration) -> None:
    log = calibration.groups["log_likelihood"]["whole_touch"].reshape(400, -1)
    observed = calibration.rows.observed
    for n in (0, 137, 399):
        mean, covariance = distribution(calibration, n)
        expected = [multivariate_normal(*each).logpdf(y) for *each, y in zip(mean, covariance, observed, strict=True)]
        # the series of the fit errs by 1.5e-3, and the load adds 0.1 to the log determinant
        np.testing.assert_allclose(log[n], expected, atol=0.004)


def test_log_posterior_is_likelihood_scatter_and_prior(calibration: bayestouch.Calibration) -> None:
    """Up to a constant, in the coordinates that are drawn, where some are logarithms."""
    posterior, groups, means = calibration.posterior, calibration.groups, KNOWN.averaged()
    dof = means.pure_error_dof
    noise, force = posterior["noise_sd"], posterior["force_noise_sd"]
    scatter = -(dof * np.log(noise) + dof * means.pure_error_variance / (2 * noise**2)).sum(axis=-1)
    load_dof = means.load_error_dof
    scatter -= load_dof * np.log(force) + load_dof * means.load_error_variance / (2 * force**2)
    prior = sum(a.sum(axis=-1) if a.ndim == 3 else a for a in groups["log_prior"].values())
    share = posterior["discrepancy_sd"] / (noise / np.sqrt(k.SAMPLES))
    size = np.abs(posterior["response"])
    logs = [np.log(each).sum(axis=-1) for each in (noise, share, size)]
    jacobian = sum(logs) + np.log(force) + np.log(posterior["mu"])
    total = groups["log_likelihood"]["whole_touch"].sum(axis=-1) + scatter + prior + jacobian
    difference = groups["sample_stats"]["lp"] - total
    assert np.std(total) > 3
    assert np.ptp(difference) < 1e-6 * np.abs(groups["sample_stats"]["lp"]).max()


def test_replicated_readings_have_the_covariance(calibration: bayestouch.Calibration) -> None:
    again = calibration.groups["posterior_predictive"]["reading"].reshape(400, -1, len(k.ANGLES))
    white = []
    for n in range(0, 400, 8):
        mean, covariance = distribution(calibration, n)
        root = np.linalg.cholesky(covariance)
        white.append(np.linalg.solve(root, (again[n] - mean)[..., None])[..., 0])
    z = np.concatenate(white)
    # some thousand numbers: 1.5 % of the sd
    assert np.std(z) == pytest.approx(1, abs=0.05) and np.mean(z) == pytest.approx(0, abs=0.07)
    assert np.abs(np.corrcoef(z.T) - np.eye(len(k.ANGLES))).max() < 0.15


def test_draws_of_the_prior(calibration: bayestouch.Calibration) -> None:
    prior = calibration.groups["prior"]
    assert set(prior) == set(calibration.posterior)
    by_name = {parameter.name: parameter.prior for parameter in calibration.parameters}
    for name in ("sigma", "mu"):
        share = np.linspace(0.01, 0.99, 99)
        cumulative = np.interp(prior[name].ravel(), by_name[name].quantile(share), share, 0, 1)
        assert kstest(cumulative[(cumulative > 0) & (cumulative < 1)], "uniform", (0.01, 0.98)).pvalue > 1e-4
    assert np.isfinite(calibration.groups["prior_predictive"]["reading"]).all()


def test_groups_change_no_draw_and_the_log_posterior_is_always_there(calibration: bayestouch.Calibration) -> None:
    without = bayestouch.calibrate(DATA, draws=400, seed=1)
    assert list(without.groups) == ["sample_stats"]
    np.testing.assert_array_equal(without.groups["sample_stats"]["lp"], calibration.groups["sample_stats"]["lp"])
    np.testing.assert_array_equal(without.posterior["mu"], calibration.posterior["mu"])


def test_an_identified_map_has_no_groups() -> None:
    with pytest.raises(InputError, match=r"groups: .*identified E map"):
        bayestouch.calibrate(DATA, e_map="empirical", groups="log_likelihood")


def test_with_effects_there_are_likelihood_and_prior() -> None:
    """Crosstalk that is not there adds parameters and hardly changes how well touches are predicted."""
    model = StatedModel("finger", "layer", (("crosstalk", {}),))
    fit = bayestouch.calibrate(DATA, model=model, groups="log_likelihood,log_prior", draws=200)
    log, prior = fit.groups["log_likelihood"]["whole_touch"], fit.groups["log_prior"]
    assert log.shape == (4, 50, len(fit.rows.touch))
    effects = [parameter.name for parameter in fit.parameters if parameter.name.startswith("crosstalk")]
    assert effects and set(effects) <= set(prior)
    by_name = {parameter.name: parameter.prior for parameter in fit.parameters}
    np.testing.assert_allclose(prior["sigma"], by_name["sigma"].log_density(fit.posterior["sigma"]))
    # the sum over touches goes with the log posterior that was sampled
    rest = fit.groups["sample_stats"]["lp"] - log.sum(axis=-1)
    assert np.std(rest) < 3 * np.sqrt(fit.covariance.shape[0])


@pytest.mark.slow
def test_readings_are_simulated_with_effects(calibration: bayestouch.Calibration) -> None:
    """Crosstalk that is not there: readings scatter as without it, which is written out above."""
    model = StatedModel("finger", "layer", (("crosstalk", {}),))
    fit = bayestouch.calibrate(DATA, model=model, groups="all", draws=400, seed=1)
    assert set(fit.groups["prior"]) == set(fit.posterior)
    again, before = (each.groups["posterior_predictive"]["reading"] for each in (fit, calibration))
    assert again.shape == before.shape
    sd, sd_before = (each.reshape(400, -1).std(axis=0) for each in (again, before))
    # 400 draws give one sd to 4 %, and all together to 1 %.
    assert np.median(sd / sd_before) == pytest.approx(1, abs=0.03)
    apart = again.reshape(400, -1).mean(axis=0) - before.reshape(400, -1).mean(axis=0)
    assert np.sqrt(np.mean((apart / sd_before) ** 2)) < 0.3
    share = np.linspace(0.01, 0.99, 99)
    prior = next(parameter.prior for parameter in fit.parameters if parameter.name == "crosstalk_share")
    cumulative = np.interp(fit.groups["prior"]["crosstalk_share"].ravel(), prior.quantile(share), share, 0, 1)
    assert kstest(cumulative[(cumulative > 0) & (cumulative < 1)], "uniform", (0.01, 0.98)).pvalue > 1e-4
    assert np.isfinite(fit.groups["prior_predictive"]["reading"]).all()


def test_what_drifts_tie_together_has_no_likelihood_of_a_touch() -> None:
    model = StatedModel("finger", "layer", (("baseline_drift", {}),))
    with pytest.raises(InputError, match=r"groups: drifts and corrections .*log_prior and prior, no others"):
        bayestouch.calibrate(DATA, model=model, groups="posterior_predictive", draws=40)


def test_a_load_that_was_not_measured_is_that_of_the_readings() -> None:
    """Readings of such a touch are simulated about those that were read: with the density's mean and sd of the load."""
    fit, _ = fit_finger(_without_load(KNOWN.averaged(), 3), DATA.sensor.body, FingerPriors.of(DATA.sensor)[0])
    density = FingerDensity.of(fit)
    again = density.replicated(np.repeat(fit.vector[None], 600, axis=0), np.random.default_rng(1))
    mean, sd = density.true_loads(fit.vector[None])
    readings, slope = density.predict(fit.vector[None])
    known = fit.likelihood.known
    assert sd[0, 3] < 0.1 * known.load_sd(1.0)[3]
    own = fit.likelihood.standard_errors(fit.vector[None]).sd[0, 3]
    expected = np.sqrt(own**2 + (slope[0, 3] * sd[0, 3]) ** 2)
    # four standard errors of a mean and of an sd
    centre = readings[0, 3] + slope[0, 3] * (mean[0, 3] - known.load[3])
    np.testing.assert_allclose((again[:, 3].mean(axis=0) - centre) / expected, 0, atol=4 / np.sqrt(600))
    np.testing.assert_allclose(again[:, 3].std(axis=0), expected, rtol=4 / np.sqrt(1200))


def test_readings_of_the_prior_have_functions_of_place() -> None:
    """At one vector they scatter as functions with standard normal weights, beside which noise is small."""
    fit, _ = fit_finger(KNOWN.averaged(), DATA.sensor.body, FingerPriors.of(DATA.sensor)[0])
    with_places, _ = fit_with_places(fit, PlaceFunctions("map", Process(9.0, 0.1), Process(10.0, 0.3)))
    likelihood = with_places.likelihood
    assert likelihood.at_places is not None
    vectors = np.repeat(with_places.vector[None], 600, axis=0)
    again = FingerDensity(likelihood, likelihood.series).replicated(vectors, np.random.default_rng(2), from_prior=True)
    own = (likelihood.at_places.own**2).sum(axis=2).T + (likelihood.at_places.surface**2).sum(axis=2)
    wanted = np.sqrt(own + likelihood.standard_errors(vectors[:1]).sd[0] ** 2)
    large = own > 25 * likelihood.standard_errors(vectors[:1]).sd[0] ** 2
    assert large.sum() > 20
    # four standard errors of an sd, and the load
    np.testing.assert_allclose(again.std(axis=0)[large], wanted[large], rtol=4 / np.sqrt(1200) + 0.01)


def _without_load(means: TouchMeans, touch: int) -> TouchMeans:
    load = np.array(means.load)
    load[touch] = np.nan
    return replace(means, load=load)
