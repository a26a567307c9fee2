"""Densities of proposals are those of their draws."""

from __future__ import annotations

import numpy as np
from sampling_targets import student_t
from scipy import stats

from bayestouch.sampling import BlockStreams, Mixture


def test_student_t_density_and_draws() -> None:
    covariance = np.array([[2.0, 0.6], [0.6, 0.5]])
    proposal = student_t([1, -1], covariance, blocks=3, dof=6)
    x, log_q = proposal.draw(BlockStreams(1, range(3)), 20_000)
    reference = stats.multivariate_t([1, -1], covariance, df=6)
    np.testing.assert_allclose(log_q, reference.logpdf(x), rtol=1e-9)
    np.testing.assert_allclose(proposal.log_density(x), log_q, rtol=1e-9)
    # Each coordinate is a Student-t; 20,000 draws, three blocks and two coordinates.
    for j in range(2):
        scale = np.sqrt(covariance[j, j])
        for block in range(3):
            assert stats.kstest(x[block, :, j], stats.t(6, [1, -1][j], scale).cdf).pvalue > 1e-4


def test_mixture_density_is_that_of_its_draws() -> None:
    """The mean of p/q over draws from q is 1 for any normalised p."""
    narrow, wide = student_t([2, 0], 0.2 * np.eye(2), blocks=2), student_t([-1, 1], 2 * np.eye(2), blocks=2)
    mixture = Mixture((narrow, wide), np.array([[0.7, 0.3], [0.0, 1.0]]))
    x, log_q = mixture.draw(BlockStreams(1, range(2)), 50_000)
    np.testing.assert_allclose(mixture.log_density(x), log_q, rtol=1e-12)
    p = stats.multivariate_t([0.5, 0.5], np.eye(2), df=8)
    ratio = np.exp(p.logpdf(x) - log_q)
    error = ratio.std(axis=1) / np.sqrt(50_000)
    assert np.all(np.abs(ratio.mean(axis=1) - 1) < 4 * error)
    near = np.linalg.norm(x[0] - [2, 0], axis=1) < 1
    assert 0.5 < near.mean() < 0.75
    some = mixture.select([1])
    np.testing.assert_array_equal(some.log_density(x[1:]), log_q[1:])
