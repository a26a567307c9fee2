"""Proposals in two parts, and moves that renew a part of the coordinates, against known distributions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from bayestouch.array_types import FloatArray
from bayestouch.sampling import BlockStreams, Demands, StudentTProposal
from bayestouch.sampling.ensembles import renewal_round
from bayestouch.sampling.proposals import RENEWED_PART, RenewableProposal
from bayestouch.sampling.run import Run
from bayestouch.sampling.shared import SharedThenOwn, fitted_to_shared

COVARIANCE = np.array([[1.0, 0.6, 0.0], [0.6, 2.0, 0.3], [0.0, 0.3, 0.5]])
CENTRE = np.array([1.0, -2.0, 0.5])
ONE = np.zeros(1, dtype=np.intp)


def student(dof: float = 5.0) -> StudentTProposal:
    return StudentTProposal.from_covariance(CENTRE[None], COVARIANCE[None], dof)


def two_parts() -> SharedThenOwn:
    """The middle coordinate first, then the two others."""
    shared = StudentTProposal.from_covariance([[3.0]], [[[4.0]]], 6.0)
    own = StudentTProposal.from_covariance([[0.0, -1.0]], [[[1.0, 0.5], [0.5, 1.0]]], 300.0)
    return SharedThenOwn(shared, own, np.array([1]))


@pytest.mark.parametrize("proposal", [student(), two_parts()], ids=["one part", "two parts"])
def test_renewed_points_are_points_of_the_proposal(proposal: RenewableProposal) -> None:
    """Marginals before and after, and both orders of a pair: 4 standard errors of 40,000 points."""
    n = 40000
    x, _ = proposal.draw(BlockStreams(1, [0]), n)
    y = proposal.renewed(BlockStreams(2, [0]), x)
    assert not np.shares_memory(x, y)
    for j in range(3):
        assert stats.ks_2samp(x[0, :, j], y[0, :, j]).pvalue > 1e-4
        changed = np.mean(np.abs(x[0, :, j] - y[0, :, j]) > 1e-9)
        assert 0.2 < changed < 0.95
        # E f(x) g(y) = E g(x) f(y)
        f, g = np.tanh(x[0, :, j]), np.tanh(y[0, :, j])
        for k in range(3):
            h, i = x[0, :, k] > 0, y[0, :, k] > 0
            difference = f * i - g * h
            assert abs(difference.mean()) < 4 * difference.std() / np.sqrt(n) + 1e-12


def test_a_third_of_the_standard_variables_is_renewed() -> None:
    assert RENEWED_PART == 3
    d = 9
    proposal = StudentTProposal.from_covariance(np.zeros((1, d)), np.eye(d)[None], 300.0)
    x, _ = proposal.draw(BlockStreams(3, [0]), 50)
    y = proposal.renewed(BlockStreams(4, [0]), x)
    np.testing.assert_array_equal((x != y).sum(axis=2), 3)


def test_log_density_is_that_of_both_parts() -> None:
    proposal = two_parts()
    x, log = proposal.draw(BlockStreams(5, [0]), 20)
    expected = stats.t(6, loc=3, scale=2).logpdf(x[0, :, 1])
    expected += stats.multivariate_t([0, -1], [[1, 0.5], [0.5, 1]], 300).logpdf(x[0][:, [0, 2]])
    np.testing.assert_allclose(log[0], expected, rtol=1e-9)
    np.testing.assert_allclose(proposal.log_density(x)[0], expected, rtol=1e-9)
    assert (proposal.n_blocks, proposal.dimension) == (1, 3)


def test_renewal_draws_from_a_target_that_the_proposal_misses() -> None:
    """Twenty skewed coordinates (log of a gamma of shape 4), of which a normal proposal has too light a tail."""
    d, shape = 20, 4.0

    def log_density(x: FloatArray, blocks: FloatArray) -> FloatArray:
        return np.asarray((shape * x - np.exp(x)).sum(axis=-1))

    target = stats.loggamma(shape)
    proposal = StudentTProposal.from_covariance(
        np.full((1, d), target.mean()), 1.1 * target.var() * np.eye(d)[None], 300.0
    )
    run = Run(log_density, 4, 1000, 3, Demands())
    found = renewal_round(run, proposal, ONE, thin=12)
    draws = found.draws[:, :, 0]
    assert found.rounds[0] == 5 and 0.3 < found.acceptance[0] < 1
    assert found.rhat.max() < 1.02 and found.ess_bulk.min() > 800
    error = 1 / np.sqrt(found.ess_bulk[0])
    np.testing.assert_array_less(np.abs(draws.mean(axis=(0, 1)) - target.mean()), 4 * target.std() * error)
    # The kurtosis of 3.5 makes the standard error of an sd 1.1 times that of a normal one.
    np.testing.assert_array_less(np.abs(draws.std(axis=(0, 1)) / target.std() - 1), 4 * 0.8 * error)
    np.testing.assert_allclose(found.log_density[:, :, 0], log_density(draws, ONE))


def test_few_draws_can_be_renewed() -> None:
    """Two a chain, of 16 walkers that make one step."""
    proposal = StudentTProposal.from_covariance(np.zeros((1, 3)), np.eye(3)[None], 300.0)
    run = Run(lambda x, blocks: -0.5 * (x**2).sum(axis=-1), 4, 2, 3, Demands())
    found = renewal_round(run, proposal, ONE, thin=1)
    assert found.draws.shape == (4, 2, 1, 3) and np.isfinite(found.draws).all()


def test_a_mixture_is_fitted_to_the_shared_coordinate() -> None:
    """Two peaks of the first coordinate, the second normal."""

    def log_density(x: FloatArray, blocks: FloatArray) -> FloatArray:
        return np.asarray(np.logaddexp(-8 * (x[..., 0] - 2) ** 2, -8 * (x[..., 0] + 2) ** 2) - 0.5 * x[..., 1] ** 2)

    shared = StudentTProposal.from_covariance([[0.0]], [[[4.0]]], 8.0)
    own = StudentTProposal.from_covariance([[0.0]], [[[1.0]]], 300.0)
    fitted = fitted_to_shared(log_density, shared, own, np.array([0]), 1)

    def effective(proposal: SharedThenOwn) -> float:
        """Share of 4,000 weighted points that count; its Monte Carlo error is 2 %."""
        x, log_q = proposal.draw(BlockStreams(1, [0]), 4000)
        weight = np.exp(log_density(x, ONE) - log_q)[0]
        return float(weight.sum() ** 2 / (weight**2).sum() / 4000)

    assert effective(fitted) > effective(SharedThenOwn(shared, own, np.array([0]))) + 0.1


def test_a_proposal_with_the_moments_of_draws() -> None:
    """Of 20,000 normal draws, to 4 standard errors; few draws keep the correlations of the proposal."""
    covariance = np.array([[2.0, -0.5, 0.1], [-0.5, 1.0, 0.2], [0.1, 0.2, 3.0]])
    draws = np.random.default_rng(1).multivariate_normal([0.0, 1.0, 2.0], covariance, 20000)
    found = student(300.0).refitted(draws, 20000.0)
    np.testing.assert_allclose(found.centre[0], [0, 1, 2], atol=4 * np.sqrt(3 / 20000))
    scale = found.root[0] @ found.root[0].T * 300 / 298
    np.testing.assert_allclose(scale, covariance, atol=4 * 3 * np.sqrt(2 / 20000))
    few = student(300.0).refitted(draws, 0.0).root[0]
    changed = np.linalg.inv(student().root[0]) @ few
    np.testing.assert_allclose(changed, np.diag(np.diag(changed)), atol=1e-6)
