"""Draws of a pad with drifts against quadrature, and what calibrations say of them."""

from __future__ import annotations

import numpy as np
import pytest
from drifting_pad import BASELINE, LOAD_SD, SD, SIZE, M, fitted_pad, matern, pad_of
from scipy.stats import halfnorm, norm

import bayestouch
from bayestouch.chain.kernels import ConstantKernel
from bayestouch.effects.stated import StatedModel
from bayestouch.model.added import AddedEffect
from bayestouch.model.drift_posterior import settled_drifts
from bayestouch.model.fitting import Fitted
from bayestouch.pad.density import PadDensity
from bayestouch.pad.posterior import PadPosterior
from bayestouch.pad.posterior_map import PadPosteriorMap
from bayestouch.pad.sampling import sample_density


@pytest.fixture(scope="module")
def flat() -> tuple[Fitted, list[AddedEffect]]:
    """Elements that respond alike to a touch anywhere, so that readings are linear in all parameters."""
    fitted, sd = settled_drifts(fitted_pad(pad_of(24, ConstantKernel()), (BASELINE, (0.02, 50.0))))
    return fitted, [AddedEffect(drift, values, sd[drift.name]) for drift, values in fitted.drifts]


def moments_written_out(fitted: Fitted) -> tuple[np.ndarray, np.ndarray]:
    """Means and sds of log size and log time by sums over a grid, with gains and offsets integrated out."""
    model, known = fitted.model, fitted.model.known
    there = np.isfinite(known.means.readings).ravel()
    one = np.ones((known.n_touches, 1))
    load = np.kron(known.load[:, None] * one, np.diag([60.0, 60.0]))
    fixed = load @ load.T + 400.0 * np.kron(one @ one.T, np.eye(M))
    gain = np.array([5.0, 7.0])
    fixed += np.kron(np.eye(known.n_touches), np.diag(SD**2) + LOAD_SD**2 * np.outer(gain, gain))
    late = known.touch_time_s >= 60.0
    sizes, times = np.linspace(-9.0, -0.5, 60), np.linspace(-2.0, 9.5, 60)
    log = np.empty((60, 60))
    readings = known.means.readings.ravel()[there]
    for j, time in enumerate(np.exp(times)):
        course = np.kron(matern(known.touch_time_s, time) * (late[:, None] == late), np.diag(model.peak**2))
        covariance = (fixed + np.exp(2 * sizes)[:, None, None] * course)[:, there][:, :, there]
        root = np.linalg.cholesky(covariance)
        z = np.linalg.solve(root, np.broadcast_to(readings[:, None], (60, len(readings), 1)))[..., 0]
        log[:, j] = -0.5 * (z**2).sum(axis=1) - np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
    log += (halfnorm(0, SIZE).logpdf(np.exp(sizes)) + sizes)[:, None] + norm(np.log(60), 1.2).logpdf(times)
    mass = np.exp(log - log.max())
    mass /= mass.sum()
    mean = np.array([mass.sum(axis=1) @ sizes, mass.sum(axis=0) @ times])
    squares = np.array([mass.sum(axis=1) @ (sizes - mean[0]) ** 2, mass.sum(axis=0) @ (times - mean[1]) ** 2])
    return mean, np.sqrt(squares)


@pytest.mark.slow
def test_draws_of_size_and_time_against_quadrature(flat: tuple[Fitted, list[AddedEffect]]) -> None:
    """The sd of 1,500 effective draws is good to 1.8 %; three of these are 5 %."""
    fitted, added = flat
    drawn = sample_density(PadDensity.of(fitted, added), 4000, seed=5)
    assert drawn.rhat.max() < 1.01 and drawn.ess_bulk.min() > 1500
    mean, sd = moments_written_out(fitted)
    draws = drawn.draws[:, :, 0, -2:].reshape(-1, 2)
    np.testing.assert_allclose(draws.std(axis=0), sd, rtol=0.05)
    np.testing.assert_allclose((draws.mean(axis=0) - mean) / sd, 0, atol=4 / np.sqrt(1500))


def test_posterior_has_the_drift_by_name(flat: tuple[Fitted, list[AddedEffect]]) -> None:
    """Drawn together with the other parameters; the value of another noise effect is drawn as before."""
    fitted, added = flat
    posterior = PadPosterior.of(PadDensity.of(fitted, added), 64, 0, added=added)
    names = ("baseline_drift_sd", "baseline_drift_time")
    assert posterior.layout[-2:] == names and set(names) <= set(posterior.draws)
    assert posterior.covariance.shape == (8, 8) and posterior.draws[names[0]].shape == (4, 16)
    for i, name in enumerate(names):
        assert float(posterior.mode[name]) == pytest.approx(added[0].values[i])
        assert posterior.covariance[6 + i, 6 + i] == pytest.approx(added[0].sd[i] ** 2)
        assert (posterior.draws[name] > 0).all()


def test_change_of_variables_with_drifts(flat: tuple[Fitted, list[AddedEffect]]) -> None:
    """Log density less that of the variables is nearly flat where the shared entries are, and so is its derivative."""
    fitted, added = flat
    density = PadDensity.of(fitted, added)
    to_vectors = PadPosteriorMap.of(density, seed=0)
    points = np.random.default_rng(2).standard_normal((300, len(density.priors)))
    for point, log_derivative in zip(points[:3], to_vectors(points[:3])[1], strict=True):
        steps = 1e-5 * np.eye(len(point))
        jacobian = (to_vectors(point + steps)[0] - to_vectors(point - steps)[0]) / 2e-5
        assert log_derivative == pytest.approx(np.linalg.slogdet(jacobian)[1], abs=1e-4)
    vectors, log_derivative = to_vectors(points)
    log_weight = density(vectors) + log_derivative + 0.5 * (points**2).sum(axis=1)
    weight = np.exp(log_weight - log_weight.max())
    # Importance weights: at least a quarter of the points count.
    assert weight.sum() ** 2 / (weight**2).sum() > 0.25 * len(points)


def test_log_density_of_a_calibration_is_that_of_its_draws() -> None:
    """By the names of the draws, up to a constant."""
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 5.0), element_y_mm=None, samples_per_touch=4, calibration_step_mm=1.0, n_touches=2
    )
    dataset = bayestouch.simulate(design, effects={"baseline_drift": 0.02}, seed=2).dataset
    model = StatedModel("pad", "", (("baseline_drift", {}),))
    calibration = bayestouch.calibrate(dataset, model=model, kernel="gaussian", draws=64)
    density = bayestouch.log_density(calibration, dataset)
    drawn = {name: values.reshape(-1, *values.shape[2:]) for name, values in calibration.posterior.items()}
    assert density.names[-2:] == ("log baseline_drift_sd", "log baseline_drift_time")
    found = density(density.from_parameters(drawn))
    stated = calibration.groups["sample_stats"]["lp"].ravel()
    assert np.ptp(stated) > 3
    np.testing.assert_allclose(found - found[0], stated - stated[0], atol=1e-6)
