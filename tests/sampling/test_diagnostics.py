"""Effective sample size and R-hat of draws, as ArviZ has them."""

from __future__ import annotations

import arviz as az
import numpy as np
import pytest
from sampling_targets import CASES, student_t

from bayestouch.sampling import bulk_statistics, sample_blocks


def test_statistics_of_the_draws_are_those_of_arviz() -> None:
    target, centre, covariance, _ = CASES["half of the mass beyond the edge"]
    result = sample_blocks(target.blocks, student_t(centre, covariance, blocks=4), seed=5)
    for block in range(4):
        for j in range(2):
            values = result.draws[:, :, block, j]
            assert result.ess_bulk[block, j] == pytest.approx(float(az.ess(values)), rel=1e-9)
            assert result.rhat[block, j] == pytest.approx(float(az.rhat(values)), rel=1e-9)


@pytest.mark.filterwarnings("ignore:divide by zero")  # in ArviZ
@pytest.mark.parametrize("n", [4, 5, 8, 64, 101, 256])
def test_statistics_are_those_of_arviz(n: int) -> None:
    rng = np.random.default_rng(n)
    x = rng.normal(size=(4, n, 2, 4))
    x[..., 0, 1] = np.round(x[..., 0, 1], 1)  # ties
    x[1, :, 0, 2] += 0.5  # a chain apart
    x[..., 0, 3] = x[..., 0, 3].cumsum(axis=1)  # slow
    x[..., 1, 0] = np.repeat(x[:, ::2, 1, 0], 2, axis=1)[:, :n]  # repeated draws
    x[..., 1, 1] *= np.where(np.arange(n) % 2, 1, -1) * 0.1 + 1
    x[..., 1, 2] += 3 * (-1.0) ** np.arange(n)  # antithetic
    x[..., 1, 3] = np.exp(3 * x[..., 1, 3])
    ess, rhat = bulk_statistics(x)
    for i in range(2):
        for j in range(4):
            assert ess[i, j] == pytest.approx(float(az.ess(x[..., i, j])), rel=1e-6)
            assert rhat[i, j] == pytest.approx(float(az.rhat(x[..., i, j])), rel=1e-6)


def test_statistics_of_draws_that_say_nothing_are_nan() -> None:
    draws = np.zeros((4, 50, 3))
    draws[..., 1] = np.nan
    draws[..., 2] = np.arange(50)
    draws[0, 0, 2] = np.inf
    assert np.isnan(bulk_statistics(draws)).all()
    assert np.isnan(bulk_statistics(np.random.default_rng(0).normal(size=(4, 3, 1)))).all()
