"""Functions of one element each are integrated out as a normal distribution written out does it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal

from bayestouch.array_types import FloatArray
from bayestouch.model.own_columns import OwnColumns

T, M, OWN, FULL = 12, 3, 7, 2


def functions(rng: np.random.Generator) -> FloatArray:
    """Own functions of each element, one fewer of the last, and some of all; in mixed order."""
    raw = rng.standard_normal((OWN * M - 1 + FULL, T, M))
    for c in range(OWN * M - 1):
        raw[c, :, np.arange(M) != c % M] = 0.0
    return raw[rng.permutation(len(raw))]


def written_out(
    raw: FloatArray, left: FloatArray, weight: FloatArray, slopes: FloatArray, present: FloatArray
) -> float:
    """Log density of the readings that are not missing, without the 2π."""
    noise = np.where(present, 1 / np.where(weight > 0, weight, 1.0), 1.0)
    blocks = [np.diag(noise[t]) + np.einsum("ki,kj->ij", slopes[:, t], slopes[:, t]) for t in range(T)]
    flat = raw.reshape(len(raw), -1)
    covariance = block_diag(*blocks) + flat.T @ flat
    here = np.flatnonzero(present.ravel())
    density = multivariate_normal(None, covariance[np.ix_(here, here)]).logpdf(left.ravel()[here])
    return float(density + 0.5 * len(here) * np.log(2 * np.pi))


@pytest.mark.parametrize("shared", [0, 1, 2])
@pytest.mark.parametrize("missing", [0, 4])
def test_against_a_normal_distribution_written_out(shared: int, missing: int) -> None:
    rng = np.random.default_rng(shared + 10 * missing)
    raw, left, slopes = functions(rng), rng.standard_normal((2, T, M)), rng.standard_normal((shared, 2, T, M))
    present = np.ones(T * M, dtype=bool)
    present[rng.choice(T * M, missing, replace=False)] = False
    present = present.reshape(T, M)
    # touches with other numbers of samples; elements with other noise in the second table
    share = np.where(present, rng.choice([0.2, 0.5], (T, 1)), np.inf)
    weight = rng.uniform(0.5, 30.0, (2, 1, M)) / share
    found = OwnColumns.of(raw, share).log_density(left, weight, slopes)
    assert found is not None
    expected = [written_out(raw, left[i], weight[i], slopes[:, i], present) for i in range(2)]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8)


def test_noise_that_is_not_in_proportion_is_left_to_others() -> None:
    """As with a discrepancy and unequal numbers of samples: functions that did not overlap then do."""
    rng = np.random.default_rng(1)
    raw, share = functions(rng), rng.choice([0.2, 0.5], (T, 1)) * np.ones(M)
    weight = 1 / (share + 0.1)
    own = OwnColumns.of(raw, share)
    assert own.log_density(np.zeros((1, T, M)), weight[None], np.zeros((1, 1, T, M))) is None
    assert own.log_density(np.zeros((1, T, M)), 1 / share[None], np.zeros((1, 1, T, M))) is not None


def test_few_functions_are_left_to_others() -> None:
    raw = np.random.default_rng(2).standard_normal((1, T, M))
    own = OwnColumns.of(raw, np.ones((T, M)))
    assert own.log_density(np.zeros((1, T, M)), np.ones((1, T, M)), np.zeros((1, 1, T, M))) is None
