"""Greedy choices against normal distributions that are conditioned, and compared, as one large matrix."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from bayestouch.array_types import FloatArray
from bayestouch.model.planned import Group, PlannedReadings
from bayestouch.reliability.choice_of_touches import lowest_sd, most_decisive

N, M, D = 6, 3, 4


def readings(seed: int, d: int = D, shift: float = 0.0) -> PlannedReadings:
    rng = np.random.default_rng(seed)
    root, noise = rng.normal(size=(d, d)), rng.normal(size=(N, M, M))
    return PlannedReadings(
        mean=shift * rng.normal(size=(N, M)),
        columns=rng.normal(size=(N, M, d)),
        covariance=root @ root.T / d + 0.1 * np.eye(d),
        noise=noise @ noise.swapaxes(1, 2) + 0.5 * np.eye(M),
    )


def joint(planned: PlannedReadings, touches: list[int]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean, covariance and columns of all readings of some touches as one vector."""
    columns = planned.columns[touches].reshape(-1, planned.columns.shape[2])
    total = columns @ planned.covariance @ columns.T
    for i, touch in enumerate(touches):
        total[i * M : (i + 1) * M, i * M : (i + 1) * M] += planned.noise[touch]
    return planned.mean[touches].ravel(), total, columns


def conditioned(planned: PlannedReadings, touches: list[int]) -> FloatArray:
    """Covariance of the unknowns after some touches."""
    _, total, columns = joint(planned, touches)
    cross = planned.covariance @ columns.T
    return np.asarray(planned.covariance - cross @ np.linalg.inv(total) @ cross.T)


GROUPS = (
    Group("one", "mm", np.eye(D)[:1]),
    Group("others", "MPa", np.array([[0.0, 1.0, 0.5, 0.0], [0.0, 0.0, 1e3, 1e3]])),
)


def criterion(covariance: FloatArray) -> list[float]:
    """Mean variance of each group."""
    return [float(np.trace(each.rows @ covariance @ each.rows.T)) / len(each.rows) for each in GROUPS]


def test_each_step_takes_the_touch_that_lowers_the_relative_variances_most() -> None:
    planned = readings(1)
    choice = lowest_sd(planned, GROUPS, N)
    before = np.array(criterion(planned.covariance))
    np.testing.assert_allclose(choice.value[0], np.sqrt(before), rtol=1e-12)
    taken: list[int] = []
    left = 1.0
    for step in range(N):
        gains = np.full(N, np.nan)
        for touch in set(range(N)) - set(taken):
            gains[touch] = left - np.mean(criterion(conditioned(planned, [*taken, touch])) / before)
        np.testing.assert_allclose(choice.gain[step], gains, rtol=1e-8, atol=1e-12)
        assert choice.chosen[step] == np.nanargmax(gains)
        taken.append(int(choice.chosen[step]))
        left -= gains[taken[-1]]
        np.testing.assert_allclose(choice.value[step + 1], np.sqrt(criterion(conditioned(planned, taken))), rtol=1e-8)


def test_the_unit_of_a_group_does_not_matter() -> None:
    planned = readings(2)
    scaled = [GROUPS[0], Group("others", "Pa", 1e6 * GROUPS[1].rows)]
    np.testing.assert_array_equal(lowest_sd(planned, GROUPS, 4).chosen, lowest_sd(planned, scaled, 4).chosen)


def divergence(one: PlannedReadings, two: PlannedReadings, touches: list[int]) -> float:
    """Kullback-Leibler divergence of all readings of some touches, in closed form."""
    (mean, total, _), (other, wide, _) = joint(one, touches), joint(two, touches)
    inverse = np.linalg.inv(wide)
    volume = np.linalg.slogdet(wide)[1] - np.linalg.slogdet(total)[1]
    return float(0.5 * (np.trace(inverse @ total) - len(mean) + volume + (mean - other) @ inverse @ (mean - other)))


@pytest.mark.parametrize(("shift", "d"), [(2.0, D), (0.0, D + 3)])
def test_the_expected_log_bayes_factor_is_that_of_all_touches_together(shift: float, d: int) -> None:
    """With another mean, and with another covariance alone, as of two drifts."""
    one, two = readings(3, shift=shift), readings(4, d)
    choice = most_decisive(one, two, N)
    taken: list[int] = []
    for step in range(N):
        gains = np.full(N, np.nan)
        for touch in set(range(N)) - set(taken):
            both = [divergence(*pair, [*taken, touch]) for pair in ((one, two), (two, one))]
            gains[touch] = np.mean(both) - choice.value[step, 0]
        np.testing.assert_allclose(choice.gain[step], gains, rtol=1e-7, atol=1e-9)
        taken.append(int(choice.chosen[step]))
        assert taken[-1] == np.nanargmax(gains)


def test_the_closed_form_is_the_mean_log_ratio_of_densities() -> None:
    one, two = readings(5, shift=1.0), readings(6)
    touches = most_decisive(one, two, 2).chosen.tolist()
    first, second = (multivariate_normal(*joint(each, touches)[:2]) for each in (one, two))
    ratio = first.logpdf(y := first.rvs(20000, random_state=1)) - second.logpdf(y)
    back = second.logpdf(y := second.rvs(20000, random_state=2)) - first.logpdf(y)
    error = 0.5 * np.hypot(ratio.std(), back.std()) / np.sqrt(20000)
    expected = most_decisive(one, two, 2).value[-1, 0]
    assert abs(0.5 * (ratio.mean() + back.mean()) - expected) < 4 * error
    assert error < 0.02 * expected  # Monte Carlo error: a wrong factor of two would be far outside


def test_a_difference_that_the_other_parameters_imitate_does_not_count() -> None:
    """The models differ along a column whose weight is unknown: no touch tells them apart, however large this is."""
    one = readings(7)
    wide = PlannedReadings(one.mean, one.columns, 1e8 * np.eye(D), one.noise)
    moved = PlannedReadings(one.mean + one.columns @ np.array([3.0, 0, 0, 0]), one.columns, 1e8 * np.eye(D), one.noise)
    known = PlannedReadings(moved.mean, one.columns, 1e-8 * np.eye(D), one.noise)
    fixed = PlannedReadings(one.mean, one.columns, 1e-8 * np.eye(D), one.noise)
    assert most_decisive(wide, moved, 1).value[-1, 0] < 1e-5
    assert most_decisive(fixed, known, 1).value[-1, 0] > 1.0
