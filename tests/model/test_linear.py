"""What is known of parameters at a bound, against quadrature over the normal density that is cut off there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import dblquad

from bayestouch.model.linear import Linearised


def linear(slope: np.ndarray) -> Linearised:
    """Two correlated parameters at zero, with a slope of the log posterior."""
    root = np.array([[1.0, 0.6], [0.0, 0.8]])
    return Linearised(
        residual=np.linalg.solve(root.T, slope)[None],
        jacobian=root,
        deviation=np.zeros((0, 2)),
        deviation_jacobian=None,
        touch=np.zeros(0, dtype=np.int64),
        pull=np.zeros(2),
        precision=np.full(2, 0.1),
    )


@pytest.mark.parametrize("beyond", [0.0, 0.7, 3.0])
def test_mean_square_about_the_bound(beyond: float) -> None:
    """The first parameter would go below zero: its mean square, and what follows for the other."""
    hessian = linear(np.zeros(2)).hessian()
    covariance = np.linalg.inv(hessian)
    step = -beyond * covariance[:, 0] / np.sqrt(covariance[0, 0])
    model = linear(hessian @ step)
    held = model.holding(np.array([True, False]))

    def density(y: float, x: float) -> float:
        away = np.array([x, y]) - step
        return float(np.exp(-0.5 * away @ hessian @ away))

    reach = 9 * np.sqrt(np.diag(covariance))

    def moment(of: object) -> float:
        return float(dblquad(lambda y, x: of(x, y) * density(y, x), 0, reach[0], -reach[1], reach[1])[0])  # type: ignore[operator]

    mass = moment(lambda x, y: 1.0)
    squares = [[moment(lambda x, y: x * x), moment(lambda x, y: x * y)], [0.0, moment(lambda x, y: y * y)]]
    expected = np.array(squares) / mass
    expected[1, 0] = expected[0, 1]
    # dblquad works to 1.5e-8; the ridge of `conditioned` is 1e-10.
    np.testing.assert_allclose(held.covariance(), expected, rtol=1e-6, atol=1e-8)


def test_far_beyond_the_bound_the_covariance_is_still_one() -> None:
    hessian = linear(np.zeros(2)).hessian()
    covariance = np.linalg.inv(hessian)
    step = -1e7 * covariance[:, 0] / np.sqrt(covariance[0, 0])
    held = linear(hessian @ step).holding(np.array([True, False])).covariance()
    np.linalg.cholesky(held)
    # What is left of the other one is what it has where the first is known.
    assert held[1, 1] == pytest.approx(1 / hessian[1, 1], rel=1e-6)


def test_nothing_is_held_in_what_is_free() -> None:
    model = linear(np.zeros(2))
    held = model.holding(np.array([True, False]))
    assert held.free is model and model.free is model
    assert not held.jacobian[:, 0].any()
