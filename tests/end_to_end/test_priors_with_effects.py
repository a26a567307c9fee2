"""Fits with effects against normal distributions written out: priors, covariances and drifts."""

from __future__ import annotations

import crosstalk
import numpy as np
import pytest
import written_out as w
from calibrated_files import Calibrated

from bayestouch.effects.element import Crosstalk
from bayestouch.effects.random import BaselineDrift, GainDrift, RandomEffect
from bayestouch.finger.reading.drift import TouchEvidence, drift_of_others
from bayestouch.finger.start import base_fit
from bayestouch.model.fitting import Fitted, fit
from bayestouch.model.split_data import SplitData

M = w.ELEMENTS


@pytest.fixture(scope="module")
def data(with_crosstalk: Calibrated) -> SplitData:
    return SplitData.of_calibration(w.dataset(with_crosstalk.table, with_crosstalk.table))


@pytest.fixture(scope="module")
def base(data: SplitData) -> Fitted:
    return base_fit(data.observations(data.training), data.dataset.sensor, "layer")


def test_readings_that_say_nothing_leave_every_prior_as_it_is(data: SplitData, base: Fitted) -> None:
    """Noise a million times too large: mode and covariance are those of the priors, base parameters and effect alike.

    Their means are as built; the response's is the largest reading over load near the element, within a factor of 3.
    """
    effect = Crosstalk.suited(data.setting("layer", base.model.reference_load))
    assert effect is not None
    model = base.model.with_effects((effect,))
    deaf = base.noise.with_(sd=1e6 * base.noise.sd, load_sd=base.noise.load_sd)
    found = fit(model, model.extended(base.vector, (0.05, 0.25, 0.1)), deaf)
    logarithms = np.concatenate([np.ones(M), base.vector[M:]])
    sd = crosstalk.prior_sd(np.concatenate([logarithms, [0.0, 0.3, 0.0]]))
    covariance = found.linear.covariance()
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), sd, rtol=1e-3)
    correlation = covariance / np.outer(sd, sd) - np.eye(len(sd))
    assert np.abs(correlation).max() < 1e-3
    built = [np.full(M, w.DEPTH), np.radians(w.ANGLES), [0.46, np.log(0.15), 0.0, 0.5, 0.0]]
    np.testing.assert_allclose(found.vector[M:], np.concatenate(built), atol=1e-3)
    means = data.table.averaged()
    assert means.angle_deg is not None
    near = np.abs(means.angle_deg[:, None] - np.array(w.ANGLES)) < 15
    largest = np.where(near, means.readings / means.load[:, None], 0.0).max(axis=0)
    np.testing.assert_allclose(np.exp(found.vector[:M]), largest, rtol=1e-3)


def test_draws_with_effects_on_file_spread_as_readings_and_priors_say(with_crosstalk: Calibrated) -> None:
    """All twenty parameters against the normal distribution at the mode, with the noise that the draws have.

    4,000 draws of an effective size of about 2,000: the mean ratio of 20 variances is good to 0.7 %, each sd to 1.6 %.
    The posterior is not quite normal: with 40 touches the sd of one depth is 8 % smaller, and that of most parameters
    2 % larger, as the noise is unknown, too.
    """
    mode, draws = with_crosstalk.group("mode"), with_crosstalk.draws
    values = np.array([mode[f"crosstalk_{name}"] for name in ("share", "reach", "lean")])
    vector = np.concatenate([w.parameters_of(mode), values])
    means = with_crosstalk.table.averaged()
    as_read = w.Pressed(with_crosstalk.pressed.radius, with_crosstalk.pressed.angle, means.load)
    by_load = crosstalk.leaked(w.slope_over_load(w.finger_at(vector[:-3]), as_read), values)
    variance = 1 / (1 / (draws["noise_sd"] ** 2 / 2 + draws["discrepancy_sd"] ** 2)).mean(axis=0)
    slope = crosstalk.slopes(vector, as_read)
    total = w.information(slope, by_load, variance, float(np.mean(draws["force_noise_sd"] ** 2)) / 2)
    expected = np.linalg.inv(total + np.diag(crosstalk.prior_sd(vector) ** -2.0))
    own = [draws[f"crosstalk_{name}"][:, None] for name in ("share", "reach", "lean")]
    found = np.cov(np.concatenate([w.parameters_of(draws), *own], axis=1).T)
    np.testing.assert_allclose(found, with_crosstalk.group("laplace")["covariance"], rtol=1e-9)
    assert w.mean_ratio(found, expected) == pytest.approx(1, abs=0.05)
    np.testing.assert_allclose(np.sqrt(np.diag(found) / np.diag(expected)), 1, rtol=0, atol=0.12)


def test_noise_of_draws_with_effects_is_that_of_repeats_and_residuals(with_crosstalk: Calibrated) -> None:
    """Between 40 degrees of freedom, of the repeats alone, and 80, with residuals without any discrepancy."""
    draws, raw = with_crosstalk.draws["noise_sd"], with_crosstalk.table.readings.reshape(-1, 2, M)
    precision = raw.var(axis=1, ddof=1).mean(axis=0) / draws**2
    relative = precision.std(axis=0) / precision.mean(axis=0)
    few, many = np.sqrt(2 / len(raw)), np.sqrt(2 / (2 * len(raw)))
    # 2,000 independent draws: 1.6 % of an sd.
    assert np.all((relative > 0.95 * many) & (relative < 1.05 * few))
    assert np.all(np.abs(precision.mean(axis=0) - 1) < 3 * few)


def matern(first: np.ndarray, second: np.ndarray, length: float) -> np.ndarray:
    """Correlation (1 + a) exp(-a), a = sqrt(3) |t - t'|/length."""
    a = np.sqrt(3) * np.abs(first[:, None] - second) / length
    return np.asarray((1 + a) * np.exp(-a))


@pytest.mark.parametrize(
    ("kind", "values"),
    [(BaselineDrift, (0.02, 150.0)), (GainDrift, (0.03, 150.0, 0.0)), (GainDrift, (0.03, 150.0, 1.0))],
)
def test_a_drift_is_the_random_function_that_it_says(
    kind: type[RandomEffect], values: tuple[float, ...], well_known: Calibrated
) -> None:
    """Sum of squares, drift and covariance of the parameters against regression on a Matérn process, written out:
    on what its values at knots half a length apart say of it.
    """
    data = SplitData.of_calibration(w.dataset(well_known.table, well_known.table))
    base = base_fit(data.observations(data.training), data.dataset.sensor, "layer")
    drift = kind.suited(data.setting("layer", base.model.reference_load))
    assert isinstance(drift, RandomEffect)
    found = fit(base.model, base.vector, base.noise, ((drift, values),))
    vector, observed = found.vector, base.model.known
    parameters = np.concatenate([np.exp(vector[:M]), vector[M:]])
    means = observed.means
    assert means.angle_deg is not None
    tip = means.indenter_radius_mm
    radius = np.where(np.isinf(tip), w.OUTER, 0.0)
    pressed = w.Pressed(radius, np.radians(means.angle_deg), means.load)
    chain, t = w.finger_at(parameters), len(means.load)
    prediction = chain.predict(radius, pressed.angle, pressed.load)
    by_load = w.slope_over_load(chain, pressed)
    noise = np.zeros((t, M, t, M))
    for k in range(t):
        noise[k, :, k] = np.diag(base.noise.sd**2 / 6) + base.noise.load_sd[k] ** 2 * np.outer(by_load[k], by_load[k])
    time, ends = observed.touch_time_s, (well_known.table.time_s.min(), well_known.table.time_s.max())
    knots = np.linspace(*ends, int(np.ceil(2 * (ends[1] - ends[0]) / values[1])) + 1)
    cross = matern(time, knots, values[1])
    course = values[0] ** 2 * cross @ np.linalg.solve(matern(knots, knots, values[1]), cross.T)
    # between two knots 3 % of the variance of the process itself is lost
    assert np.abs(course / values[0] ** 2 - matern(time, time, values[1])).max() < 0.035
    scale = np.tile(base.model.peak, (t, 1)) if kind is BaselineDrift else prediction
    together = np.ones((M, M)) if kind is GainDrift and values[2] == 0 else np.eye(M)
    wander = np.einsum("st,ij,si,tj->sitj", course, together, scale, scale).reshape(t * M, t * M)
    total = noise.reshape(t * M, t * M) + wander
    left = (means.readings - prediction).ravel()
    solved = np.linalg.solve(total, left)
    # the load's error was whitened at the start of the fit: by_load has moved by a per cent since
    assert float(found.linear.residual.ravel() @ found.linear.plain.ravel()) == pytest.approx(left @ solved, rel=0.02)
    expected = (wander @ solved).reshape(t, M)
    # functions of a gain are those of the signal before its last step, less than 1 % of it
    assert np.abs(found.drifted - expected).max() < 0.02 * np.abs(expected).max()
    functions = found.linear.functions
    assert functions is not None
    prior = np.einsum("ksi,ktj->sitj", functions.raw, functions.raw).reshape(wander.shape)
    size = np.sqrt(np.outer(np.diag(wander), np.diag(wander)))
    there = np.diag(wander) > 1e-2 * np.diag(wander).max()
    assert np.abs((prior - wander) / size)[np.ix_(there, there)].max() < 0.06
    assert (np.diag(prior) / np.diag(wander))[there].mean() == pytest.approx(1, abs=0.01)
    slope = w.slopes(parameters, pressed).reshape(len(parameters), -1)
    slope[:M] *= parameters[:M, None]  # of log responses
    sd = w.prior_sd(np.concatenate([np.ones(M), parameters[M:]]))
    covariance = np.linalg.inv(slope @ np.linalg.solve(total, slope.T) + np.diag(sd**-2.0))
    ratio = np.diag(found.linear.covariance()) / np.diag(covariance)
    np.testing.assert_allclose(ratio, 1, atol=0.03)


def test_the_drift_of_a_touch_comes_from_the_others_alone() -> None:
    """Against the joint normal distribution of all readings with the touch's own left out, to rounding."""
    rng = np.random.default_rng(3)
    t, m, k = 6, 4, 3
    columns, slope = rng.normal(size=(t, m, k)), rng.normal(size=(t, m, 3))
    precision = rng.uniform(0.5, 2, (t, 3))
    root = rng.normal(size=(t, m, m))
    covariance = root @ root.swapaxes(1, 2) + np.eye(m)
    residual, shift = rng.normal(size=(t, m)), rng.normal(size=(t, 3))
    evidence = TouchEvidence(residual, slope, covariance, shift, precision)
    mean, spread = drift_of_others(columns, *evidence.about_addition())
    for one in range(t):
        others = [i for i in range(t) if i != one]
        stacked = np.concatenate([columns[i] for i in others])
        total = stacked @ stacked.T
        for place, i in enumerate(others):
            own = covariance[i] + slope[i] @ np.diag(1 / precision[i]) @ slope[i].T
            total[place * m : (place + 1) * m, place * m : (place + 1) * m] += own
        read = np.concatenate([residual[i] - slope[i] @ shift[i] for i in others])
        gain = columns[one] @ stacked.T @ np.linalg.inv(total)
        np.testing.assert_allclose(mean[one], gain @ read, atol=1e-9)
        expected = columns[one] @ columns[one].T - gain @ stacked @ columns[one].T
        np.testing.assert_allclose(spread[one], expected, atol=1e-9)
