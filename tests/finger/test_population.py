"""The hierarchical model of a build against likelihoods that are written out."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.stats import halfnorm, multivariate_normal, norm

from bayestouch.finger.population import EarlierFingers, NextFinger, Population, largest_eigenvalue, predict

FINGERS, ELEMENTS = 4, 3


def written_out(sds: np.ndarray, seen: np.ndarray, noise: float, estimates: np.ndarray) -> float:
    """Log density of the data of all fingers, and of the sds as coordinates log τ.

    Finger k was measured as ``y_k = H x_k`` with independent errors; two scalars and three elements.
    """
    sigma, mu, between, within = sds
    own = block_diag(sigma**2, mu**2, between**2 * np.ones((3, 3)) + within**2 * np.eye(3))
    mean = block_diag(1.0, 1.0, np.ones((3, 3)))
    k = len(estimates)
    whole = np.kron(np.ones((k, k)), mean) + np.kron(np.eye(k), own)
    see = np.kron(np.eye(k), seen)
    covariance = see @ whole @ see.T + noise**2 * np.eye(k * len(seen))
    data = multivariate_normal(np.zeros(len(covariance)), covariance).logpdf(estimates.ravel())
    return float(data + halfnorm.logpdf(sds).sum() + np.log(sds).sum())


def test_density_of_the_sds_is_that_of_all_data() -> None:
    """Each finger was measured in three directions of five: the other two are not known of any."""
    rng = np.random.default_rng(1)
    seen, noise = rng.standard_normal((3, 5)), 0.3
    estimates = rng.standard_normal((FINGERS, 3))
    evidence = EarlierFingers(np.repeat((seen.T @ seen / noise**2)[None], FINGERS, axis=0), estimates @ seen / noise**2)
    log_sd = rng.uniform(-3, 1, (20, 4))
    ours, _, _ = Population.of(2, ELEMENTS).posterior(log_sd, evidence)
    theirs = np.array([written_out(np.exp(each), seen, noise, estimates) for each in log_sd])
    assert np.ptp(theirs) > 10
    np.testing.assert_allclose(ours - ours[0], theirs - theirs[0], atol=1e-8)


def test_posterior_of_the_build_mean_is_that_of_a_normal_mean() -> None:
    """One element a finger, known sds: the mean of the build has a closed form."""
    y, s, between, within = np.array([0.3, -0.1, 0.4]), 0.2, 0.5, 0.1
    evidence = EarlierFingers(np.full((3, 1, 1), s**-2.0), y[:, None] / s**2)
    _, mean, spread = Population.of(0, 1).posterior(np.log([[between, within]]), evidence)
    each = 1 / (s**2 + between**2 + within**2)
    assert spread[0, 0, 0] == pytest.approx(1 / (1 + 3 * each))
    assert mean[0, 0] == pytest.approx(each * y.sum() / (1 + 3 * each))


@cache
def estimated() -> tuple[np.ndarray, float]:
    """Estimates of 8 fingers of 6 elements, with sds of 0.2 between and 0.1 within fingers, and their error."""
    rng = np.random.default_rng(5)
    error = 0.05
    truth = 0.3 + 0.2 * rng.standard_normal((8, 1)) + 0.1 * rng.standard_normal((8, 6))
    return truth + error * rng.standard_normal(truth.shape), error


@cache
def following() -> NextFinger:
    """What the estimates say of the next finger."""
    estimates, error = estimated()
    evidence = EarlierFingers(np.repeat((np.eye(6) / error**2)[None], 8, axis=0), estimates / error**2)
    return predict(Population.of(0, 6), evidence, seed=2)


@cache
def quadrature() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Grids of both sds and masses (between, within): finger means and residuals are independent."""
    estimates, error = estimated()
    k, m = estimates.shape
    between, within = np.exp(np.linspace(-5, 0.5, 60)), np.exp(np.linspace(-3.2, -1.5, 50))
    masses = np.empty((60, 50))
    rest = estimates - estimates.mean(axis=1, keepdims=True)
    for j, w in enumerate(within):
        own = w**2 + error**2
        of_rest = -0.5 * (rest**2).sum() / own - 0.5 * k * (m - 1) * np.log(own)
        for i, b in enumerate(between):
            covariance = np.ones((k, k)) + (b**2 + own / m) * np.eye(k)
            of_means = multivariate_normal(np.zeros(k), covariance).logpdf(estimates.mean(axis=1))
            masses[i, j] = of_rest + of_means + halfnorm.logpdf([b, w]).sum() + np.log(b * w)
    masses = np.exp(masses - masses.max())
    return between, within, masses / masses.sum()


def test_sds_of_the_population_are_those_of_quadrature() -> None:
    """Medians within 5 %, and the truth inside the central 98 %."""
    sds = following().sd
    between, within, masses = quadrature()
    for grid, mass, drawn, truth in (
        (between, masses.sum(axis=1), sds[:, 0], 0.2),
        (within, masses.sum(axis=0), sds[:, 1], 0.1),
    ):
        low, middle, high = np.interp([0.01, 0.5, 0.99], np.cumsum(mass) - 0.5 * mass, grid)
        assert np.median(drawn) == pytest.approx(middle, rel=0.05)
        assert low < truth < high


def test_next_finger_is_nowhere_more_certain_than_the_population() -> None:
    """The mean of its elements, as independent ones, has the sd of a finger's mean by quadrature, within 5 %."""
    _, error = estimated()
    between, within, masses = quadrature()
    b, w = np.meshgrid(between, within, indexing="ij")
    own = b**2 + (w**2 + error**2) / 6
    of_build = 1 / (1 + 8 / own)
    wanted = (masses * (of_build + b**2 + w**2 / 6)).sum()
    got = (following().variance / 6).mean()
    assert np.sqrt(got) == pytest.approx(np.sqrt(wanted), rel=0.05)
    # central 68 % of a coordinate: its own variance is larger than that of the population
    drawn = following().samples(0, np.random.default_rng(0))
    alone = np.sqrt((masses * (of_build + b**2 + w**2)).sum())
    assert np.diff(np.quantile(drawn, norm.cdf([-1, 1])))[0] / 2 > alone


def test_largest_eigenvalue_is_that_of_the_correlation() -> None:
    """Sds of 1 and 3 with a correlation of 0.6: 1.6 whatever the sds."""
    assert largest_eigenvalue(np.array([[[1.0, 1.8], [1.8, 9.0]]])) == pytest.approx(1.6)
