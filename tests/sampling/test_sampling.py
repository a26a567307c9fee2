"""The samplers against targets whose moments are known, in units of their own Monte Carlo error."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import emcee
import numpy as np
import pytest
from numpy.typing import NDArray
from plain_sampler import sample_plain
from sampling_targets import BLOCKS, CASES, NORMAL_2, standard_normal, student_t
from scipy import stats

from bayestouch.array_types import FloatArray
from bayestouch.sampling import (
    Demands,
    StudentTProposal,
    importance_blocks,
    sample_blocks,
)
from bayestouch.sampling.attempts import begun
from bayestouch.sampling.density import by_walker
from bayestouch.sampling.ensembles import ensemble_round
from bayestouch.sampling.run import Run
from bayestouch.sampling.sampler import ArraySampler


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_draws_have_the_moments_of_the_target(case: str) -> None:
    target, centre, covariance, needed = CASES[case]
    # Ensembles take a hundred times as long as chains. With 80 blocks the mean of sds is still good to 0.25 %.
    result = sample_blocks(target.blocks, student_t(centre, covariance, 80 if needed == 3 else BLOCKS), seed=5)
    assert np.median(result.rounds) == needed
    # The banana's horns are long; a few blocks may stay below the demands, and say so.
    assert result.grade.mean() > (0.8 if case == "banana" else 0.99)
    draws = result.draws[:, :, result.grade]
    ess = result.ess_bulk[result.grade]
    n = len(ess)
    z = (draws.mean(axis=(0, 1)) - target.mean) / (np.asarray(target.sd) / np.sqrt(ess))
    # Errors of the blocks are independent: their rms is 1 ± 1/sqrt(2 n), their mean 0 ± 1/sqrt(n). 15 % more for the
    # error of the effective sample sizes themselves, which are known to about 10 %.
    assert np.all(np.abs(np.sqrt((z**2).mean(axis=0)) - 1) < 4 / np.sqrt(2 * n) + 0.15)
    # Blocks that pass are those whose draws happened to look good: it shifts means by a few tenths of the error.
    assert np.all(np.abs(z.mean(axis=0)) < 4 / np.sqrt(n) + (0.3 if result.grade.mean() < 0.99 else 0))
    sd = draws.std(axis=(0, 1)) / target.sd
    assert np.all(np.abs(sd.mean(axis=0) - 1) < 0.01)
    for probability in (0.05, 0.95):
        below = (draws[..., 0] < target.first.ppf(probability)).mean(axis=(0, 1))
        error = np.sqrt(probability * (1 - probability) / ess[:, 0].sum())
        # Tails mix up to twice as slowly as the bulk.
        assert abs(below.mean() - probability) < 4 * np.sqrt(2) * error


def test_ensemble_moves_are_exact_in_four_dimensions() -> None:
    """emcee's snooker move, say, makes a normal of four dimensions 15 % too narrow."""
    covariance = 0.8 + 0.2 * np.eye(4)
    precision = np.linalg.inv(covariance)

    def log_density(x: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        return -0.5 * np.einsum("...i,ij,...j->...", x, precision, x)

    run = Run(log_density, walkers=4, draws=512, seed=9, demands=Demands())
    result = ensemble_round(run, student_t(np.zeros(4), 4 * np.eye(4), blocks=100), np.arange(100))
    assert result.grade.all()
    assert np.all(np.abs(result.draws.std(axis=(0, 1)).mean(axis=0) - 1) < 0.01)  # 100 blocks of ESS > 400: 0.4 %
    correlation = np.corrcoef(result.draws.reshape(-1, 4).T)
    assert np.all(np.abs(correlation - covariance) < 0.01)
    z = result.draws.mean(axis=(0, 1)) * np.sqrt(result.ess_bulk)
    assert np.all(np.abs(np.sqrt((z**2).mean(axis=0)) - 1) < 4 / np.sqrt(200) + 0.15)


@pytest.mark.slow
@pytest.mark.parametrize(
    "move", [emcee.moves.StretchMove(), [(emcee.moves.DEMove(), 0.7), (emcee.moves.WalkMove(), 0.3)]]
)
def test_moves_of_emcee_draw_the_same_posterior(move: Any) -> None:
    """Each block by samplers of its own: half of a normal distribution, at another place in each block."""
    target, centre, covariance, _ = CASES["half of the mass beyond the edge"]

    def log_density(x: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        return target.log_density(x - 3.0 * blocks[:, None, None])

    proposal = student_t(centre, covariance, blocks=3)
    shifted = StudentTProposal(proposal.centre + 3.0 * np.arange(3)[:, None], proposal.root)
    result = sample_blocks(log_density, shifted, seed=5, draws=512, moves=move)
    assert (result.rounds == 4).all() and result.grade.all() and np.isnan(result.pareto_k).all()
    assert np.all((result.acceptance > 0.1) & (result.acceptance < 0.9))
    draws = result.draws - 3.0 * np.arange(3)[:, None]
    z = (draws.mean(axis=(0, 1)) - target.mean) / np.asarray(target.sd) * np.sqrt(result.ess_bulk)
    assert np.all(np.abs(z) < 4)
    # Three blocks of ESS of about 600: 1,800 draws leave 1.7 % of a standard deviation, so that 5 % would be seen.
    assert np.all(result.worst_ess > 450)
    assert np.all(np.abs((draws.std(axis=(0, 1)) / target.sd).mean(axis=0) - 1) < 0.045)
    some = sample_blocks(log_density, shifted.select([2]), seed=5, draws=512, moves=move, blocks=[2])
    np.testing.assert_array_equal(some.draws[:, :, 0], result.draws[:, :, 2])


def test_emcee_evaluates_the_density(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every proposal of the first round goes through the sampler of emcee, and its number is that of the chains."""
    counted, through = [], ArraySampler.compute_log_prob

    def counting(self: ArraySampler, coords: FloatArray) -> Any:
        counted.append(coords.shape)
        return through(self, coords)

    monkeypatch.setattr(ArraySampler, "compute_log_prob", counting)
    target, centre, covariance, _ = CASES["normal"]
    sample_blocks(target.blocks, student_t(centre, covariance, blocks=10), seed=1, draws=64, rounds=1)
    assert counted == [(4 * (64 + 8) * 10, 3)]


def test_walkers_of_a_block_follow_each_other_by_the_number_of_blocks() -> None:
    density = by_walker(lambda x: x[..., 0] + 100 * np.arange(3)[:, None], 3)
    x = np.arange(24.0).reshape(12, 2)
    np.testing.assert_array_equal(density(x), x[:, 0] + 100 * (np.arange(12) % 3))
    np.testing.assert_array_equal(density(np.asfortranarray(x)), density(x))


def test_first_round_alone_says_what_it_missed() -> None:
    target, centre, covariance, _ = CASES["one mode of two"]
    result = sample_blocks(target.blocks, student_t(centre, covariance), seed=5, rounds=1)
    assert not result.grade.any()
    assert (result.rounds == 1).all()
    assert (result.worst_ess < 400).any() or (result.worst_rhat > 1.02).any() or (result.pareto_k > 0.5).any()


def test_acceptance_is_that_of_independence_metropolis() -> None:
    """Uniform target, proposals beyond it: E min(1, w'/w) by direct simulation."""
    proposal = student_t([0.5], [[0.25]], blocks=100)
    result = sample_blocks(
        lambda x, blocks: np.where((x[..., 0] > 0) & (x[..., 0] < 1), 0.0, -np.inf), proposal, seed=2, rounds=1
    )
    rng = np.random.default_rng(0)
    q = stats.t(7, loc=0.5, scale=0.5)
    state, proposed = rng.uniform(size=10**6), q.rvs(10**6, random_state=rng)
    expected = np.mean(((proposed > 0) & (proposed < 1)) * np.minimum(1, q.pdf(state) / q.pdf(proposed)))
    # 100 blocks of 4 x 272 proposals: sd of a share of about one half, correlated over a few steps.
    assert result.acceptance.mean() == pytest.approx(expected, abs=4 * 0.5 * 2 / np.sqrt(100 * 4 * 272))


@pytest.mark.slow
def test_a_block_depends_on_seed_and_number_alone() -> None:
    """Whatever it is sampled with, in all three rounds: so results do not depend on how blocks are shared out."""
    centres = np.array([[0.0, 0], [4, 4], [20, 20], [0.5, 0], [30, 30]])
    covariances = np.array([1, 1, 0.01, 1, 0.01])[:, None, None] * np.eye(2)
    proposal = StudentTProposal.from_covariance(centres, covariances)

    def log_density(x: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        return -0.5 * ((x / (1 + 0.1 * blocks[:, None, None])) ** 2).sum(axis=-1)

    every = sample_blocks(log_density, proposal, seed=11)
    assert set(every.rounds) == {1, 2, 3}
    chosen = np.array([3, 2, 1])
    some = sample_blocks(log_density, proposal.select(chosen), seed=11, blocks=chosen)
    np.testing.assert_array_equal(some.draws, every.draws[:, :, chosen])
    np.testing.assert_array_equal(some.ess_bulk, every.ess_bulk[chosen])
    other = sample_blocks(log_density, proposal, seed=12)
    assert not np.array_equal(other.draws[:, :, 0], every.draws[:, :, 0])
    # The log density that goes with each draw.
    at_draws = log_density(np.moveaxis(every.draws.reshape(-1, 5, 2), 1, 0), np.arange(5))
    np.testing.assert_allclose(every.log_density.reshape(-1, 5).T, at_draws, rtol=1e-12)


def test_chains_of_a_block_are_independent() -> None:
    """Errors of the chains' means are uncorrelated over many blocks."""
    target, centre, covariance, _ = CASES["normal"]
    result = sample_blocks(target.blocks, student_t(centre, covariance, blocks=1000), seed=1, draws=64, rounds=1)
    means = result.draws.mean(axis=1)[..., 0]
    correlation = np.corrcoef(means)[np.triu_indices(4, 1)]
    assert np.all(np.abs(correlation) < 4 / np.sqrt(1000))


def test_the_start_is_forgotten() -> None:
    """The first draw kept has the target's distribution, though a walker starts at a proposal, here twice as wide."""
    result = sample_blocks(NORMAL_2.blocks, student_t([0], [[4]], blocks=2000), seed=8, draws=32, rounds=1)
    # Eight steps, each forgetting 1/w of the start, w = 2.1 the largest ratio of the densities: 1 % is left.
    assert stats.kstest(result.draws[:, 0, :, 0].ravel(), stats.norm.cdf).pvalue > 1e-3


def test_demands_are_the_callers() -> None:
    target, centre, covariance, _ = CASES["normal"]
    proposal = student_t(centre, covariance, blocks=20)
    assert not sample_blocks(target.blocks, proposal, seed=1, rounds=1, demands=Demands(ess_bulk=5000)).grade.any()
    assert sample_blocks(target.blocks, proposal, seed=1, rounds=1, demands=Demands(ess_bulk=300)).grade.all()


def test_many_parameters_are_drawn_without_reshaping() -> None:
    proposal = student_t(np.zeros(20), np.eye(20), blocks=3, dof=2)
    result = sample_blocks(lambda x, blocks: standard_normal(x), proposal, seed=1, walkers=4, draws=300)
    assert (result.rounds == 2).all()  # tails much too heavy for 20 dimensions: few are accepted
    assert np.all(np.abs(result.draws.mean(axis=(0, 1))) < 5 / np.sqrt(result.ess_bulk))


@pytest.mark.filterwarnings("error")
def test_a_block_without_any_density_is_nan_and_not_good() -> None:
    target, centre, covariance, _ = CASES["normal"]

    def nothing_in_first(x: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        return np.where(blocks[:, None] == 0, -np.inf, target.log_density(x))

    result = sample_blocks(nothing_in_first, student_t(centre, covariance, blocks=2), seed=1)
    np.testing.assert_array_equal(result.grade, [False, True])
    assert np.isnan(result.draws[:, :, 0]).all() and np.isfinite(result.draws[:, :, 1]).all()
    assert result.worst_ess[0] == 0 and result.worst_rhat[0] == np.inf
    weighted = importance_blocks(nothing_in_first, student_t(centre, covariance, blocks=2), seed=1)
    np.testing.assert_array_equal(weighted.grade, [False, True])
    assert np.isnan(weighted.draws[:, :, 0]).all()


def test_nan_density_is_refused() -> None:
    proposal = student_t([0, 0], np.eye(2), blocks=4)

    def broken(x: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        return np.where((blocks[:, None] == 2) & (x[..., 0] > 0), np.nan, 0.0)

    with pytest.raises(ValueError, match="NaN in block 2"):
        sample_blocks(broken, proposal, seed=1)
    with pytest.raises(ValueError, match="expected"):
        sample_blocks(lambda x, blocks: np.zeros(3), proposal, seed=1)


def test_numbers_that_do_not_fit_are_refused() -> None:
    proposal = student_t([0, 0], np.eye(2), blocks=4)
    with pytest.raises(ValueError, match="one number for each of 4 blocks"):
        sample_blocks(NORMAL_2.blocks, proposal, seed=1, blocks=[1, 2])
    with pytest.raises(ValueError, match="at least 2 walkers"):
        sample_blocks(NORMAL_2.blocks, proposal, seed=1, walkers=1)
    with pytest.raises(ValueError, match="one number for each of 4 blocks"):
        importance_blocks(NORMAL_2.blocks, proposal, seed=1, blocks=[1, 2])


def test_progress_is_told() -> None:
    told: list[float] = []
    sample_blocks(NORMAL_2.blocks, student_t([0, 0], np.eye(2), blocks=1), seed=1, progress=told.append)
    assert len(told) > 20 and told[-1] == 1 and np.all(np.diff(told) > 0)


@pytest.mark.parametrize("case", ["normal", "half of the mass beyond the edge"])
def test_importance_sampling_has_the_moments_of_the_target(case: str) -> None:
    target, centre, covariance, _ = CASES[case]
    result = importance_blocks(target.blocks, student_t(centre, covariance), proposals=2048, seed=4)
    assert result.grade.all()
    assert np.all(result.pareto_k < 0.5)
    # Resampling 1024 draws adds at most the error of as many independent ones.
    variance = 1 / result.ess + 1 / 1024
    z = (result.draws.mean(axis=(0, 1)) - target.mean) / (np.asarray(target.sd) * np.sqrt(variance)[:, None])
    assert np.all(np.abs(z.mean(axis=0)) < 4 / np.sqrt(BLOCKS))
    # 1/sum(w²) is a rule of thumb for the error of a mean, good to a fifth here; the rms itself scatters by 1/20.
    assert np.all(np.abs(np.sqrt((z**2).mean(axis=0)) - 1) < 0.2 + 4 / np.sqrt(2 * BLOCKS))
    assert np.all(np.abs((result.draws.std(axis=(0, 1)) / target.sd).mean(axis=0) - 1) < 0.01)
    np.testing.assert_allclose(
        target.log_density(np.moveaxis(result.draws, 2, 0)), np.moveaxis(result.log_density, 2, 0), rtol=1e-12
    )
    # A block's draws do not depend on the others.
    alone = importance_blocks(
        target.blocks, student_t(centre, covariance, blocks=1), proposals=2048, seed=4, blocks=[7]
    )
    np.testing.assert_array_equal(alone.draws[:, :, 0], result.draws[:, :, 7])


def test_importance_sampling_flags_what_it_missed() -> None:
    target, centre, covariance, _ = CASES["one mode of two"]
    result = importance_blocks(target.blocks, student_t(centre, covariance), seed=4)
    assert not result.grade.any()
    assert np.mean(result.pareto_k > 0.7) > 0.9


@pytest.mark.slow
def test_plain_emcee_agrees_with_the_target_and_with_lockstep() -> None:
    rng = np.random.default_rng(0)
    mixing = np.array([[1.0, 0, 0], [0.9, 0.3, 0], [-5, 2, 4]])
    precision = np.linalg.inv(mixing @ mixing.T)

    def log_density(x: FloatArray) -> FloatArray:
        return -0.5 * np.einsum("...i,ij,...j->...", x, precision, x)

    start = rng.normal(size=(4, 16, 3)) @ mixing.T
    result = sample_plain(log_density, start, steps=2000, seed=3)
    assert result.draws.shape == (4, 2000 * 16, 3)
    assert np.all(result.rhat < 1.02) and np.all(result.ess_bulk > 1000)
    sd = np.linalg.norm(mixing, axis=1)
    assert np.all(np.abs(result.draws.mean(axis=(0, 1))) < 4 * sd / np.sqrt(result.ess_bulk))
    # The relative error of an sd is half that of a variance.
    assert np.all(np.abs(result.draws.std(axis=(0, 1)) / sd - 1) < 4 / np.sqrt(2 * result.ess_bulk))
    np.testing.assert_allclose(log_density(result.draws[0]), result.log_density[0])
    # The time in steps of 16 walkers and the effective sample size tell the same story, to a factor.
    assert np.all(np.abs(np.log(4 * 2000 * 16 / result.autocorrelation_time / result.ess_bulk)) < np.log(1.5))
    again = sample_plain(log_density, start, steps=100, seed=3)
    np.testing.assert_array_equal(again.draws, sample_plain(log_density, start, steps=100, seed=3).draws)
    assert not np.array_equal(again.draws, sample_plain(log_density, start, steps=100, seed=4).draws)


def test_plain_emcee_refuses_a_start_that_cannot_work() -> None:
    for shape in ((3, 16, 2), (4, 15, 2), (4, 4, 3), (16, 2)):
        with pytest.raises(ValueError, match="start"):
            sample_plain(standard_normal, np.zeros(shape), steps=10, seed=1)


def test_importing_the_samplers_is_quick() -> None:
    """emcee, ArviZ and the slow half of SciPy come in when they are used."""
    code = (
        "import sys, bayestouch.sampling\n"
        "slow = ('emcee', 'arviz', 'pandas', 'xarray', 'scipy.stats', 'scipy.optimize')\n"
        "print([m for m in slow if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_draws_before_a_chain_has_begun() -> None:
    """They become the first draw of their chain, or of another one."""
    points, log = np.arange(24.0).reshape(3, 4, 1, 2), np.arange(12.0).reshape(3, 4, 1)
    points[0, :2] = points[2] = np.nan
    made, densities = begun(points, log)
    np.testing.assert_array_equal(made[0, :, 0, 0], [4, 4, 4, 6])
    np.testing.assert_array_equal(made[2, :, 0, 1], [5, 5, 5, 5])
    np.testing.assert_array_equal(densities[:, :, 0], [[2, 2, 2, 3], [4, 5, 6, 7], [2, 2, 2, 2]])
    assert np.isnan(points[0, 0]).all() and begun(made, log)[0] is made
