"""Drifts found from the other touches, against the joint normal distribution written out."""

from __future__ import annotations

import numpy as np

from bayestouch.finger.reading.drift import LOOSE, TouchEvidence, drift_of_others

T, M, K = 4, 2, 3


def evidence() -> TouchEvidence:
    rng = np.random.default_rng(2)
    root = rng.standard_normal((T, M, M))
    return TouchEvidence(
        residual=rng.standard_normal((T, M)),
        jacobian=rng.standard_normal((T, M, 3)),
        covariance=root @ root.swapaxes(1, 2) + 0.3 * np.eye(M),
        shift=rng.standard_normal((T, 3)),
        precision=rng.uniform(0.5, 3.0, (T, 3)),
    )


def without_own_coordinates(given: TouchEvidence, touch: int) -> tuple[np.ndarray, np.ndarray]:
    """Covariance and mean of the addition: coordinates are normal about their prior mean."""
    jacobian = given.jacobian[touch]
    spread = given.covariance[touch] + jacobian @ np.diag(1 / given.precision[touch]) @ jacobian.T
    return spread, given.residual[touch] - jacobian @ given.shift[touch]


def test_settings() -> None:
    np.testing.assert_array_equal(LOOSE, [4.0, 0.5, 1.0])


def test_what_a_touch_says_of_an_addition() -> None:
    given = evidence()
    precision, information = given.about_addition()
    for touch in range(T):
        spread, mean = without_own_coordinates(given, touch)
        np.testing.assert_allclose(precision[touch], np.linalg.inv(spread), rtol=1e-9)
        np.testing.assert_allclose(information[touch], np.linalg.solve(spread, mean), rtol=1e-9)


def test_drift_of_a_touch_is_told_by_the_others() -> None:
    """Standard normal weights given the additions of all other touches."""
    given = evidence()
    columns = np.random.default_rng(7).standard_normal((T, M, K))
    mean, covariance = drift_of_others(columns, *given.about_addition())
    for touch in range(T):
        precision, slope = np.eye(K), np.zeros(K)
        for other in set(range(T)) - {touch}:
            spread, told = without_own_coordinates(given, other)
            precision += columns[other].T @ np.linalg.solve(spread, columns[other])
            slope += columns[other].T @ np.linalg.solve(spread, told)
        np.testing.assert_allclose(mean[touch], columns[touch] @ np.linalg.solve(precision, slope), rtol=1e-8)
        wanted = columns[touch] @ np.linalg.solve(precision, columns[touch].T)
        np.testing.assert_allclose(covariance[touch], wanted, rtol=1e-8)
