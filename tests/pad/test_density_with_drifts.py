"""The density of a pad with drifts against a normal density that is written out, and its draws against quadrature."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import halfnorm, multivariate_normal, norm

from bayestouch.chain.kernels import ConstantKernel, GaussianKernel, Kernel
from bayestouch.chain.pad import PadChain
from bayestouch.chain.smooth import PlaceBasis
from bayestouch.data.touches import touches_from
from bayestouch.effects.effect import EffectParameter, Values
from bayestouch.effects.random import BaselineDrift, GainDrift, RandomEffect
from bayestouch.model.added import AddedEffect
from bayestouch.model.drift_posterior import settled_drifts
from bayestouch.model.fitting import Fitted, fit
from bayestouch.model.noise import NoiseModel
from bayestouch.model.observations import Observations, history_of
from bayestouch.pad.density import PadDensity
from bayestouch.pad.log_density import public_density
from bayestouch.pad.map_basis import MapBasis
from bayestouch.pad.model import PadModel
from bayestouch.pad.posterior import PadPosterior
from bayestouch.pad.posterior_map import PadPosteriorMap
from bayestouch.pad.quadratic import Quadratic
from bayestouch.pad.sampling import sample_density
from bayestouch.priors.parameters import LogNormal, Normal, Prior, Uniform

M = 2
LOAD_SD, SD = 0.02, np.array([0.05, 0.08])
SIZE, TIME = 0.05, LogNormal(60.0, 1.2)


def parameters() -> tuple[EffectParameter, EffectParameter]:
    return (
        EffectParameter("sd", "", "size", Normal(0.0, SIZE, 0.0), (0.01,), 0.0),
        EffectParameter("time", "s", "correlation time", TIME, (60.0,)),
    )


BASELINE = BaselineDrift(parameters())
GAIN = GainDrift((*parameters(), EffectParameter("own", "", "own", Uniform(0.0, 1.0), (0.0, 1.0))))


def pad_of(t: int, kernel: Kernel, *, with_map: bool = False, size: float = 0.04, length: float = 40.0) -> PadModel:
    """Two elements on a line, touched in random order; zeros drift by `size` of the peak; a reading is missing."""
    rng = np.random.default_rng(3)
    place, load = rng.permutation(np.linspace(-2.0, 8.0, t)), rng.uniform(0.6, 1.4, t)
    time = rng.permutation(np.cumsum(rng.uniform(5.0, 25.0, t)))
    values = np.array([2.5] * len(kernel.parameters))
    chain = PadChain(kernel, values, np.array([5.0, 7.0]), np.array([0.3, -0.2]), np.array([[0.2], [5.8]]))
    course = np.linalg.cholesky(matern(time, length) + 1e-9 * np.eye(t)) @ rng.standard_normal((t, M))
    readings = chain.predict(place[:, None], load) + size * chain.gain * course + SD * rng.standard_normal((t, M))
    readings[2, 1] = np.nan
    table = touches_from(np.arange(t), readings, x_mm=place, load=load + LOAD_SD * rng.standard_normal(t), contact=1.0)
    span = (float(time.min()), float(time.max()))
    # A table of its own for the last touches: drifts begin anew there.
    sessions = ((span[0], 60.0), (60.0, span[1]))
    observed = Observations.of(table, time, np.zeros(t), "s", history_of(table, time), span, sessions)
    basis = None
    if with_map:
        knots = PlaceBasis.at(np.linspace(-2.0, 8.0, 5)[:, None], 3.0)
        basis = MapBasis((knots, knots), np.array([5.0, 7.0]), 0.03, 0.05, chain)
    priors: list[Prior] = [Normal(0.0, 60.0)] * M + [Normal(0.0, 20.0)] * M + [Normal(0.0, 3.0), Normal(6.0, 3.0)]
    return PadModel(
        observed=observed,
        peak=np.array([5.0, 7.0]),
        reference_load=1.0,
        pad=chain,
        priors=(*priors, *(each.prior for each in kernel.parameters)),
        element_place=(np.array([0.0, 6.0]),),
        map=basis,
    )


def matern(time: np.ndarray, length: float) -> np.ndarray:
    lag = np.sqrt(3) * np.abs(time[:, None] - time) / length
    return np.asarray((1 + lag) * np.exp(-lag))


def fitted_pad(model: PadModel, *drifts: tuple[RandomEffect, Values]) -> Fitted:
    noise = NoiseModel(SD, np.full(model.known.n_touches, LOAD_SD), model.peak)
    return fit(model, model.start(model.pad), noise, drifts)


def density_of(fitted: Fitted) -> PadDensity:
    """With a normal approximation of sd 0.4 in log size and of 0.6 in log time."""
    sd = [(0.4 * values[0], 0.6 * values[1], *(float("nan") for _ in values[2:])) for _, values in fitted.drifts]
    pairs = zip(fitted.drifts, sd, strict=True)
    return PadDensity.of(fitted, [AddedEffect(drift, values, each) for (drift, values), each in pairs])


def vectors_near(density: PadDensity, n: int = 6) -> np.ndarray:
    return np.random.default_rng(1).multivariate_normal(density.mode, density.covariance, n)


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


@pytest.fixture(scope="module")
def flat() -> tuple[Fitted, list[AddedEffect]]:
    """Elements that respond alike to a touch anywhere, so that readings are linear in all parameters."""
    fitted, sd = settled_drifts(fitted_pad(pad_of(24, ConstantKernel()), (BASELINE, (0.02, 50.0))))
    return fitted, [AddedEffect(drift, values, sd[drift.name]) for drift, values in fitted.drifts]


def moments_written_out(fitted: Fitted) -> tuple[np.ndarray, np.ndarray]:
    """Means and sds of log size and log time by sums over a grid, with gains and offsets integrated out."""
    model, known = fitted.model, fitted.model.known
    there = np.isfinite(known.means.readings).ravel()
    one = np.ones((known.n_touches, 1))
    load = np.kron(known.load[:, None] * one, np.diag([60.0, 60.0]))
    fixed = load @ load.T + 400.0 * np.kron(one @ one.T, np.eye(M))
    gain = np.array([5.0, 7.0])
    fixed += np.kron(np.eye(known.n_touches), np.diag(SD**2) + LOAD_SD**2 * np.outer(gain, gain))
    late = known.touch_time_s >= 60.0
    sizes, times = np.linspace(-9.0, -0.5, 60), np.linspace(-2.0, 9.5, 60)
    log = np.empty((60, 60))
    readings = known.means.readings.ravel()[there]
    for j, time in enumerate(np.exp(times)):
        course = np.kron(matern(known.touch_time_s, time) * (late[:, None] == late), np.diag(model.peak**2))
        covariance = (fixed + np.exp(2 * sizes)[:, None, None] * course)[:, there][:, :, there]
        root = np.linalg.cholesky(covariance)
        z = np.linalg.solve(root, np.broadcast_to(readings[:, None], (60, len(readings), 1)))[..., 0]
        log[:, j] = -0.5 * (z**2).sum(axis=1) - np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
    log += (halfnorm(0, SIZE).logpdf(np.exp(sizes)) + sizes)[:, None] + norm(np.log(60), 1.2).logpdf(times)
    mass = np.exp(log - log.max())
    mass /= mass.sum()
    mean = np.array([mass.sum(axis=1) @ sizes, mass.sum(axis=0) @ times])
    squares = np.array([mass.sum(axis=1) @ (sizes - mean[0]) ** 2, mass.sum(axis=0) @ (times - mean[1]) ** 2])
    return mean, np.sqrt(squares)


def test_draws_of_size_and_time_against_quadrature(flat: tuple[Fitted, list[AddedEffect]]) -> None:
    """The sd of 1,500 effective draws is good to 1.8 %; three of these are 5 %."""
    fitted, added = flat
    drawn = sample_density(PadDensity.of(fitted, added), 4000, seed=5)
    assert drawn.rhat.max() < 1.01 and drawn.ess_bulk.min() > 1500
    mean, sd = moments_written_out(fitted)
    draws = drawn.draws[:, :, 0, -2:].reshape(-1, 2)
    np.testing.assert_allclose(draws.std(axis=0), sd, rtol=0.05)
    np.testing.assert_allclose((draws.mean(axis=0) - mean) / sd, 0, atol=4 / np.sqrt(1500))


def test_posterior_has_the_drift_by_name(flat: tuple[Fitted, list[AddedEffect]]) -> None:
    """Drawn together with the other parameters; the value of another noise effect is drawn as before."""
    fitted, added = flat
    posterior = PadPosterior.of(PadDensity.of(fitted, added), 64, 0, added=added)
    names = ("baseline_drift_sd", "baseline_drift_time")
    assert posterior.layout[-2:] == names and set(names) <= set(posterior.draws)
    assert posterior.covariance.shape == (8, 8) and posterior.draws[names[0]].shape == (4, 16)
    for i, name in enumerate(names):
        assert float(posterior.mode[name]) == pytest.approx(added[0].values[i])
        assert posterior.covariance[6 + i, 6 + i] == pytest.approx(added[0].sd[i] ** 2)
        assert (posterior.draws[name] > 0).all()


def test_change_of_variables_with_drifts(flat: tuple[Fitted, list[AddedEffect]]) -> None:
    """Log density less that of the variables is nearly flat where the shared entries are, and so is its derivative."""
    fitted, added = flat
    density = PadDensity.of(fitted, added)
    to_vectors = PadPosteriorMap.of(density, seed=0)
    points = np.random.default_rng(2).standard_normal((300, len(density.priors)))
    for point, log_derivative in zip(points[:3], to_vectors(points[:3])[1], strict=True):
        steps = 1e-5 * np.eye(len(point))
        jacobian = (to_vectors(point + steps)[0] - to_vectors(point - steps)[0]) / 2e-5
        assert log_derivative == pytest.approx(np.linalg.slogdet(jacobian)[1], abs=1e-4)
    vectors, log_derivative = to_vectors(points)
    log_weight = density(vectors) + log_derivative + 0.5 * (points**2).sum(axis=1)
    weight = np.exp(log_weight - log_weight.max())
    # Importance weights: at least a quarter of the points count.
    assert weight.sum() ** 2 / (weight**2).sum() > 0.25 * len(points)


def test_drifts_that_nobody_looked_at_have_the_sds_of_a_search() -> None:
    fitted = fitted_pad(pad_of(8, GaussianKernel(6.0)), *CASES["gain of each"])
    density = PadDensity.of(replace(fitted))
    np.testing.assert_allclose(density.mode[-2:], np.log([0.02, 50.0]))
    np.testing.assert_allclose(np.sqrt(np.diag(density.covariance))[-2:], [0.5, 0.8])
