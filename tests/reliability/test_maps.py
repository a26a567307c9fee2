"""What can be told apart, and where a finger can be trusted, before it is touched."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import dblquad

from bayestouch import InputError, calibrate, reliability, simulate
from bayestouch.body.finger import radial_strain_response
from bayestouch.contact import composite_radius, contact_model
from bayestouch.reliability import (
    Annulus,
    KnownFinger,
    RadiusScale,
    TouchPlaces,
    distinguished,
    expected_finger,
    log_evidence,
    smallest_radius,
    strain_difference,
    threshold_radii,
    tolerable_noise,
    trial,
)
from bayestouch.simulation import FingerDesign

FINGER = Annulus(9.4 / 12.7, 9.9 / 12.7)
DESIGN = FingerDesign(
    shear_modulus_MPa=0.12, samples_per_touch=3, edge_step_deg=3.0, flat_step_deg=6.0, noise_percent_peak=2.0
)


@pytest.fixture(scope="module")
def known() -> KnownFinger:
    """The paper's finger with few calibration touches."""
    return expected_finger(DESIGN, seed=1)


def test_strain_difference_is_the_sum_over_modes() -> None:
    """Over the whole circumference the mean square is Parseval's sum; the profile there is a sum over angles."""
    modes = np.arange(1, 121)
    outer, load = 12.7, 0.2 / FINGER.shear_modulus_MPa
    spectra = contact_model("layer", (9.4, outer), 0.46).spectrum(
        load * composite_radius(np.array([0.0, 3.9]), outer), np.concatenate([[0], modes])
    )
    response = radial_strain_response(
        np.concatenate([[0], modes]), 9.9, core_radius_mm=9.4, outer_radius_mm=outer, poisson_ratio=0.46
    )
    peak = (response[0] + 2 * response[1:].sum()) ** 2
    difference = response[1:] * (spectra[1] - spectra[0])[1:]
    expected = np.sqrt(2 * (difference**2).sum() / peak)
    # the profile ends at the mode that has 1e-7 of the surface's amplitude left; the peak sums some of those
    assert strain_difference(FINGER, [3.9])[0] == pytest.approx(expected, rel=1e-5)


def test_thresholds_of_the_paper_invert_each_other() -> None:
    """At the noise that just tells a tip from an edge, that tip is the sharpest told; blunter tips differ more."""
    noise = tolerable_noise(FINGER, indenter_radius_mm=6.01, span_deg=50.0)
    # linear interpolation between 97 radii
    assert smallest_radius(FINGER, noise, span_deg=50.0) == pytest.approx(6.01, rel=2e-3)
    assert np.all(np.diff(strain_difference(FINGER, [0.5, 3.9, 12.3, np.inf])) > 0)
    assert smallest_radius(FINGER, 0.5) == np.inf


def test_impossible_fingers_are_refused() -> None:
    with pytest.raises(InputError, match="in order"):
        Annulus(0.8, 0.7)
    with pytest.raises(InputError, match="span_deg"):
        strain_difference(FINGER, [1.0], span_deg=400)
    for noise in (-0.01, np.nan):
        with pytest.raises(InputError, match="noise: expected zero or more"):
            smallest_radius(FINGER, noise)


def test_expected_calibration_is_the_one_found() -> None:
    """The covariance worked out at the truth is that of a calibration from data.

    Draws (1000 of a chain that accepts most) give sds to 5 %; noise estimated from 2 degrees of freedom a touch and
    true loads from 160 to 240 N/m move them by a few per cent more.
    """
    simulated = simulate(DESIGN, seed=1)
    found = calibrate(simulated.dataset, draws=1000)
    errors = expected_finger(DESIGN, seed=1).errors
    assert isinstance(errors, reliability.known_finger.ElasticErrors)
    ratio = np.sqrt(np.diag(found.covariance) / np.diag(errors.parameters))
    assert np.all(np.abs(ratio - 1) < 0.3)
    assert np.median(ratio) == pytest.approx(1, abs=0.08)


def test_drawn_calibrations_have_the_covariance(known: KnownFinger) -> None:
    """Errors of readings drawn with the calibration have the covariance that goes into the likelihood."""
    places = TouchPlaces(np.array([0.0, 5.0]), np.radians([3.0, -10.0]), np.array([200.0, 180.0]))
    assert known.errors is not None
    drawn = known.errors.draw(places, 4000, np.random.default_rng(0))
    covariance = known.errors.covariance(places)
    found = np.einsum("nti,ntj->tij", drawn, drawn) / len(drawn)
    scale = np.sqrt(np.einsum("tii->ti", covariance))
    # correlations from 4000 draws are off by 1/sqrt(4000) = 0.016; five of those
    assert np.abs((found - covariance) / (scale[:, :, None] * scale[:, None])).max() < 0.08


def test_evidence_is_the_integral_over_location_and_load(known: KnownFinger) -> None:
    """Laplace's integral against quadrature, for a touch by a tip: odds of its neighbours."""
    exact = replace(known, errors=None)
    place = TouchPlaces(np.array([4.0]), np.radians([2.0]), np.array([200.0]))
    rng = np.random.default_rng(5)
    noise = np.sqrt(exact.noise_variance(1))
    reading = exact.predict(place) + noise * rng.standard_normal((1, exact.n_elements))
    radii = (3.0, 6.0)

    def integral(radius: float) -> float:
        def density(load: float, angle: float) -> float:
            misfit = (exact.chain.predict(radius, angle, load) - reading[0]) / noise
            return float(np.exp(-0.5 * (misfit @ misfit) + 10))

        middle = np.radians(2.0)
        return float(dblquad(density, middle - 0.02, middle + 0.02, 120.0, 280.0, epsrel=1e-4)[0])

    quadrature = np.log(integral(radii[1]) / integral(radii[0]))
    laplace = log_evidence(exact, reading, radii)
    # the integrand is not quite normal: 0.02 of a log odds is 0.5 % of a probability at most
    assert laplace[0, 1] - laplace[0, 0] == pytest.approx(quadrature, abs=0.02)


@pytest.mark.parametrize(("samples", "use_load"), [(1, False), (1, True)])
def test_trial_agrees_with_information(known: KnownFinger, samples: int, use_load: bool) -> None:
    """Error rates of posterior odds are those of the scale u(R), with calibrations drawn from their posterior."""
    tips = [0.0, 3.9, 12.3]
    found = trial(known, tips, [2.2], touches=250, samples=samples, use_load=use_load)
    expected = distinguished(known, tips, [2.2], samples=samples, use_load=use_load)[0]
    error = np.sqrt(np.maximum(expected * (1 - expected), 1e-3) / 500)
    # four standard errors: three independent pairs
    assert np.all(np.abs(found.distinguished - expected) < 4 * error)
    assert 0.6 < expected[0, 1] < 0.9999


def test_odds_are_calibrated(known: KnownFinger) -> None:
    """Where the posterior says p, a share p is right: the mean of p of the truth is that of the sum of squares."""
    found = trial(known, [0.0, 1.59, 3.9, 6.01], [0.0, 4.4], touches=300, seed=3)
    p = found.probability
    of_truth = p[np.arange(4), :, np.arange(4)]
    difference = of_truth - (p**2).sum(axis=-1)
    assert abs(difference.mean()) < 4 * difference.std() / np.sqrt(difference.size)
    assert found.named.sum(axis=1) == pytest.approx(1)
    alarms, hits = found.roc(0, 2)
    assert alarms[-1] == hits[-1] == 1
    assert np.all(np.diff(hits) >= 0)
    # the area is the chance that of a pair the odds order both rightly
    first, second = found.log_odds(0, 2)
    assert found.area(0, 2) == pytest.approx(np.mean(second[:, None] > first), abs=1e-9)


def test_thresholds_are_told_apart_with_their_probability(known: KnownFinger) -> None:
    """And averages, force sensors and a place above an element help, calibrations that are unknown do not."""
    places = [0.0, 2.0, 4.4]
    radius = threshold_radii(known, places, probability=0.95)
    for place, r_c in zip(places, radius, strict=True):
        # linear interpolation in both directions
        assert distinguished(known, [0.0, float(r_c)], [place])[0, 0, 1] == pytest.approx(0.95, abs=1e-6)
    assert np.all(threshold_radii(known, places, samples=20) < radius)
    assert np.all(threshold_radii(known, places, use_load=False) > radius)
    assert np.all(threshold_radii(replace(known, errors=None), places) < radius)


def test_truncated_posteriors_of_the_radius() -> None:
    """On a scale in proportion to R posteriors are truncated normals, whose moments scipy knows."""
    outer, sd = 12.7, 1.5
    radius = np.linspace(0, outer, 49)
    scale = RadiusScale(outer, np.zeros(1), radius, (radius / sd)[None])
    mean, scatter, posterior_sd = scale.estimates(1.0)
    noise = 1.0 + sd * stats.norm.ppf((np.arange(2000) + 0.5) / 2000)
    exact = stats.truncnorm(-noise / sd, (outer - noise) / sd, loc=noise, scale=sd)
    # 2000 quantiles of the noise against 21 Gauss-Hermite nodes
    assert mean[0] == pytest.approx(exact.mean().mean(), rel=2e-3)
    assert scatter[0] == pytest.approx(exact.mean().std(), rel=5e-3)
    assert posterior_sd[0] == pytest.approx(np.sqrt(exact.var().mean()), rel=2e-3)
    assert mean[0] > 1.0


def test_reliability_is_of_fingers() -> None:
    assert "distinguished" in dir(reliability)
    with pytest.raises(AttributeError):
        _ = reliability.nothing
