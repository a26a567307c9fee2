"""Planned touches by a fit: a fit without drifts, and drifts against the exact process conditioned on the data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pad_cases import CASES, recovered

from bayestouch.data.averages import TouchMeans
from bayestouch.model.correction import fit_correction
from bayestouch.model.fitting import Fitted, fit
from bayestouch.model.planned_fit import planned_readings

CROSSTALK = next(case for case in CASES if case.name == "crosstalk")
DRIFTS = [case for case in CASES if case.name.endswith("_drift")]


def matern(time: np.ndarray, length: float) -> np.ndarray:
    """Correlation (t, t): (1 + √3 d/l) exp(-√3 d/l)."""
    lag = np.sqrt(3) * np.abs(time[:, None] - time) / length
    return np.asarray((1 + lag) * np.exp(-lag))


def some_touches(fitted: Fitted, later: tuple[float, ...]) -> TouchMeans:
    """Touches like some of the fit, at times after its end."""
    means = fitted.model.known.means.select(np.arange(0, 40, 40 // len(later))[: len(later)])
    zero = np.where(np.isnan(means.readings), np.nan, 0.0)
    return replace(means, readings=zero, time_s=np.array(later))


def test_without_drifts_mean_and_covariance_are_those_of_the_fit() -> None:
    fitted = recovered(CROSSTALK, 1).fitted
    touches = some_touches(fitted, (np.nan, 5.0, 1e3))
    found = planned_readings(fitted, touches)
    covariance = fitted.linear.covariance()
    sd = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(found.covariance / np.outer(sd, sd), covariance / np.outer(sd, sd), atol=1e-6)
    rows = np.arange(0, 40, 13)[:3]
    here = fitted.model.predict(fitted.vector).touches[rows]
    # The fit ends when a step gains less than 0.05: what is left is far below the uncertainty.
    spread = np.sqrt(np.diagonal(found.total - found.noise, axis1=1, axis2=2))
    assert (np.abs(found.mean - here) < 0.35 * spread + 1e-9).all()
    derivatives = fitted.model.derivatives(fitted.vector)[0]
    np.testing.assert_allclose(found.columns, np.moveaxis(derivatives[:, rows], 0, -1), rtol=1e-9, atol=1e-9)


def test_the_mean_is_that_of_data_and_prior_together() -> None:
    """Written out, with residuals and a prior that is as certain as the data and one standard deviation away."""
    fitted = recovered(CROSSTALK, 1).fitted
    sd = np.sqrt(np.diag(fitted.linear.covariance()))
    linear = replace(fitted.linear, residual=fitted.linear.residual + 1.0, precision=sd**-2, pull=sd)
    touches = some_touches(fitted, (0.0, 0.0, 0.0))
    found = planned_readings(replace(fitted, linear=linear), touches)
    jacobian, within = linear.jacobian, linear.deviation_jacobian
    assert within is None
    information = jacobian.T @ jacobian + np.diag(sd**-2)
    step = np.linalg.solve(information, jacobian.T @ linear.residual.ravel() + sd / sd**2)
    expected = fitted.model.predict(fitted.vector).touches[np.arange(0, 40, 13)[:3]] + found.columns @ step
    np.testing.assert_allclose(found.mean, expected, rtol=1e-6)


def planned_load_sd(fitted: Fitted, reads: np.ndarray) -> np.ndarray:
    """Errors of the loads (t,) of planned touches, N: elements 1 and 2 share them, and nothing else."""
    touches = replace(some_touches(fitted, (0.0, 0.0, 0.0)), load_reads=reads)
    covariance = planned_readings(fitted, touches).noise
    by_load = fitted.model.by_load(fitted.vector)[np.arange(0, 40, 13)[:3]]
    return np.asarray(np.sqrt(covariance[:, 0, 1] / (by_load[:, 0] * by_load[:, 1])))


def test_a_planned_load_has_the_noise_of_its_readings() -> None:
    fitted = recovered(CROSSTALK, 1).fitted
    one = np.median(fitted.noise.load_sd * np.sqrt(fitted.model.known.means.reads_of_load))
    reads = np.array([1.0, 4.0, 2500.0])
    np.testing.assert_allclose(planned_load_sd(fitted, reads), one / np.sqrt(reads), rtol=1e-3)


def test_loads_that_were_not_measured_are_no_better_for_more_readings() -> None:
    fitted = recovered(CROSSTALK, 1).fitted
    known = fitted.model.known
    means = replace(known.means, load=np.full_like(known.means.load, np.nan))
    fitted = replace(fitted, model=fitted.model.observing(replace(known, means=means)))
    found = planned_load_sd(fitted, np.array([1.0, 4.0, 2500.0]))
    np.testing.assert_allclose(found, np.median(fitted.noise.load_sd), rtol=1e-3)


@pytest.mark.parametrize("case", DRIFTS, ids=lambda case: case.key)
def test_a_drift_goes_on_as_the_exact_process_does(case: object) -> None:
    """Readings of the data and of the planned touches as one normal distribution, with dense matrices."""
    fitted = recovered(case, 1).fitted  # type: ignore[arg-type]
    (drift, values) = fitted.drifts[0]
    fitted = fit(fitted.model, fitted.vector, fitted.noise, ((drift.with_dense_knots(), values),))
    model, linear, root = fitted.model, fitted.linear, fitted.whitening.root
    length = values[1]
    later = (0.0, 0.3 * length, length, 30 * length)
    touches = some_touches(fitted, later)
    found = planned_readings(fitted, touches)
    own = drift.own(values)
    m = model.n_elements
    derivatives = np.moveaxis(model.derivatives(fitted.vector)[0], 0, -1)
    rows = np.arange(0, 40, 10)
    here = model.predict(fitted.vector).touches - model.zero(fitted.vector)
    scale = np.tile(model.peak, (len(here), 1)) if drift.name == "baseline_drift" else here
    time = np.concatenate([model.known.touch_time_s, model.known.span[1] + np.array(later)])
    scales = np.concatenate([scale, scale[rows]])
    between = np.eye(m) if own else np.ones((m, m))
    process = values[0] ** 2 * np.einsum("tu,ef,te,uf->teuf", matern(time, length), between, scales, scales)
    n, t = len(here), len(time)
    whole = process.reshape(t * m, t * m)
    columns = np.concatenate([derivatives, derivatives[rows]]).reshape(t * m, -1)
    whole = whole + columns / linear.precision @ columns.T
    white = np.zeros((n * m, n * m))
    for i, each in enumerate(root):
        white[i * m : (i + 1) * m, i * m : (i + 1) * m] = each
    data = white @ whole[: n * m, : n * m] @ white.T + np.eye(n * m)
    cross = whole[n * m :, : n * m] @ white.T
    gain = np.linalg.solve(data, cross.T).T
    expected = whole[n * m :, n * m :] - gain @ cross.T
    columns = found.columns.reshape(len(later) * m, -1)
    covariance = columns @ found.covariance @ columns.T
    scale_of = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # Between knots the functions have 6 % less sd than the process; most of a variance is at the knots or shared.
    assert np.abs(covariance - expected).max() < 0.06 * scale_of.max()
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), np.sqrt(np.diag(expected)), rtol=0.06)
    if (drift.name, own) == ("baseline_drift", True):
        variance = np.diag(covariance).reshape(len(later), m)
        assert (np.diff(variance, axis=0) > 0).all()  # the longer after the end, the less is known
    shift = gain @ (linear.residual.ravel() - linear.jacobian @ linear.pull)
    pull = columns[:, : len(fitted.vector)] @ linear.pull
    mean = (model.predict(fitted.vector).touches[rows]).ravel() + pull + shift
    assert (np.abs(found.mean.ravel() - mean) < 0.25 * np.sqrt(np.diag(expected))).all()


def test_functions_of_place_are_added() -> None:
    fitted = recovered(CROSSTALK, 1).fitted
    less = fit(fitted.model.with_effects(()), fitted.vector[: fitted.model.n_base], fitted.noise)
    correction = fit_correction(less)
    touches = some_touches(fitted, (0.0, 0.0, 0.0))
    alone = planned_readings(less, touches)
    assert correction is not None
    both = planned_readings(less, touches, correction)
    assert both.columns.shape[2] > alone.columns.shape[2]
    assert (np.diagonal(both.total, axis1=1, axis2=2) >= 0.9 * np.diagonal(alone.total, axis1=1, axis2=2)).all()
