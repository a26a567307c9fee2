"""A smooth function by inducing touches, against the normal distribution written out."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.pad.inducing import REST, InducedCovariance

N = 60
PLACE = np.sort(np.random.default_rng(0).uniform(0, 30, N))
NOISE = np.random.default_rng(1).uniform(0.01, 0.05, N) ** 2


def smooth(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Covariance of a function with a correlation length of 6."""
    return np.exp(-0.5 * ((one[:, None] - two) / 6.0) ** 2)


@pytest.fixture(scope="module")
def induced() -> InducedCovariance:
    return InducedCovariance.of(smooth(PLACE, PLACE), NOISE)


def dense(induced: InducedCovariance) -> np.ndarray:
    return induced.columns @ induced.columns.T + np.diag(induced.left + induced.noise)


def test_few_touches_say_what_all_do(induced: InducedCovariance) -> None:
    rest = smooth(PLACE, PLACE) - induced.columns @ induced.columns.T
    # 30 mm are five lengths: some fifteen functions
    assert len(induced.inducing) < 20
    assert np.abs(rest / np.sqrt(np.outer(NOISE, NOISE))).max() <= REST * (1 + 1e-9)
    np.testing.assert_allclose(induced.left, np.diag(rest), atol=1e-12)


def test_the_whole_covariance_with_a_small_rest() -> None:
    whole = InducedCovariance.of(smooth(PLACE, PLACE), NOISE, 1e-9)
    rows = np.random.default_rng(2).normal(size=N)
    expected = np.linalg.solve(smooth(PLACE, PLACE) + np.diag(NOISE), rows)
    np.testing.assert_allclose(whole.solve(rows), expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())


def test_at_most_so_many(induced: InducedCovariance) -> None:
    few = InducedCovariance.of(smooth(PLACE, PLACE), NOISE, most=4)
    np.testing.assert_array_equal(few.inducing, induced.inducing[:4])
    np.testing.assert_allclose(np.diag(dense(few)), 1.0 + NOISE, rtol=1e-12)


def test_products_are_those_of_the_inverse(induced: InducedCovariance) -> None:
    rows = np.random.default_rng(3).normal(size=(N, 3))
    inverse = np.linalg.inv(dense(induced))
    white = induced.whiten(rows)
    np.testing.assert_allclose(white.T @ white, rows.T @ inverse @ rows, rtol=1e-9)
    np.testing.assert_allclose(induced.solve(rows), inverse @ rows, rtol=1e-8, atol=1e-8 * np.abs(inverse).max())
    np.testing.assert_allclose(induced.whiten(rows[:, 0]), white[:, 0], rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(induced.precision_diagonal, np.diag(inverse), rtol=1e-9)
    part = np.array([3, 4, 40])
    np.testing.assert_allclose(
        induced.precision(part), inverse[np.ix_(part, part)], rtol=1e-8, atol=1e-9 * np.abs(inverse).max()
    )


def test_the_function_elsewhere(induced: InducedCovariance) -> None:
    """Mean and variance at new places; both are those of all touches, but for the rest."""
    there, rows = np.array([2.2, 15.0, 33.0]), np.sin(PLACE / 4)
    functions = induced.functions_at(smooth(there, PLACE[induced.inducing]))
    cross = smooth(there, PLACE)
    inverse = np.linalg.inv(smooth(PLACE, PLACE) + np.diag(NOISE))
    variance = 1 - np.einsum("kn,nm,km->k", cross, inverse, cross)
    missed = functions @ induced.weights(rows) - cross @ inverse @ rows
    assert (np.abs(missed) < 0.1 * np.sqrt(variance)).all()
    found = induced.variance_at(np.ones(3), functions)
    assert (np.abs(found - variance) < 0.03 * variance + REST * NOISE.max()).all()


def test_without_a_function_readings_are_independent() -> None:
    none, rows = InducedCovariance.independent(NOISE), np.random.default_rng(4).normal(size=(N, 2))
    np.testing.assert_allclose(none.solve(rows), rows / NOISE[:, None])
    np.testing.assert_allclose(none.whiten(rows), rows / np.sqrt(NOISE)[:, None])
    np.testing.assert_allclose(none.precision_diagonal, 1 / NOISE)
    assert none.weights(rows).shape == (0, 2)
    np.testing.assert_allclose(none.variance_at(np.zeros(2), np.zeros((2, 0))), 0.0)
