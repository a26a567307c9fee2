"""Functions of low rank beside independent errors and one that a row shares, against the same matrix written out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from bayestouch.sampling.low_rank import LowRank

RNG = np.random.default_rng(11)
T, M, R, Q = 7, 3, 2, 4
DIRECTION = RNG.normal(size=(T, M))
OWN = RNG.normal(size=(M, T, R))
SHARED = RNG.normal(size=(T, M, Q))
ROWS = RNG.normal(size=(5, T, M))
# Rounding, times a condition number of some hundreds.
CLOSE = {"rtol": 1e-10, "atol": 1e-11}


def columns(own: np.ndarray, shared: np.ndarray) -> np.ndarray:
    """F, (T M, M r + q): entries in the order of a row after the other."""
    out = np.zeros((T, M, M * own.shape[2] + shared.shape[2]))
    for e in range(M):
        out[:, e, e * own.shape[2] : (e + 1) * own.shape[2]] = own[e]
    out[:, :, M * own.shape[2] :] = shared
    return out.reshape(T * M, -1)


def written_out(own: np.ndarray, shared: np.ndarray) -> np.ndarray:
    """Q, (T M, T M)."""
    out = np.eye(T * M)
    for t in range(T):
        out[t * M : (t + 1) * M, t * M : (t + 1) * M] += np.outer(DIRECTION[t], DIRECTION[t])
    functions = columns(own, shared)
    return out + functions @ functions.T


CASES = pytest.mark.parametrize(
    ("own", "shared"),
    [(OWN, SHARED), (OWN, SHARED[:, :, :0]), (OWN[:, :, :0], SHARED)],
    ids=["own and shared", "own", "shared"],
)


@CASES
def test_density_is_that_of_the_normal_distribution(own: np.ndarray, shared: np.ndarray) -> None:
    errors = LowRank(DIRECTION, own, shared)
    density = -0.5 * (errors.squared_distance(ROWS) + errors.log_determinant + T * M * np.log(2 * np.pi))
    wanted = stats.multivariate_normal(np.zeros(T * M), written_out(own, shared)).logpdf(ROWS.reshape(5, -1))
    np.testing.assert_allclose(density, wanted, **CLOSE)


@CASES
def test_whitened_rows_have_the_distance_as_their_product(own: np.ndarray, shared: np.ndarray) -> None:
    errors = LowRank(DIRECTION, own, shared)
    white = errors.whiten(ROWS)
    assert white.shape == (5, T + own.shape[2] + shared.shape[2], M)
    flat, rows = white.reshape(5, -1), ROWS.reshape(5, -1)
    wanted = rows @ np.linalg.solve(written_out(own, shared), rows.T)
    np.testing.assert_allclose(flat @ flat.T, wanted, **CLOSE)


@CASES
def test_weights_given_the_rows(own: np.ndarray, shared: np.ndarray) -> None:
    """Their conditional distribution, from the joint covariance of rows and weights."""
    errors, functions = LowRank(DIRECTION, own, shared), columns(own, shared)
    gain = functions.T @ np.linalg.inv(written_out(own, shared))
    np.testing.assert_allclose(errors.weights(ROWS), ROWS.reshape(5, -1) @ gain.T, **CLOSE)
    np.testing.assert_allclose(errors.covariance, np.eye(functions.shape[1]) - gain @ functions, **CLOSE)
    np.testing.assert_allclose(
        errors.added(errors.weights(ROWS)).reshape(5, -1), ROWS.reshape(5, -1) @ gain.T @ functions.T, **CLOSE
    )
    np.testing.assert_allclose(errors.information @ errors.covariance, np.eye(functions.shape[1]), **CLOSE)
