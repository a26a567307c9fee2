"""Covariances of independent and shared errors against the same matrices written out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from bayestouch.sampling.rank_one import (
    AlongError,
    DiagonalPlusRankOne,
    inverse_root,
    log_density_with_shared_error,
    log_density_with_shared_errors,
    normal_log_density,
    precision_times,
    shared_directions,
    shared_error,
)

RNG = np.random.default_rng(7)
T, M = 5, 6
SD = RNG.uniform(0.5, 2.0, (T, M))
DIRECTION = RNG.normal(size=(T, M))
OTHER = RNG.normal(size=(T, M))
ROWS = RNG.normal(size=(T, M))
PRESENT = RNG.uniform(size=(T, M)) > 0.3
COVARIANCE = DiagonalPlusRankOne(SD, DIRECTION)
# Two of the rows with entries that are left out, one with none left.
PRESENT[0], PRESENT[1] = True, False


def dense(row: int, *directions: np.ndarray) -> np.ndarray:
    return np.diag(SD[row] ** 2) + sum(np.outer(each[row], each[row]) for each in directions)


# Rounding in six entries: a few times 1e-16, times a condition number of a hundred.
CLOSE = {"rtol": 1e-12, "atol": 1e-12}


@pytest.mark.parametrize("row", range(T))
def test_whiten_and_distance(row: int) -> None:
    matrix = dense(row, DIRECTION)
    solved = np.linalg.solve(matrix, ROWS[row])
    np.testing.assert_allclose(COVARIANCE.squared_distance(ROWS)[row], ROWS[row] @ solved, **CLOSE)
    value, vector = np.linalg.eigh(np.diag(1 / SD[row]) @ matrix @ np.diag(1 / SD[row]))
    root = (vector * value**-0.5) @ vector.T @ np.diag(1 / SD[row])
    np.testing.assert_allclose(COVARIANCE.whiten(ROWS)[row], root @ ROWS[row], **CLOSE)
    np.testing.assert_allclose(root @ matrix @ root.T, np.eye(M), **CLOSE)


def test_what_is_left_out_does_not_count() -> None:
    """As if the matrix had no such row and column."""
    covariance = DiagonalPlusRankOne(np.where(PRESENT, SD, np.inf), DIRECTION)
    for row in range(T):
        here = PRESENT[row]
        matrix = dense(row, DIRECTION)[np.ix_(here, here)]
        wanted = np.zeros(M)
        wanted[here] = np.linalg.solve(matrix, ROWS[row, here])
        distance = ROWS[row] @ wanted
        np.testing.assert_allclose(covariance.squared_distance(ROWS)[row], distance, **CLOSE)
        np.testing.assert_allclose((covariance.whiten(ROWS)[row] ** 2).sum(), distance, **CLOSE)


def test_one_covariance_serves_many_rows() -> None:
    """Rows with further axes in front, as derivatives have them; and one standard deviation for all rows."""
    many = np.stack([ROWS, 2 * ROWS, OTHER])
    for k in range(len(many)):
        np.testing.assert_array_equal(COVARIANCE.whiten(many)[k], COVARIANCE.whiten(many[k]))
    even = DiagonalPlusRankOne(SD[0], DIRECTION)
    np.testing.assert_allclose(
        even.squared_distance(ROWS), DiagonalPlusRankOne(np.tile(SD[0], (T, 1)), DIRECTION).squared_distance(ROWS)
    )


def test_inverse_root_of_two_shared_errors() -> None:
    root = inverse_root(SD**2, (DIRECTION, OTHER), PRESENT)
    for row in range(T):
        here = PRESENT[row]
        wanted = np.zeros((M, M))
        wanted[np.ix_(here, here)] = np.linalg.inv(np.linalg.cholesky(dense(row, DIRECTION, OTHER)[np.ix_(here, here)]))
        np.testing.assert_allclose(root[row], wanted, **CLOSE)


def test_log_density_is_that_of_the_normal_distribution() -> None:
    root = inverse_root(SD**2, (DIRECTION, OTHER), PRESENT)
    wanted = 0.0
    for row in range(T):
        here = PRESENT[row]
        if here.any():
            matrix = dense(row, DIRECTION, OTHER)[np.ix_(here, here)]
            wanted += stats.multivariate_normal(np.zeros(here.sum()), matrix).logpdf(ROWS[row, here])
    found = normal_log_density(root, np.where(PRESENT, ROWS, np.nan))
    assert found - 0.5 * PRESENT.sum() * np.log(2 * np.pi) == pytest.approx(wanted, rel=1e-12)


def test_shared_error_given_the_rows() -> None:
    """Conditional mean and variance of the joint normal distribution of shared error and rows."""
    shared_sd, slope = RNG.uniform(0.3, 2.0, T), DIRECTION
    pull, precision = shared_error(ROWS, slope, np.where(PRESENT, SD, np.inf), shared_sd)
    for row in range(T):
        here = PRESENT[row]
        cross = shared_sd[row] ** 2 * slope[row, here]
        matrix = np.diag(SD[row, here] ** 2) + shared_sd[row] ** 2 * np.outer(slope[row, here], slope[row, here])
        gain = np.linalg.solve(matrix, cross)
        np.testing.assert_allclose(pull[row] / precision[row], gain @ ROWS[row, here], **CLOSE)
        np.testing.assert_allclose(1 / precision[row], shared_sd[row] ** 2 - gain @ cross, **CLOSE)


def test_log_density_of_rows_with_a_shared_error_each() -> None:
    """Against normal distributions of all entries of a row that are there."""
    rng = np.random.default_rng(7)
    rows, slope = rng.normal(size=(2, 3, 4, 5))
    weight, shared_sd = rng.uniform(0.2, 4, (3, 4, 5)), rng.uniform(0.1, 3, (3, 4))
    weight[1, 2, :2] = 0.0
    found = log_density_with_shared_error(rows, weight, AlongError.of(rows, slope, weight), shared_sd)
    for n in range(3):
        total = 0.0
        for t in range(4):
            here = weight[n, t] > 0
            along = shared_sd[n, t] * slope[n, t, here]
            covariance = np.diag(1 / weight[n, t, here]) + np.outer(along, along)
            density = stats.multivariate_normal(cov=covariance).logpdf(rows[n, t, here])
            total += density + 0.5 * here.sum() * np.log(2 * np.pi) - 0.5 * np.log(weight[n, t, here]).sum()
        assert found[n] == pytest.approx(total, rel=1e-10)


@pytest.mark.parametrize("count", [0, 1, 3])
def test_inverse_of_a_covariance_with_several_shared_errors(count: int) -> None:
    """Against the inverse and the determinant of the full matrix; an entry of weight zero does not count."""
    rng = np.random.default_rng(5)
    weight, shared = rng.uniform(0.5, 3.0, (4, 5)), rng.normal(size=(4, count, 5))
    weight[2, 1] = 0.0
    directions, log_determinant = shared_directions(weight, shared)
    rows = rng.normal(size=(4, 5))
    pulled = precision_times(weight, directions, rows)
    for row in range(4):
        here = weight[row] > 0
        v = shared[row][:, here]
        covariance = np.diag(1 / weight[row, here]) + v.T @ v
        found = np.diag(weight[row]) - directions[row].T @ directions[row]
        np.testing.assert_allclose(found[np.ix_(here, here)], np.linalg.inv(covariance), atol=1e-12)
        assert not found[~here].any()
        np.testing.assert_allclose(pulled[row, here], np.linalg.solve(covariance, rows[row, here]), atol=1e-12)
        assert not pulled[row, ~here].any()
        independent = -np.log(weight[row, here]).sum()
        np.testing.assert_allclose(log_determinant[row], np.linalg.slogdet(covariance)[1] - independent, atol=1e-12)


def test_density_with_several_shared_errors_is_that_of_scipy() -> None:
    rng = np.random.default_rng(4)
    rows, slopes, sd = rng.normal(size=(2, 3, 5)), rng.normal(size=(2, 2, 3, 5)), rng.uniform(0.5, 2, (2, 3, 5))
    weight = sd**-2.0
    weight[1, 2, 4] = 0.0  # left out
    found = log_density_with_shared_errors(rows, slopes, weight)
    for n in range(2):
        for t in range(3):
            there = weight[n, t] > 0
            directions = slopes[:, n, t, there]
            covariance = np.diag(sd[n, t, there] ** 2) + directions.T @ directions
            expected = stats.multivariate_normal(np.zeros(there.sum()), covariance).logpdf(rows[n, t, there])
            own = 0.5 * np.log(weight[n, t, there] / (2 * np.pi)).sum()
            assert found[n, t] + own == pytest.approx(expected, abs=1e-10)
