"""Shifts of second order by the values of effects, against a written-out one."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.bend import FARTHEST, FEW, Bend, terms

CENTRE, COVARIANCE = np.array([0.1, 1.0]), np.array([[0.04, 0.01], [0.01, 0.09]])
ENDS = np.full(2, -np.inf), np.full(2, np.inf)


def shift(values: FloatArray) -> FloatArray:
    """A product of both, and a square."""
    a, b = values - CENTRE
    return np.array([3 * a * b, 2 * b**2 - a, 0.5])


def bend(size: float) -> Bend | None:
    return Bend.of(lambda values: (shift(values), size), CENTRE, COVARIANCE, ENDS, np.random.default_rng(1))


def test_a_polynomial_of_second_order_is_found() -> None:
    found = bend(1.0)
    assert found is not None
    values = np.array([[0.1, 1.0], [0.3, 0.8], [-0.2, 1.4]])
    np.testing.assert_allclose(found(values), [shift(each) for each in values], atol=1e-10)


def test_it_stays_what_it_is_beyond_four_standard_deviations() -> None:
    found = bend(1.0)
    assert found is not None and FARTHEST == 4.0
    root = np.linalg.cholesky(COVARIANCE)
    at, beyond = (CENTRE + root @ np.array([k, 0.0]) for k in (4.0, 9.0))
    np.testing.assert_allclose(found(beyond[None]), found(at[None]))


def test_slight_shifts_are_left_out() -> None:
    assert bend(0.4) is None


def test_terms() -> None:
    np.testing.assert_array_equal(terms(np.array([[2.0, 3.0]])), [[1, 2, 3, 4, 6, 9]])


def test_few_points_are_enough_where_nothing_bends() -> None:
    looked: list[float] = []

    def step(values: FloatArray) -> tuple[FloatArray, float]:
        looked.append(float(values[0]))
        return shift(values), 0.05

    assert Bend.of(step, CENTRE, COVARIANCE, ENDS, np.random.default_rng(1)) is None
    assert len(looked) == FEW
