"""Normal distributions of many vectors: against scipy, and against the definition of a conditional density."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from bayestouch.sampling.normals import CorrelatedNormals, NormalsWithSharedError

M, T, N = 4, 3, 2
RNG = np.random.default_rng(1)
ROOTS = RNG.normal(size=(T, M, M)) + 3 * np.eye(M)
COVARIANCE = ROOTS @ ROOTS.swapaxes(1, 2)
MEAN, VALUES = RNG.normal(size=(N, T, M)), 3 * RNG.normal(size=(T, M))


def whitener(covariance: np.ndarray) -> np.ndarray:
    return np.linalg.inv(np.linalg.cholesky(covariance))


def correlated() -> CorrelatedNormals:
    return CorrelatedNormals(MEAN, whitener(COVARIANCE))


def test_correlated_density_is_that_of_scipy() -> None:
    log = correlated().log_density(VALUES)
    for n in range(N):
        for t in range(T):
            expected = multivariate_normal(MEAN[n, t], COVARIANCE[t]).logpdf(VALUES[t])
            assert log[n, t] == pytest.approx(expected, rel=1e-12)


def test_density_given_the_others_is_that_of_all_over_that_of_the_others() -> None:
    log = correlated().log_given_others(VALUES)
    for t in range(T):
        for i in range(M):
            rest = np.delete(np.arange(M), i)
            whole = multivariate_normal(MEAN[0, t], COVARIANCE[t]).logpdf(VALUES[t])
            others = multivariate_normal(MEAN[0, t, rest], COVARIANCE[t][np.ix_(rest, rest)]).logpdf(VALUES[t, rest])
            assert log[0, t, i] == pytest.approx(whole - others, rel=1e-10)


def test_a_missing_number_is_left_out() -> None:
    """Its row and column of the whitener are zero, as touches have them."""
    rest = np.array([0, 2, 3])
    part = np.zeros((1, M, M))
    part[0][np.ix_(rest, rest)] = whitener(COVARIANCE[0][np.ix_(rest, rest)])
    values = np.where(np.arange(M) == 1, np.nan, VALUES[:1])
    normals = CorrelatedNormals(MEAN[:, :1], part)
    expected = multivariate_normal(MEAN[0, 0, rest], COVARIANCE[0][np.ix_(rest, rest)]).logpdf(VALUES[0, rest])
    assert normals.log_density(values)[0, 0] == pytest.approx(expected, rel=1e-12)
    given = normals.log_given_others(values)
    assert np.isnan(given[..., 1]).all() and np.isfinite(given[..., rest]).all()
    assert np.isnan(normals.draw(np.ones((N, 1, M)))[..., 1]).all()


def test_draws_have_the_covariance() -> None:
    n = 40_000
    normals = CorrelatedNormals(np.broadcast_to(MEAN[:1], (n, T, M)), whitener(COVARIANCE))
    drawn = normals.draw(np.random.default_rng(2).standard_normal((n, T, M)))
    for t in range(T):
        found = np.cov(drawn[:, t].T)
        # an entry's standard error is at most sqrt(2/n) = 0.7 % of the product of the standard deviations
        size = np.sqrt(np.outer(np.diag(COVARIANCE[t]), np.diag(COVARIANCE[t])))
        np.testing.assert_allclose(found / size, COVARIANCE[t] / size, atol=0.03)
        np.testing.assert_allclose(drawn[:, t].mean(axis=0), MEAN[0, t], atol=5 * np.sqrt(size.max() / n))


def test_numbers_with_a_shared_error() -> None:
    variance, shared = np.exp(RNG.normal(size=(N, T, M))), RNG.normal(size=(N, T, M))
    variance[:, 0, 2], shared[:, 0, 2] = np.inf, 0.0  # missing
    values = VALUES.copy()
    values[0, 2] = np.nan
    normals = NormalsWithSharedError(MEAN, variance, shared)
    draws = normals.draw(np.broadcast_to(np.eye(M)[:, None, None], (M, N, T, M)))
    for n, t in np.ndindex(N, T):
        here = np.flatnonzero(np.isfinite(values[t]))
        covariance = np.diag(variance[n, t, here]) + np.outer(shared[n, t, here], shared[n, t, here])
        residual = values[t, here] - MEAN[n, t, here]
        expected = multivariate_normal(cov=covariance).logpdf(residual)
        assert normals.log_density(values)[n, t] == pytest.approx(expected, rel=1e-10)
        for i, e in enumerate(here):
            others = np.delete(np.arange(len(here)), i)
            alone = multivariate_normal(cov=covariance[np.ix_(others, others)]).logpdf(residual[others])
            assert normals.log_given_others(values)[n, t, e] == pytest.approx(expected - alone, rel=1e-8)
        assert np.isnan(normals.log_given_others(values)[n, t]).sum() == M - len(here)
        root = draws[:, n, t][np.ix_(here, here)] - MEAN[n, t, here]
        np.testing.assert_allclose(root.T @ root, covariance, rtol=1e-10, atol=1e-12)
