"""Held-out densities against the same normal distributions written out and conditioned fold by fold."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from bayestouch.model.columns import WhiteColumns
from bayestouch.model.linear import Functions, Linearised
from bayestouch.model.predictive import gained, held_out_density, precision_of_all

T, M, D = 5, 2, 2
FOLD = np.array([0, 1, 0, 2, 1])


def model(*, functions: bool, samples: bool) -> tuple[Linearised, np.ndarray]:
    """At its mode, as fits leave it; and the dense columns (t m, k) of its random functions."""
    rng = np.random.default_rng(5)
    raw = rng.standard_normal((3, T, M))
    raw[0, :, 1] = raw[1, :, 0] = 0  # functions of one element each, and one of both
    dense = raw.reshape(3, T * M).T if functions else np.zeros((T * M, 0))
    white = Functions.of(raw, WhiteColumns.of(raw, np.tile(np.eye(M), (T, 1, 1)))) if functions else None
    n = 8
    jacobian, deviation = rng.standard_normal((T * M, D)), rng.standard_normal((n, M))
    within = rng.standard_normal((n * M, D)) if samples else None
    residual, precision = rng.standard_normal((T, M)), np.array([0.5, 2.0])
    made = Linearised(
        residual=residual,
        jacobian=jacobian,
        deviation=deviation,
        deviation_jacobian=within,
        touch=np.array([0, 0, 1, 2, 2, 3, 4, 4]),
        pull=rng.standard_normal(D),
        precision=precision,
        functions=white,
    )
    return made, dense


@pytest.mark.parametrize(("functions", "samples"), [(False, False), (True, False), (False, True), (True, True)])
def test_density_of_touches_from_those_of_other_folds(functions: bool, samples: bool) -> None:
    """Parameters and weights are normal given the other folds; each touch is judged by itself."""
    made, dense = model(functions=functions, samples=samples)
    k = dense.shape[1]
    design = np.concatenate([made.jacobian, dense], axis=1).reshape(T, M, D + k)
    own = np.diag([*made.precision, *np.ones(k)])
    found = held_out_density(made, FOLD)
    for touch in range(T):
        other = FOLD[touch] != FOLD
        rows = design[other].reshape(-1, D + k)
        hessian = own + rows.T @ rows
        slope = np.concatenate([made.precision * made.pull, np.zeros(k)]) + rows.T @ made.residual[other].ravel()
        if made.deviation_jacobian is not None:
            inside = other[made.touch]
            within = made.deviation_jacobian.reshape(-1, M, D)[inside].reshape(-1, D)
            hessian[:D, :D] += within.T @ within
            slope[:D] += within.T @ made.deviation[inside].ravel()
        covariance = np.linalg.inv(hessian)
        mode = covariance @ slope
        error = made.residual[touch] - design[touch] @ mode
        predicted = design[touch] @ covariance @ design[touch].T + np.eye(M)
        density = stats.multivariate_normal(np.zeros(M), predicted).logpdf(error) + 0.5 * M * np.log(2 * np.pi)
        left = made.deviation[made.touch == touch]
        if made.deviation_jacobian is not None:
            left = left - made.deviation_jacobian.reshape(-1, M, D)[made.touch == touch] @ mode[:D]
        wanted = [density, -0.5 * (left**2).sum(), -0.5 * (error**2).sum()]
        # `conditioned` adds 1e-10 of the diagonal.
        np.testing.assert_allclose(found[touch], wanted, rtol=1e-7, atol=1e-8)


@pytest.mark.parametrize("functions", [False, True])
def test_precision_of_parameters_and_weights(functions: bool) -> None:
    made, dense = model(functions=functions, samples=True)
    assert made.deviation_jacobian is not None
    columns = np.concatenate([made.jacobian, dense], axis=1)
    wanted = columns.T @ columns + np.diag([*made.precision, *np.ones(dense.shape[1])])
    wanted[:D, :D] += made.deviation_jacobian.T @ made.deviation_jacobian
    np.testing.assert_allclose(precision_of_all(made), wanted, rtol=1e-12)


def test_density_of_all_readings() -> None:
    """That of the means and that of the deviations; the squared errors do not count."""
    np.testing.assert_array_equal(gained(np.array([[1.0, 2.0, 100.0], [3.0, 5.0, 100.0]])), [3.0, 8.0])
