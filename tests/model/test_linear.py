"""What is known of parameters at a bound, against quadrature over the normal density that is cut off there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import dblquad
from scipy.optimize import nnls

from bayestouch.model.linear import Linearised, Score, Scorer, beyond_bound, conditioned, step_within


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


def scores() -> Score:
    return Score(np.array([6.0, 3.0]), np.array([[9.0, 2.0], [2.0, 4.0]]), np.array([10.0, 16.0]))


def test_scores_of_two_columns() -> None:
    """Seen share 13 of 26; chi-square sᵀ I⁻¹ s with I⁻¹ = (4, -2; -2, 9)/32; one step with prior precision 1 and 2."""
    score = scores()
    assert score.seen == 0.5
    assert score.chi_square() == pytest.approx((4 * 36 - 2 * 2 * 18 + 9 * 9) / 32, rel=1e-6)
    # (10, 2; 2, 6) x = (6, 3): x = (30, 18)/56
    np.testing.assert_allclose(score.estimate(np.array([1.0, 2.0])), [30 / 56, 18 / 56])
    assert Score(np.zeros(1), np.ones((1, 1)), np.zeros(1)).seen == 0.0
    # The same column twice tests no more than once: s²/I.
    twice = Score(np.array([6.0, 6.0]), np.full((2, 2), 9.0), np.array([10.0, 10.0]))
    assert twice.chi_square() == pytest.approx(36 / 9, rel=1e-6)


def test_scores_take_out_what_parameters_absorb() -> None:
    """A column half along a parameter; samples within touches beside it."""
    model = Linearised(
        residual=np.array([[1.0, 2.0]]),
        jacobian=np.array([[1.0], [0.0]]),
        deviation=np.array([[3.0, 0.0]]),
        deviation_jacobian=np.array([[2.0], [0.0]]),
        touch=np.zeros(1, dtype=np.int64),
        pull=np.zeros(1),
        precision=np.array([4.0]),
    )
    # Precision of the parameter 1 + 4 + 4 = 9.
    score = Scorer(model)(np.array([[[3.0, 4.0]]]))
    assert (score.slope[0], score.raw[0]) == (11.0, 25.0)
    assert score.information[0, 0] == pytest.approx(25 - 3 * 3 / 9, rel=1e-9)
    score = Scorer(model)(np.array([[[3.0, 4.0]]]), np.array([[[5.0, 6.0]]]))
    assert (score.slope[0], score.raw[0]) == (11 + 15.0, 25 + 61.0)
    assert score.information[0, 0] == pytest.approx(25 + 61 - (3 + 10) ** 2 / 9, rel=1e-9)


def test_cost_gradient_and_step() -> None:
    """Half of all squares; where nothing would leave, one step goes to the maximum."""
    model = Linearised(
        residual=np.array([[1.0, 2.0]]),
        jacobian=np.array([[1.0], [0.5]]),
        deviation=np.array([[3.0, 1.0]]),
        deviation_jacobian=np.array([[2.0], [1.0]]),
        touch=np.zeros(1, dtype=np.int64),
        pull=np.array([0.7]),
        precision=np.array([4.0]),
    )
    assert model.cost() == pytest.approx(0.5 * (5 + 10 + 4 * 0.49))
    assert model.gradient()[0] == pytest.approx(4 * 0.7 + 1 + 1 + 6 + 1)
    assert model.hessian()[0, 0] == pytest.approx(1.25 + 5 + 4)
    step, held = model.step_within(lambda step: step < 0)
    assert step[0] == pytest.approx(11.8 / 10.25, rel=1e-9) and not held.any()
    step, held = model.step_within(lambda step: step > 0)
    assert step[0] == 0.0 and held.all()
    # At a bound a parameter does not move, but its prior still says how improbable it is there.
    fixed = model.holding(held)
    assert fixed.gradient()[0] == 0.0 and fixed.cost() == model.cost()
    assert model.weights().shape == (0,)
    kept = model.holding(held)
    assert kept.pull[0] == 0 and not kept.jacobian.any() and kept.deviation_jacobian is not None
    assert not kept.deviation_jacobian.any() and kept.free is model


@pytest.mark.parametrize("beyond", [0.0, 0.4, 5.0, 40.0])
def test_mean_square_beyond_a_bound(beyond: float) -> None:
    """Of a truncated normal about its end, by scipy; far out 2/x²."""
    away = stats.truncnorm(beyond, np.inf)
    wanted = away.var() + (away.mean() - beyond) ** 2
    # scipy's own variance loses digits far out: 1 - mean·(mean - x) is a difference of large numbers.
    assert beyond_bound(beyond) == pytest.approx(wanted, rel=1e-3 if beyond > 10 else 1e-9)
    assert beyond_bound(999.0) == pytest.approx(2 / 999.0**2, rel=1e-3)
    assert beyond_bound(1001.0) == 2 / 1001.0**2 and beyond_bound(1e9) == 1e-8


def test_what_nothing_fixes_does_not_fail_the_factor() -> None:
    np.testing.assert_array_equal(conditioned(np.diag([2.0, 0.0])), np.diag([2.0 + 2e-10, 1e-300]))


def test_a_bound_far_beyond_is_as_good_as_a_known_value() -> None:
    """The other parameter is then cut off about its mode and variance where the first is zero."""
    covariance = np.array([[1.0, 0.6], [0.6, 2.0]])
    hessian = np.linalg.inv(covariance)
    root = np.linalg.cholesky(hessian - 0.1 * np.eye(2)).T
    step = np.array([-500.0, -301.5])
    model = Linearised(
        residual=np.linalg.solve(root.T, hessian @ step)[None],
        jacobian=root,
        deviation=np.zeros((0, 2)),
        deviation_jacobian=None,
        touch=np.zeros(0, dtype=np.int64),
        pull=np.zeros(2),
        precision=np.full(2, 0.1),
    )
    held = model.holding(np.array([True, True])).covariance()
    # Given zero for the first the second would go to -301.5 + 0.6 · 500 = -1.5, with variance 2 - 0.36.
    variance = 2 - 0.36
    assert held[1, 1] == pytest.approx(variance * beyond_bound(1.5 / np.sqrt(variance)), rel=1e-3)
    # The ridge of `conditioned` counts in the difference of large numbers.
    assert held[0, 0] == pytest.approx(beyond_bound(500.0), rel=1e-4)


def test_one_of_two_is_held() -> None:
    """The other goes on to its own maximum: slope 4 · 0.75 over precision 8 + 4."""
    model = Linearised(
        residual=np.array([[1.0, 1.0]]),
        jacobian=np.array([[1.0, 2.0], [1.0, -2.0]]),
        deviation=np.zeros((0, 2)),
        deviation_jacobian=None,
        touch=np.zeros(0, dtype=np.int64),
        pull=np.array([0.5, 0.75]),
        precision=np.array([2.0, 4.0]),
    )
    step, held = model.step_within(lambda step: (step > 0) & np.array([True, False]))
    assert held.tolist() == [True, False] and step[0] == 0.0
    assert step[1] == pytest.approx((4 * 0.75 + 2 - 2) / (8 + 4), rel=1e-9)
    step, held = model.step_within(lambda step: np.zeros(2, dtype=bool))
    np.testing.assert_allclose(step, [(2 * 0.5 + 2) / 4, 3 / 12], rtol=1e-9)


def test_step_between_bounds_is_the_constrained_maximum() -> None:
    """All are at a lower bound: nonnegative least squares. One that leaves only with another one is not held."""
    rng = np.random.default_rng(5)
    for _ in range(200):
        root, wanted = rng.standard_normal((6, 5)) @ (np.eye(5) + 0.9), rng.standard_normal(6)
        step, held = step_within(root.T @ root, root.T @ wanted, lambda step: step < 0)
        # The matrix is conditioned by a share of 1e-10.
        np.testing.assert_allclose(step, nnls(root, wanted)[0], rtol=1e-5, atol=1e-6)
        assert not step[held].any()


def test_of_two_that_leave_together_only_one_is_held() -> None:
    """The unconstrained step is (-4.8, -4.2); with the first at its bound the second goes to 0.1."""
    matrix, slope = np.array([[1.0, -0.9], [-0.9, 1.0]]), np.array([-1.0, 0.1])
    step, held = step_within(matrix, slope, lambda step: step < 0)
    assert held.tolist() == [True, False]
    np.testing.assert_allclose(step, [0.0, 0.1], rtol=1e-8)
