"""The change of variables that emcee's proposals for a pad are made in."""

from __future__ import annotations

import numpy as np
import pytest
from pad_simulation import grid, square
from scipy.stats import truncnorm

from bayestouch.chain.kernels import HalfSpaceKernel, length_prior
from bayestouch.pad.candidates import fit_kernel
from bayestouch.pad.density import PadDensity
from bayestouch.pad.posterior_map import BoundedNormal, PadPosteriorMap
from bayestouch.pad.problem import pad_problem
from bayestouch.pad.start import fit_without_effects

COVARIANCE = np.array([[0.04, 0.03, 0.0], [0.03, 0.09, 0.01], [0.0, 0.01, 0.01]])


def test_a_normal_that_one_bound_cuts_off() -> None:
    """The cut-off entry is truncated normal, and the others are normal given it; a mean two sd beyond the bound."""
    bounds = (np.full(3, -np.inf), np.array([np.inf, 0.5, np.inf]))
    mean = np.array([1.0, 1.1, -2.0])
    to_vectors = BoundedNormal.of(mean, COVARIANCE, bounds)
    points = np.random.default_rng(0).standard_normal((40_000, 3))
    vectors, _ = to_vectors(points)
    expected = truncnorm(-np.inf, (0.5 - 1.1) / 0.3, 1.1, 0.3)
    # 40,000 draws: an sd to 0.35 %, and a mean to 0.5 % of it; four of these.
    assert vectors[:, 1].max() < 0.5
    assert vectors[:, 1].std() == pytest.approx(expected.std(), rel=0.03)
    assert vectors[:, 1].mean() == pytest.approx(expected.mean(), abs=0.02 * expected.std())
    slope = COVARIANCE[0, 1] / COVARIANCE[1, 1]
    rest = vectors[:, 0] - mean[0] - slope * (vectors[:, 1] - mean[1])
    assert rest.mean() == pytest.approx(0, abs=0.02 * 0.2)
    assert rest.std() == pytest.approx(np.sqrt(COVARIANCE[0, 0] - slope * COVARIANCE[0, 1]), rel=0.02)


def test_log_derivative_of_a_bounded_normal() -> None:
    bounds = (np.array([-np.inf, 0.0, -2.1]), np.array([0.9, 0.5, np.inf]))
    to_vectors = BoundedNormal.of(np.array([1.0, 0.6, -2.0]), COVARIANCE, bounds)
    check_derivative(to_vectors, np.random.default_rng(1).standard_normal((5, 3)))


def test_pad_is_near_standard_normal_in_the_map() -> None:
    """Log density less that of the variables: flat but for what is of third order, on a kernel with a bound at zero."""
    pad = square(HalfSpaceKernel(6.0, length_prior(5.0)), (3.0, 1.5))
    problem, _ = pad_problem(pad.sensor, pad.touch(grid(3, 19, 9, 2), np.random.default_rng(3)), samples="mean", seed=0)
    model = fit_kernel(problem, HalfSpaceKernel(6.0, length_prior(5.0)))
    density = PadDensity.of(fit_without_effects(problem, model, pad.sensor.body))
    to_vectors = PadPosteriorMap.of(density, seed=0)
    points = np.random.default_rng(2).standard_normal((300, len(density.priors)))
    check_derivative(to_vectors, points[:3])
    vectors, log_derivative = to_vectors(points)
    assert (vectors[:, -1] > 0).all()
    log_weight = density(vectors) + log_derivative + 0.5 * (points**2).sum(axis=1)
    weight = np.exp(log_weight - log_weight.max())
    # Importance weights: at least two in five points count.
    assert weight.sum() ** 2 / (weight**2).sum() > 0.4 * len(points)


def check_derivative(to_vectors: BoundedNormal | PadPosteriorMap, points: np.ndarray) -> None:
    """Log of the determinant of the derivative, by central differences."""
    _, found = to_vectors(points)
    for point, log_derivative in zip(points, found, strict=True):
        steps = 1e-5 * np.eye(len(point))
        jacobian = (to_vectors(point + steps)[0] - to_vectors(point - steps)[0]) / 2e-5
        assert log_derivative == pytest.approx(np.linalg.slogdet(jacobian)[1], abs=1e-4)
