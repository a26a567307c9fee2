"""Radii of touches on a finger whose shear modulus is that of its prior."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from known_fingers import FORCE_NOISE, NOISE, dataset, known_touches, true_chain
from scipy import stats
from touch_quadrature import OneTouch, integrate

import bayestouch
from bayestouch.chain.neighbours import calibration_jacobian
from bayestouch.data.touches import Touches, touches_from
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.reading.covariance import reading_covariance
from bayestouch.finger.reading.modulus import LINEAR_ENOUGH, SCORES, RadiusOverModulus
from bayestouch.priors.indenters import KnownTips
from bayestouch.priors.parameters import LogNormal, Normal, Parameter, Uniform

OUTER, FACTOR = 12.7, float(np.log(1.35))
# Radius (mm) and location (degree) of touches with four samples.
CASES = [(2.0, 0.0), (5.0, 4.4), (9.0, -8.8)]


def over_modulus(spread: float, prior: Uniform | Normal | None = None) -> RadiusOverModulus:
    """Of a modulus with median 0.15 MPa, read with 0.12 MPa."""
    modulus = LogNormal(0.15, spread)
    found = RadiusOverModulus.of(
        prior or Uniform(0.0, OUTER),
        (Parameter("mu", "μ", r"\mu", "MPa", modulus, ""),),
        {"mu": modulus.quantile((np.arange(4000) + 0.5) / 4000).reshape(4, -1)},
        0.12,
    )
    assert found is not None
    return found


@pytest.mark.parametrize("spread", [0.1, FACTOR, float(np.log(3.0))])
def test_a_level_prior_of_r_divided_by_a_log_normal_modulus(spread: float) -> None:
    """With R = R' q: p(R') = E[q; q < r_b/R']/r_b, and q given R' is log-normal, too, and cut off there."""
    prior = over_modulus(spread)
    middle = np.log(0.15 / 0.12)
    inside = np.geomspace(0.02, OUTER * 0.12 / 0.15 * np.exp(2.5 * spread), 4000)
    ends = (np.log(OUTER / inside) - middle - spread**2) / spread
    expected = np.exp(middle + 0.5 * spread**2) * stats.norm.cdf(ends) / OUTER
    # The values of the modulus end at 3.5 sd: their mean is 1 % smaller where the modulus is known to a factor of 3.
    np.testing.assert_allclose(np.exp(prior.log_density(inside)), expected, rtol=0.03, atol=1e-4)
    levels = np.linspace(0.05, 0.95, 19)
    below = np.concatenate([[0.0], np.cumsum(0.5 * (expected[1:] + expected[:-1]) * np.diff(inside))])
    below += expected[0] * inside[0]
    np.testing.assert_allclose(prior.quantile(levels), np.interp(levels, below, inside), rtol=0.015)
    inside, ends = inside[ends > -2][::100], ends[ends > -2][::100]
    radii = prior.radii(inside)
    for level in levels[levels < 0.8]:  # beyond, the last value of a wide modulus shows
        score = stats.norm.ppf(level * stats.norm.cdf(ends))
        exact = inside * np.exp(middle + spread**2 + spread * score)
        at = [np.interp(stats.norm.ppf(level), SCORES, row) for row in radii]
        np.testing.assert_allclose(at, exact, rtol=0.04 * spread)


def test_draws_of_r_are_the_prior_of_r_again() -> None:
    """Draws of R' from its prior, each times a modulus, are draws of the prior of R: here no uniform one."""
    prior = over_modulus(FACTOR, Normal(4.0, 1.0, 0.0, OUTER))
    uniform = (np.arange(40000) + 0.5) / 40000
    drawn = prior.quantile(np.random.default_rng(1).permutation(uniform)).reshape(4, -1, 1)
    radius = prior.radius(drawn)
    assert radius.mean() == pytest.approx(4.0, abs=0.02)
    assert radius.std() == pytest.approx(1.0, rel=0.02)


def test_only_a_modulus_that_is_hardly_known_is_a_mixture() -> None:
    levels = (np.arange(4000) + 0.5) / 4000

    def of(spread: float, found: float, prior: object = Uniform(0.0, OUTER)) -> RadiusOverModulus | None:
        parameters = (Parameter("mu", "μ", r"\mu", "MPa", LogNormal(0.15, spread), ""),)
        draws = {"mu": LogNormal(0.15, found).quantile(levels)}
        return RadiusOverModulus.of(prior, parameters, draws, 0.15)  # type: ignore[arg-type]

    assert of(0.3, 0.3) is not None
    assert of(0.3, 0.2) is None  # the touches say something of it
    assert of(0.9 * LINEAR_ENOUGH, 0.9 * LINEAR_ENOUGH) is None
    assert of(0.3, 0.3, KnownTips((0.0, 3.0)).radius_prior(OUTER)) is None


@cache
def calibration() -> bayestouch.Calibration:
    """A finger calibrated with edges; draws of the modulus are quantiles of its prior, so that they do not scatter."""
    touches = known_touches(1, step=6.0)
    found = bayestouch.calibrate(
        dataset(touches.select(touches.indenter_radius_mm == 0)), discrepancy="touch", draws=2000, seed=1
    )
    shape = found.posterior["mu"].shape
    levels = (np.arange(np.prod(shape)) + 0.5) / np.prod(shape)
    return replace(found, posterior={**found.posterior, "mu": LogNormal(0.15, FACTOR).quantile(levels).reshape(shape)})


@cache
def touches() -> Touches:
    rng, chain = np.random.default_rng(6), true_chain()
    clean = np.repeat([chain.predict(radius, np.radians(angle), 200.0) for radius, angle in CASES], 4, axis=0)
    return touches_from(
        touch=np.repeat(np.arange(len(CASES)), 4),
        readings=clean + NOISE * rng.standard_normal(clean.shape),
        load=200.0 + FORCE_NOISE * rng.standard_normal(len(clean)),
    )


@cache
def mixture(number: int) -> np.ndarray:
    """Mean, sd, 5 and 95 % quantile of R by dense quadrature for each of 25 moduli, with the weights of the prior.

    The covariance of the rest of the calibration is that at the peak for one modulus.
    """
    rows = touches().touch == number
    means, load = touches().readings[rows].mean(axis=0), float(touches().load[rows].mean())
    score, weight = np.polynomial.legendre.leggauss(25)
    score, weight = 4 * score, weight * stats.norm.pdf(4 * score)
    covariance = calibration().covariance.copy()
    covariance[-1] = covariance[:, -1] = 0.0
    peak = integrate(OneTouch.of(calibration(), means, 4, load)).peak
    jacobian = calibration_jacobian(finger_chain(calibration()), *np.array(peak)[:, None])
    touch = OneTouch.of(calibration(), means, 4, load, reading_covariance(jacobian, covariance)[0])
    parts, evidence = [], []
    for one in 0.15 * np.exp(FACTOR * score):
        found = integrate(replace(touch, chain=finger_chain(calibration()).with_(shear_modulus_MPa=one)))
        parts.append(found.statistics["R"][:2])
        evidence.append(found.log_evidence)
    weight = weight * np.exp(np.array(evidence) - max(evidence))
    weight, (mean, sd) = weight / weight.sum(), np.array(parts).T
    centre = weight @ mean
    grid = np.linspace(0.0, OUTER, 5001)
    below = stats.norm.cdf(grid[:, None], mean, sd) @ weight
    return np.array([centre, np.sqrt(weight @ (sd**2 + mean**2) - centre**2), *np.interp([0.05, 0.95], below, grid)])


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("method", ["emcee", "importance"])
def test_radii_are_a_mixture_over_the_modulus(number: int, method: str) -> None:
    read = bayestouch.infer(touches(), calibration(), draws=1 << 14, seed=1, method=method, check_sensor=False)
    mean, sd, *ends = mixture(number)
    draws = read.posterior["R"][:, :, number].ravel()
    assert draws.mean() == pytest.approx(mean, abs=0.04 * sd)
    assert draws.std() == pytest.approx(sd, rel=0.03)
    np.testing.assert_allclose(np.quantile(draws, [0.05, 0.95]), ends, rtol=0, atol=0.05 * sd)


def test_radii_are_as_skewed_as_the_modulus() -> None:
    """Far from edge and flat the logarithm of R is normal: with a level prior its mean is the sd squared higher."""
    known = bayestouch.infer(touches(), calibration(), plug_in=True, draws=4096, seed=1, check_sensor=False)
    read = bayestouch.infer(touches(), calibration(), draws=4096, seed=1, check_sensor=False)
    log, plugged = (np.log(each.posterior["R"][:, :, 0].ravel()) for each in (read, known))
    spread = np.hypot(FACTOR, plugged.std())
    assert log.std() == pytest.approx(spread, rel=0.05)
    middle = np.median(plugged) - np.log(calibration().mode["mu"] / 0.15) + FACTOR**2
    np.testing.assert_allclose(
        np.quantile(log, [0.05, 0.5, 0.95]), middle + spread * stats.norm.ppf([0.05, 0.5, 0.95]), atol=0.03
    )


def test_a_live_reader_has_the_same_radii() -> None:
    read = bayestouch.infer(touches(), calibration(), draws=8192, seed=1, check_sensor=False)
    reader = bayestouch.Reader(calibration())
    for number in range(len(CASES)):
        reader.new_touch()
        for row in np.flatnonzero(touches().touch == number):
            live = reader.update(touches().readings[row], touches().load[row])
        draws = read.posterior["R"][:, :, number].ravel()
        sd = draws.std()
        assert live.mean[0] == pytest.approx(draws.mean(), abs=0.05 * sd)
        assert live.sd[0] == pytest.approx(sd, rel=0.03)
        np.testing.assert_allclose(live.quantiles[0], np.quantile(draws, [0.05, 0.5, 0.95]), rtol=0, atol=0.06 * sd)


def test_readings_are_predicted_with_the_radius_that_was_read() -> None:
    """A mean of R is that of another modulus than the one with which readings are predicted."""
    read = bayestouch.infer(touches(), calibration(), draws=1024, seed=1, check_sensor=False)
    off = (read.rows.predicted - read.rows.observed) / read.rows.sd
    assert np.sqrt((off**2).mean()) < 1.3
