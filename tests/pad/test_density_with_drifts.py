"""The density of a pad with drifts against a normal density that is written out."""

from __future__ import annotations

import numpy as np
import pytest
from drifting_pad import BASELINE, GAIN, LOAD_SD, SD, SIZE, M, density_of, fitted_pad, matern, pad_of, vectors_near
from scipy.stats import halfnorm, multivariate_normal, norm

from bayestouch.chain.kernels import GaussianKernel
from bayestouch.effects.effect import Values
from bayestouch.effects.random import RandomEffect
from bayestouch.model.fitting import Fitted
from bayestouch.pad.density import PadDensity
from bayestouch.pad.log_density import public_density
from bayestouch.pad.model import PadModel
from bayestouch.pad.quadratic import Quadratic


def residual_written_out(model: PadModel, vector: np.ndarray) -> np.ndarray:
    return np.asarray(model.known.means.readings - vector[M : 2 * M] - signal_written_out(model, vector))


def signal_written_out(model: PadModel, vector: np.ndarray) -> np.ndarray:
    place = model.known.means.x_mm
    assert place is not None
    shape = np.exp(-0.5 * ((place[:, None] - vector[2 * M : 3 * M]) / np.exp(vector[3 * M])) ** 2)
    return np.asarray(model.known.load[:, None] * vector[:M] * shape)


def covariance_written_out(fitted: Fitted, vector: np.ndarray, first: int) -> np.ndarray:
    """Covariance (t m, t m) of all readings, with log size and log time of the drifts from the index `first` on."""
    model, known = fitted.model, fitted.model.known
    assert isinstance(model, PadModel)
    t, out = known.n_touches, np.zeros((known.n_touches, M, known.n_touches, M))
    start = model.start(model.pad)
    by_load = signal_written_out(model, start) / known.load[:, None]
    for i in range(t):
        out[i, :, i] = np.diag(SD**2) + LOAD_SD**2 * np.outer(by_load[i], by_load[i])
    signal = signal_written_out(model, vector)
    if model.map is not None:
        assert known.means.x_mm is not None
        columns = model.map.columns(known.means.x_mm[:, None]) * known.load[:, None]
        out += np.einsum("kte,kuf->teuf", columns, columns)
        signal = signal + np.tensordot(fitted.vector[model.n_chain : model.n_base], columns, axes=1)
    late = known.touch_time_s >= 60.0
    for k, (drift, values) in enumerate(fitted.drifts):
        size, length = np.exp(vector[first + 2 * k : first + 2 * k + 2])
        scale = np.tile(model.peak, (t, 1)) if drift.name == "baseline_drift" else signal
        between = np.ones((M, M)) if drift.name == "gain_drift" and values[2] == 0 else np.eye(M)
        course = size**2 * matern(known.touch_time_s, length) * (late[:, None] == late)
        out += np.einsum("tu,ef,te,uf->teuf", course, between, scale, scale)
    return out.reshape(t * M, t * M)


CASES = {
    "baseline": ((BASELINE, (0.02, 50.0)),),
    "gain of all": ((GAIN, (0.02, 50.0, 0.0)),),
    "gain of each": ((GAIN, (0.02, 50.0, 1.0)),),
    "both": ((BASELINE, (0.02, 50.0)), (GAIN, (0.03, 20.0, 0.0))),
}


@pytest.mark.parametrize("with_map", [False, True])
@pytest.mark.parametrize("drifts", CASES.values(), ids=CASES.keys())
def test_density_is_the_one_written_out(drifts: tuple[tuple[RandomEffect, Values], ...], with_map: bool) -> None:
    """Of all readings together, and of each touch given all others."""
    fitted = fitted_pad(pad_of(8, GaussianKernel(6.0), with_map=with_map), *drifts)
    density = density_of(fitted)
    model, n, vectors = density.model, density.n_model, vectors_near(density)
    there = np.isfinite(model.known.means.readings).ravel()
    touch = np.repeat(np.arange(8), M)[there]
    by_touch = density.touch_log_likelihood(vectors)
    expected = []
    for vector, parts in zip(vectors, by_touch, strict=True):
        assert isinstance(fitted.model, PadModel)
        left = residual_written_out(fitted.model, vector).ravel()[there]
        covariance = covariance_written_out(fitted, vector, n)[np.ix_(there, there)]
        expected.append(multivariate_normal(None, covariance).logpdf(left))
        precision = np.linalg.inv(covariance)
        for i in range(8):
            own, rest = touch == i, touch != i
            block = np.linalg.inv(precision[np.ix_(own, own)])
            mean = -block @ precision[np.ix_(own, rest)] @ left[rest]
            assert parts[i] == pytest.approx(multivariate_normal(mean, block).logpdf(left[own]), rel=1e-8, abs=1e-8)
    assert np.ptp(expected) > 1
    np.testing.assert_allclose(density.log_likelihood(vectors), expected, rtol=1e-8)
    prior = norm(0, 60).logpdf(vectors[:, :2]).sum(axis=1) + norm(0, 20).logpdf(vectors[:, 2:4]).sum(axis=1)
    prior += norm([0, 6], 3).logpdf(vectors[:, 4:6]).sum(axis=1) + norm(np.log(3), np.log(2)).logpdf(vectors[:, 6])
    for k in range(len(drifts)):
        log_size, log_time = vectors[:, n + 2 * k : n + 2 * k + 2].T
        # The density of a logarithm is that of the value times the value.
        prior += halfnorm(0, SIZE).logpdf(np.exp(log_size)) + log_size + norm(np.log(60), 1.2).logpdf(log_time)
    np.testing.assert_allclose(density.log_prior(vectors), prior, rtol=1e-8)
    np.testing.assert_allclose(density(vectors), prior + expected, rtol=1e-8)


def test_many_touches_as_written_out() -> None:
    """More than the filter multiplies at once."""
    fitted = fitted_pad(pad_of(50, GaussianKernel(6.0), with_map=True), *CASES["baseline"])
    density = density_of(fitted)
    assert isinstance(fitted.model, PadModel)
    vectors, there = vectors_near(density, 3), np.isfinite(fitted.model.known.means.readings).ravel()
    expected = [
        multivariate_normal(None, covariance_written_out(fitted, vector, density.n_model)[np.ix_(there, there)]).logpdf(
            residual_written_out(fitted.model, vector).ravel()[there]
        )
        for vector in vectors
    ]
    np.testing.assert_allclose(density.log_likelihood(vectors), expected, rtol=1e-8)


def test_functions_of_a_correction_beside_a_drift() -> None:
    """They are in the fit after the functions of the drift; a function that changes nothing is left out."""
    further = 0.3 * np.random.default_rng(5).standard_normal((4, 8, M))
    further[3] = 0.0
    fitted = fitted_pad(pad_of(8, GaussianKernel(6.0)), *CASES["both"], further=further)
    density = density_of(fitted)
    assert isinstance(fitted.model, PadModel)
    vectors, there = vectors_near(density), np.isfinite(fitted.model.known.means.readings).ravel()
    flat, expected = further.reshape(4, -1)[:, there], []
    for vector in vectors:
        covariance = covariance_written_out(fitted, vector, density.n_model)[np.ix_(there, there)] + flat.T @ flat
        left = residual_written_out(fitted.model, vector).ravel()[there]
        expected.append(multivariate_normal(None, covariance).logpdf(left))
    np.testing.assert_allclose(density.log_likelihood(vectors), expected, rtol=1e-8)


@pytest.mark.parametrize("with_map", [False, True])
def test_gradient_and_cost_are_those_of_the_density(with_map: bool) -> None:
    """Of the entries of the model; the priors of this pad are normal but for that of a size."""
    density = density_of(fitted_pad(pad_of(8, GaussianKernel(6.0), with_map=with_map), *CASES["baseline"]))
    vectors, n = vectors_near(density, 3), density.n_model
    about = [Quadratic.at(density, vector) for vector in vectors]
    np.testing.assert_allclose(-np.diff([each.cost for each in about]), np.diff(density(vectors)), rtol=1e-8)
    step = 1e-4 * np.sqrt(np.diag(density.covariance))
    for vector, each in zip(vectors, about, strict=True):
        moves = np.diag(step)[:n]
        slope = (density(vector + moves) - density(vector - moves)) / (2 * step[:n])
        np.testing.assert_allclose(each.gradient[:n] * step[:n], slope * step[:n], atol=1e-8)


def test_a_density_for_any_sampler() -> None:
    """Names, units and values of the drift's entries, and the way back."""
    density = density_of(fitted_pad(pad_of(8, GaussianKernel(6.0)), *CASES["both"]))
    public = public_density(density, "kPa", "N")
    assert public.names[-5:] == (
        "log w",
        "log baseline_drift_sd",
        "log baseline_drift_time",
        "log gain_drift_sd",
        "log gain_drift_time",
    )
    assert public.units[-5:] == ("mm", "", "s", "", "s") and public.touches is None
    points = vectors_near(density)
    values = public.to_parameters(points)
    np.testing.assert_allclose(values["gain_drift_time"], np.exp(points[:, -1]))
    np.testing.assert_allclose(public.from_parameters(values), points)
    np.testing.assert_allclose(public(points), density(points))


def test_sizes_beyond_all_reason_have_no_density() -> None:
    density = density_of(fitted_pad(pad_of(8, GaussianKernel(6.0)), *CASES["baseline"]))
    far = np.repeat(density.mode[None], 4, axis=0)
    far[:, -2:] = [[8.0, 4.0], [-30.0, 4.0], [-4.0, 30.0], [-4.0, -30.0]]
    found = density(far)
    assert found[0] == -np.inf and np.isfinite(found[1:]).all()


def test_drifts_that_nobody_looked_at_have_the_sds_of_a_search() -> None:
    fitted = fitted_pad(pad_of(8, GaussianKernel(6.0)), *CASES["gain of each"])
    density = PadDensity.of(fitted)
    np.testing.assert_allclose(density.mode[-2:], np.log([0.02, 50.0]))
    np.testing.assert_allclose(np.sqrt(np.diag(density.covariance))[-2:], [0.5, 0.8])
