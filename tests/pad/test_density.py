"""The exact density of a pad's calibration against likelihoods that are written out, and draws against quadrature."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from pad_simulation import SimulatedPad, line
from scipy.stats import lognorm, multivariate_normal, norm

from bayestouch.chain.kernels import GaussianKernel
from bayestouch.chain.pad import PadChain
from bayestouch.chain.recording import Recording
from bayestouch.effects.readout import GainNonlinearity
from bayestouch.model.fitting import Fitted, fit
from bayestouch.pad import residual_map
from bayestouch.pad.candidates import PadCandidate, add_map, fit_kernel
from bayestouch.pad.density import PadDensity
from bayestouch.pad.map_basis import MapBasis
from bayestouch.pad.problem import PadProblem, pad_problem
from bayestouch.pad.sampling import sample_density
from bayestouch.pad.start import fit_without_effects, pad_model

M, T = 4, 15


def small(*, with_map: bool, measured: bool = False) -> tuple[SimulatedPad, PadProblem, PadCandidate]:
    """A line of elements with one reading missing, and its model with a Gaussian kernel."""
    pad, rng = line(load_spread=0.05), np.random.default_rng(4)
    load = rng.uniform(0.7, 1.3, T) if measured else None
    touches = pad.touch(np.linspace(7, 31, T)[:, None], rng, samples=2, load=load, measured=measured)
    readings = touches.readings.copy()
    readings[10:12, 1] = np.nan
    problem, _ = pad_problem(pad.sensor, touches.with_(readings=readings), samples="mean", seed=0)
    model = fit_kernel(problem, GaussianKernel(6.0))
    if measured:
        model = replace(model, noise=replace(model.noise, load_scatter=0.05))
    if with_map:
        model = add_map(problem, model)
        # Of a size that matters, whatever the marginal likelihood says of so few touches.
        model = replace(model, fit=replace(model.fit, misfit=replace(model.fit.misfit, misfit=0.03, relative=0.05)))
    return pad, problem, model


def covariance_written_out(problem: PadProblem, model: PadCandidate) -> np.ndarray:
    """Covariance (T m, T m) of all readings, touch by touch: noise, errors of the loads, map."""
    known, noise, signal = problem.known, model.noise, model.left_out.signal
    out = np.zeros((T, M, T, M))
    share = np.full(T, model.load_spread)
    if problem.load_measured:
        share = np.hypot(problem.load_share, model.noise.load_scatter / known.load)
    misfit = model.fit.misfit
    distance = np.abs(known.location - known.location.T) / misfit.length_mm * np.sqrt(5)
    matern = (1 + distance + distance**2 / 3) * np.exp(-distance) * np.outer(known.load, known.load)
    for t in range(T):
        own = noise.tactile_sd**2 / 2 + noise.discrepancy_sd**2 + (noise.signal_share * signal[t]) ** 2
        out[t, :, t, :] = np.diag(own) + share[t] ** 2 * np.outer(signal[t], signal[t])
    for e in range(M):
        size = misfit.misfit**2 + misfit.relative**2 * np.outer(misfit.shape[:, e], misfit.shape[:, e])
        out[:, e, :, e] += misfit.amplitude[e] ** 2 * size * matern
    return out.reshape(T * M, T * M)


def vectors_near(density: PadDensity, n: int = 6) -> np.ndarray:
    rng = np.random.default_rng(1)
    mean, covariance = density.approximation(8.0)
    return mean + 2 * rng.standard_normal((n, len(mean))) @ np.linalg.cholesky(covariance).T


def readings_of(density: PadDensity, vector: np.ndarray, problem: PadProblem) -> np.ndarray:
    gain, offset, place = vector[: 3 * M].reshape(3, M)
    shape = np.exp(-0.5 * ((problem.known.location - place) / np.exp(vector[3 * M])) ** 2)
    return offset + problem.known.load[:, None] * gain * shape


@pytest.mark.parametrize("with_map", [False, True])
@pytest.mark.parametrize("measured", [False, True])
def test_likelihood_is_the_one_written_out(with_map: bool, measured: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    # With all functions of the map; what is left out of it counts as noise, which the next test looks at.
    monkeypatch.setattr(residual_map, "REST_OF_FEW", 1e-10)
    pad, problem, model = small(with_map=with_map, measured=measured)
    density = PadDensity.of(fit_without_effects(problem, model, pad.sensor.body))
    vectors = vectors_near(density)
    whole = covariance_written_out(problem, model)
    here = problem.present.ravel()
    normal = multivariate_normal(np.zeros(here.sum()), whole[np.ix_(here, here)])
    precision = np.linalg.inv(whole[np.ix_(here, here)])
    touch = np.repeat(np.arange(T), M)[here]
    by_touch = density.touch_log_likelihood(vectors)
    for vector, likelihood, parts in zip(vectors, density.log_likelihood(vectors), by_touch, strict=True):
        left = (np.nan_to_num(problem.known.readings) - readings_of(density, vector, problem)).ravel()[here]
        assert likelihood == pytest.approx(normal.logpdf(left), abs=1e-5)
        for t in range(T):
            own, rest = touch == t, touch != t
            # A normal density of some given the others, from the precision of all.
            block = np.linalg.inv(precision[np.ix_(own, own)])
            mean = -block @ precision[np.ix_(own, rest)] @ left[rest]
            assert parts[t] == pytest.approx(multivariate_normal(mean, block).logpdf(left[own]), abs=1e-5)


def test_functions_of_the_map_leave_next_to_nothing_out() -> None:
    pad, problem, model = small(with_map=True)
    density = PadDensity.of(fit_without_effects(problem, model, pad.sensor.body))
    vectors = vectors_near(density, 40)
    here = problem.present.ravel()
    whole = covariance_written_out(problem, model)[np.ix_(here, here)]
    left = np.stack([problem.known.readings - readings_of(density, v, problem) for v in vectors])
    expected = multivariate_normal(np.zeros(len(whole)), whole).logpdf(left.reshape(40, -1)[:, here])
    difference = density.log_likelihood(vectors) - expected
    # 3 % of the variance of a reading at most, where it is most: 1 % of differences of the log density.
    assert np.ptp(expected) > 20
    assert np.std(difference) < 0.01 * np.std(expected)


def test_prior_is_the_one_stated() -> None:
    pad, problem, model = small(with_map=False)
    density = PadDensity.of(fit_without_effects(problem, model, pad.sensor.body))
    vectors, priors = vectors_near(density), problem.priors
    expected = norm(0, 10 * priors.amplitude).logpdf(vectors[:, :M]).sum(axis=1)
    expected += norm(priors.offset, priors.offset_sd).logpdf(vectors[:, M : 2 * M]).sum(axis=1)
    expected += norm(priors.position[:, 0], 3.0).logpdf(vectors[:, 2 * M : 3 * M]).sum(axis=1)
    width = np.exp(vectors[:, -1])
    # The density of a logarithm is that of the value times the value.
    expected += lognorm(np.log(2), scale=3.0).logpdf(width) + np.log(width)
    np.testing.assert_allclose(density.log_prior(vectors), expected, rtol=1e-12)
    np.testing.assert_allclose(density(vectors), expected + density.log_likelihood(vectors), rtol=1e-12)
    assert density.names == (*(f"{n}[{e}]" for n in ("gain", "offset", "x_s") for e in range(M)), "w")


def nonlinear(share: float, *, with_map: bool) -> tuple[PadProblem, PadCandidate, Fitted]:
    """The small pad with readings that bend, fitted with the effect; the noise and the map are those of the pad."""
    pad, problem, model = small(with_map=with_map)
    effect = GainNonlinearity()
    basis = MapBasis.of(model, model.noise.tactile_sd) if with_map else None
    plain = replace(pad_model(problem, model, problem.observed, pad.sensor.body), map=basis)
    bent = replace(plain, effects=(effect,))
    start = np.concatenate([plain.start(pad.chain), [share, np.log(1.4)]])
    clean = bent.predict(start).touches
    means = replace(
        problem.observed.means,
        readings=clean + problem.observed.means.readings - np.nan_to_num(plain.predict(plain.start(pad.chain)).touches),
    )
    bent = bent.observing(replace(problem.observed, means=means))
    noise = fit_without_effects(problem, model, pad.sensor.body).noise
    return problem, model, fit(bent, start, noise, enough=1e-6)


def test_likelihood_with_an_effect_is_the_one_written_out() -> None:
    problem, model, fitted = nonlinear(0.1, with_map=False)
    density = PadDensity.of(fitted)
    peak, observed = fitted.model.peak, fitted.model.known
    assert density.names[-2:] == ("gain_nonlinearity_share", "gain_nonlinearity_power")
    vectors = vectors_near(density)
    noise, readings = model.noise, observed.means.readings
    covariances = []
    first, by_load = nonlinear_start(fitted)
    for t in range(T):
        own = noise.tactile_sd**2 / 2 + noise.discrepancy_sd**2 + (noise.signal_share * first[t]) ** 2
        covariances.append(np.diag(own) + model.load_spread**2 * np.outer(by_load[t], by_load[t]))
    for vector, likelihood in zip(vectors, density.log_likelihood(vectors), strict=True):
        signal = readings_of(density, vector, problem) - vector[M : 2 * M]
        share, power = vector[-2], np.exp(vector[-1])
        bent = signal * (1 + share * np.abs(signal / peak) ** power) + vector[M : 2 * M]
        total = 0.0
        for t in range(T):
            here = np.isfinite(readings[t])
            normal = multivariate_normal(np.zeros(here.sum()), covariances[t][np.ix_(here, here)])
            total += normal.logpdf((readings[t] - bent[t])[here])
        assert likelihood == pytest.approx(total, abs=1e-5)


def nonlinear_start(fitted: Fitted) -> tuple[np.ndarray, np.ndarray]:
    """Readings, and their change with a share of the load, where the fit of `nonlinear` took its noise."""
    pad = line(load_spread=0.05)
    start = np.concatenate([fitted.model.start(pad.chain), [0.1, np.log(1.4)]])
    up, down = (fitted.model.predict(start, fitted.model.load * (1 + s)).touches for s in (1e-4, -1e-4))
    return fitted.model.predict(start).touches, (up - down) / 2e-4


def test_map_that_effects_act_on_is_integrated_out() -> None:
    """Weights of the map are linear: a normal density whose covariance has what they add, about readings at zero."""
    _, _, fitted = nonlinear(0.0, with_map=True)
    model = fitted.model
    # With an effect of no size the readings are linear in the weights, and nothing is taken as such.
    vector = fitted.vector.copy()
    vector[-2] = 0.0
    density = PadDensity.of(replace(fitted, vector=vector))
    columns = model.map.columns(np.stack(model.poses(vector).place, axis=1)) * model.load[:, None]
    root = fitted.whitening.root
    here = fitted.whitening.present.ravel()
    whole = np.zeros((T, M, T, M))
    for t in range(T):
        some = fitted.whitening.present[t]
        block = np.zeros((M, M))
        inverse = np.linalg.inv(root[t][np.ix_(some, some)])
        block[np.ix_(some, some)] = inverse @ inverse.T
        whole[t, :, t] = block
    whole = whole.reshape(T * M, T * M) + columns.reshape(len(columns), -1).T @ columns.reshape(len(columns), -1)
    normal = multivariate_normal(np.zeros(here.sum()), whole[np.ix_(here, here)])
    zero = vector.copy()
    zero[model.n_chain : model.n_base] = 0.0
    expected = normal.logpdf((model.known.means.readings - model.predict(zero).touches).ravel()[here])
    assert density.log_likelihood(density.mode[None])[0] == pytest.approx(expected, abs=1e-5)


def test_draws_of_one_element_against_quadrature() -> None:
    """Position and width of one element by sums over a grid, its gain and offset integrated out in closed form.

    The sd of 1,500 effective draws is good to 1.8 %; three of these are 5 %.
    """
    chain = PadChain(GaussianKernel(6.0), np.array([2.5]), np.array([10.0]), np.array([0.3]), np.array([[5.4]]))
    pad, rng = SimulatedPad(chain, np.array([[5.0]]), floor=1.0, share=0.0, load_spread=0.02), np.random.default_rng(2)
    place = np.linspace(0, 11, 12)
    touches = pad.touch(place[:, None], rng)
    problem, _ = pad_problem(pad.sensor, touches, samples="mean", seed=0)
    model = fit_kernel(problem, GaussianKernel(6.0))
    density = PadDensity.of(fit_without_effects(problem, model, pad.sensor.body))
    drawn = sample_density(density, 4000, seed=5)
    assert drawn.rhat.max() < 1.01 and drawn.ess_bulk.min() > 1500
    # Written out: offsets and gains are linear, so that readings are normal given place and width of the element.
    readings, priors = problem.known.readings[:, 0], problem.priors
    noise = model.noise.discrepancy_sd[0] ** 2 + (model.noise.signal_share * model.left_out.signal[:, 0]) ** 2
    noise = np.diag(noise + (model.load_spread * model.left_out.signal[:, 0]) ** 2)
    x = np.linspace(-6.0, 6.0, 241) + density.mode[2]
    log_width = np.linspace(-1.8, 1.8, 241) + density.mode[3]
    log = np.empty((len(x), len(log_width)))
    for i, centre in enumerate(x):
        for j, width in enumerate(np.exp(log_width)):
            shape = np.exp(-0.5 * ((place - centre) / width) ** 2)
            whole = noise + (10 * priors.amplitude[0]) ** 2 * np.outer(shape, shape) + priors.offset_sd[0] ** 2
            root = np.linalg.cholesky(whole)
            z = np.linalg.solve(root, readings - priors.offset[0])
            log[i, j] = -0.5 * z @ z - np.log(np.diag(root)).sum()
    log += norm(priors.position[0, 0], 3.0).logpdf(x)[:, None] + norm(np.log(3.0), np.log(2)).logpdf(log_width)
    mass = np.exp(log - log.max())
    mass /= mass.sum()
    for values, grid, own in (
        (drawn.draws[:, :, 0, 2], x, mass.sum(1)),
        (drawn.draws[:, :, 0, 3], log_width, mass.sum(0)),
    ):
        mean = own @ grid
        sd = np.sqrt(own @ (grid - mean) ** 2)
        assert values.std() == pytest.approx(sd, rel=0.05)
        assert values.mean() == pytest.approx(mean, abs=4 * sd / np.sqrt(1500))


@dataclass(frozen=True)
class Shifted(GainNonlinearity):
    """An effect whose first value is added to the place of every touch."""

    def pose(self, recording: Recording, values: np.ndarray) -> Recording:
        return replace(recording, place=(recording.place[0] + values[0], *recording.place[1:]))

    def signal(self, recording: Recording, values: np.ndarray) -> np.ndarray:
        return recording.signal


def test_predictions_at_many_vectors_have_the_places_of_each() -> None:
    pad, problem, model = small(with_map=False)
    plain = pad_model(problem, model, problem.observed, pad.sensor.body)
    moved = replace(plain, effects=(Shifted(),))
    vectors = np.stack([np.concatenate([plain.start(pad.chain), [shift, 0.0]]) for shift in (0.0, 0.7, -2.0)])
    for vector, found in zip(vectors, moved.predictions(vectors), strict=True):
        chain, location = moved.chain(vector), problem.known.location + vector[-2]
        expected = chain.offset + problem.known.load[:, None] * chain.sensitivity(location)
        np.testing.assert_allclose(found.touches, expected, rtol=1e-12)
