"""Coordinates along a ridge, against a ridge written out by hand and its moments by quadrature."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from bayestouch.array_types import FloatArray
from bayestouch.sampling.bounds import normal_between
from bayestouch.sampling.ridge import Ridge, Ridges, follow, normal_variable, product_ridge

# Readings at two times t of share (1 - exp(-t/time)) + level, their noise, and the priors. Both times are shorter than
# the time constant, so that the readings determine little but share/time.
TIMES, READ, NOISE = np.array([0.2, 0.5]), np.array([0.05, 0.11]), 0.004
SHARE_SD, LEVEL_SD, LOG_TIME, LOG_TIME_SD = 0.3, 0.02, 0.5, 1.2
MODE = np.array([0.0, 0.3, 0.5])
BOUNDS = np.full(3, -np.inf), np.full(3, np.inf)


def rows(vectors: FloatArray) -> FloatArray:
    """Whitened residuals (n, 5) of readings and priors at vectors (n, 3): level, share and log time."""
    level, share, log_time = vectors.T
    shape = 1 - np.exp(-TIMES / np.exp(log_time)[:, None])
    read = (level[:, None] + share[:, None] * shape - READ) / NOISE
    return np.column_stack([read, level / LEVEL_SD, share / SHARE_SD, (log_time - LOG_TIME) / LOG_TIME_SD])


def log_density(vectors: FloatArray) -> FloatArray:
    return np.asarray(-0.5 * (rows(vectors) ** 2).sum(axis=1))


def linearise(vector: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gradient and Gauss-Newton precision by central differences."""
    step = 1e-5 * np.eye(3)
    slope = (rows(vector + step) - rows(vector - step)) / 2e-5
    return -slope @ rows(vector[None])[0], slope @ slope.T


def along(scaled: list[int], moved: list[int]) -> Ridge:
    found = follow(
        linearise, MODE, 2, BOUNDS, (LOG_TIME, LOG_TIME_SD), np.array(scaled, dtype=int), np.array(moved, dtype=int)
    )
    assert found is not None
    return found


def quadrature(least: float = -1.5, most: float = 3.0) -> tuple[FloatArray, FloatArray]:
    """Means and standard deviations of share, between two values, and log time; the level is integrated out by hand."""
    share, log_time = np.meshgrid(np.linspace(least, most, 4001), np.linspace(-5.0, 6.0, 1001), indexing="ij")
    shape = 1 - np.exp(-TIMES / np.exp(log_time)[..., None])
    left = READ - share[..., None] * shape
    covariance = NOISE**2 * np.eye(2) + LEVEL_SD**2
    squares = np.einsum("...i,ij,...j->...", left, np.linalg.inv(covariance), left)
    density = np.exp(-0.5 * (squares + (share / SHARE_SD) ** 2 + ((log_time - LOG_TIME) / LOG_TIME_SD) ** 2))
    weight = density / density.sum()
    means = np.array([(weight * each).sum() for each in (share, log_time)])
    squares = np.array([(weight * each**2).sum() for each in (share, log_time)])
    return means, np.sqrt(squares - means**2)


def moments(values: FloatArray, log_weight: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Effective number of weighted points, and their means and standard deviations."""
    weight = np.exp(log_weight - log_weight.max())
    found = weight @ values / weight.sum()
    spread = np.sqrt(weight @ (values - found) ** 2 / weight.sum())
    return float(weight.sum() ** 2 / (weight**2).sum()), found, spread


def test_moments_are_those_of_quadrature() -> None:
    """The draws reach along the whole ridge: standard deviations to 2 %, at which 5 % would be noticed."""
    to_vectors, n = Ridges((along([1], [0]),)), 100_000
    covariance = np.linalg.inv(linearise(MODE)[1])
    level = np.sqrt(covariance[0, 0])
    z = np.random.default_rng(1).standard_normal((n, 3))
    vectors, log_derivative = to_vectors(z * [level, 1.0, 1.0])
    log_weight = log_density(vectors) + log_derivative + 0.5 * (z**2).sum(axis=1)
    effective, found, spread = moments(vectors[:, 1:], log_weight)
    assert effective > 0.2 * n
    means, sds = quadrature()
    assert (found - means) / sds == pytest.approx(0.0, abs=0.02)
    assert spread == pytest.approx(sds, rel=0.02)


@pytest.mark.parametrize("ends", [(0.15, 0.45), (-1.0, 0.2), (0.6, 2.0), (-1.0, -0.05)])
def test_moments_where_the_ridge_runs_along_a_bound(ends: tuple[float, float]) -> None:
    """The share has bounds, so that the ridge follows one of them for a part of its way; the mode may be at it."""
    n, bounds = 100_000, (np.array([-np.inf, ends[0], -np.inf]), np.array([np.inf, ends[1], np.inf]))
    mode = np.clip(MODE, *bounds)
    ridge = follow(linearise, mode, 2, bounds, (LOG_TIME, LOG_TIME_SD), np.array([1]), np.zeros(0, dtype=int))
    assert ridge is not None
    z = np.random.default_rng(1).standard_normal((n, 3))
    low, high = ridge.limits(z[:, 2], bounds)
    share, more = normal_between(z[:, 1], low[:, 0], high[:, 0])
    vectors, log_derivative = ridge(np.column_stack([z[:, 0], share, z[:, 2]]))
    # Given the share and the time the level is normal.
    sd = (2 * NOISE**-2 + LEVEL_SD**-2) ** -0.5
    shape = 1 - np.exp(-TIMES / np.exp(vectors[:, 2:]))
    vectors[:, 0] = (READ - vectors[:, 1:2] * shape).sum(axis=1) * (sd / NOISE) ** 2 + sd * z[:, 0]
    assert vectors[:, 1].min() >= ends[0] - 1e-12 and vectors[:, 1].max() <= ends[1] + 1e-12
    log_weight = log_density(vectors) + log_derivative + more + 0.5 * (z**2).sum(axis=1)
    effective, found, spread = moments(vectors[:, 1:], log_weight)
    assert effective > 0.1 * n
    means, sds = quadrature(*ends)
    assert (found - means) / sds == pytest.approx(0.0, abs=0.03)
    assert spread == pytest.approx(sds, rel=0.03)


def test_without_a_bend_in_the_other_entries_the_points_are_those_of_the_posterior() -> None:
    """Share relative to its most probable value: independent, standard normal, at every time."""
    ridge = along([0, 1], [])
    z = np.random.default_rng(2).standard_normal((20_000, 3))
    # Given the time, level and share are normal exactly. Their correlation is not part of the map.
    vectors, _ = ridge(z)
    slope = np.stack([np.ones((2, len(z))), 1 - np.exp(-TIMES[:, None] / np.exp(vectors[:, 2]))], axis=-1) / NOISE
    precision = np.einsum("tni,tnj->nij", slope, slope) + np.diag([LEVEL_SD**-2, SHARE_SD**-2])
    covariance = np.linalg.inv(precision)
    centre = np.einsum("nij,tnj,t->ni", covariance, slope, READ / NOISE)
    sd = np.sqrt(np.einsum("nii->ni", covariance))
    inside = np.abs(z[:, 2]) < 3
    assert (((vectors[:, :2] - centre) / sd)[inside]) == pytest.approx(z[inside, :2], abs=0.05)


def test_log_derivative_and_tangent() -> None:
    ridge = along([1], [0])
    for point in (np.array([0.01, -0.4, 0.3]), np.array([-0.02, 1.5, -2.2])):
        step = 1e-5 * np.eye(3)
        numerical = ((ridge(point + step)[0] - ridge(point - step)[0]) / 2e-5).T
        assert ridge.tangent(point) == pytest.approx(numerical, rel=1e-4, abs=1e-7)
        assert ridge(point[None])[1][0] == pytest.approx(np.linalg.slogdet(numerical)[1], abs=1e-5)


def test_quantiles_of_a_normal_density() -> None:
    values = np.linspace(-12.0, 20.0, 4001)
    z, at = normal_variable(values, -0.5 * ((values - 3) / 2) ** 2)
    assert z == pytest.approx((at - 3) / 2, abs=1e-4)
    assert z[0] < -4.9 and z[-1] > 4.9 and (np.diff(z) > 0).all()


def test_a_density_that_is_at_one_end_has_no_quantiles() -> None:
    """All of it is in the last interval of the table: no value is within five standard deviations."""
    z, at = normal_variable(np.linspace(0.0, 1.0, 50), np.linspace(0.0, 1e6, 50))
    assert len(z) == len(at) == 0


def test_no_ridge_leaves_points_as_they_are() -> None:
    points = np.array([[1.0, 2.0]])
    vectors, log_derivative = Ridges()(points)
    np.testing.assert_array_equal(vectors, points)
    np.testing.assert_array_equal(log_derivative, 0.0)


def test_a_ridge_ends_where_the_posterior_cannot_be_computed() -> None:
    def limited(vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        gradient, precision = linearise(vector)
        return (gradient if vector[2] < 1.0 else gradient * np.nan), precision

    prior = (LOG_TIME, LOG_TIME_SD)
    none = np.zeros(0, dtype=int)
    found = follow(limited, MODE, 2, BOUNDS, prior, np.array([1]), none)
    assert found is not None and found.ends[0] < -2.0 and 0.5 <= found.ends[1] < 1.0
    beyond = np.array([0.0, 0.3, 2.5])
    assert follow(limited, beyond, 2, BOUNDS, prior, np.array([1]), none) is None


@pytest.mark.parametrize("factor", [0.1, -0.1])
def test_products_are_constant_along_their_ridge(factor: float) -> None:
    """Two products of a factor; entry 1 is another. The factor's quantiles are those of the priors, by quadrature."""
    vector, own = np.array([factor, 7.0, 0.2, -0.1]), np.array([2, 3])
    prior, priors = (0.0, 0.1), [(0.0, 0.5), (0.1, 0.4)]
    ridge = product_ridge(vector, 0, own, prior, priors)
    z = np.linspace(-3, 3, 7)
    points = np.column_stack([z, np.full((7, 1), 7.0), np.tile(vector[own], (7, 1))])
    vectors, log_derivative = ridge(points)
    np.testing.assert_allclose(vectors[:, :1] * (1 + vectors[:, own]), np.tile(factor * (1 + vector[own]), (7, 1)))
    np.testing.assert_array_equal(vectors[:, 1], 7.0)
    for point, log_size in zip(points, log_derivative, strict=True):
        step = 1e-5 * np.eye(4)
        jacobian = (ridge(point + step)[0] - ridge(point - step)[0]) / 2e-5
        np.testing.assert_allclose(jacobian, ridge.tangent(point).T, rtol=1e-5, atol=1e-7)
        assert np.log(abs(np.linalg.det(jacobian))) == pytest.approx(log_size, abs=1e-5)
    size = np.linspace(0.0, 1.0, 200_001)[1:]
    log_density = -0.5 * (size / 0.1) ** 2 - 2 * np.log(size)
    for at, (mean, sd) in zip(own, priors, strict=True):
        log_density -= 0.5 * ((abs(factor) * (1 + vector[at]) / size - 1 - mean) / sd) ** 2
    weight = np.exp(log_density - log_density.max())
    below = np.interp(np.abs(vectors[:, 0]), size, np.cumsum(weight) / weight.sum())
    # The table has steps of 0.6 % of the factor, a fiftieth of its sd.
    np.testing.assert_allclose(below, norm.cdf(z if factor > 0 else -z), atol=1e-3)
    assert not ridge.has_limits((np.zeros(4), np.ones(4)))
