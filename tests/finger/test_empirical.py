"""Direct identification of a finger's E map: against equation (6), the model, dense algebra, simulation and fingers."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from study_modules import study

from bayestouch.body.emap import empirical_e_matrix
from bayestouch.chain.element_weight import ElementWeight
from bayestouch.chain.empirical import EmpiricalFingerChain, elastic_e_matrix, modes_of, pressure_matrix
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.neighbours import calibration_jacobian
from bayestouch.chain.noise import Noise
from bayestouch.contact import indenter_radius
from bayestouch.data.averages import TouchMeans
from bayestouch.data.sensor import Finger, Rubber, Sensor
from bayestouch.errors import InputError
from bayestouch.finger.empirical.calibration import finger_prior, fit_empirical
from bayestouch.finger.empirical.map import EmpiricalCalibration
from bayestouch.finger.empirical.regression import DiagonalElement, ElementData, MapPrior, Weights
from bayestouch.finger.empirical.strength import SCALES, STRENGTHS, infer_strength
from bayestouch.finger.fit import FingerFit, fit_finger
from bayestouch.finger.priors import FingerPriors
from bayestouch.finger.reading.covariance import reading_covariance
from bayestouch.finger.reading.modes import find_modes
from bayestouch.finger.reading.reader import FingerPosterior, IndenterPriors, TouchReadings, noise_whitener
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.priors.parameters import LogNormal

RADII = (9.4, 12.7)


def elastic(angles_deg: tuple[float, ...]) -> FingerChain:
    m = len(angles_deg)
    depth = 9.9 + 0.1 * np.cos(np.arange(m))
    return FingerChain(*RADII, np.full(m, 5.0), depth, np.radians(angles_deg), np.zeros(m), 0.46, 0.15, 300.0)


def touched(
    chain: FingerChain | EmpiricalFingerChain,
    angle_deg: np.ndarray,
    radius_mm: np.ndarray,
    *,
    noise: float,
    force_noise: float,
    seed: int,
    reads: int = 5,
) -> TouchMeans:
    """Averaged touches with 1.72 % noise (times `noise`) and loads between 150 and 250 N/m read with an error."""
    rng = np.random.default_rng(seed)
    true_load = rng.uniform(150, 250, len(angle_deg))
    clean = chain.predict(radius_mm, np.radians(angle_deg), true_load)
    sd = noise * 0.0172 * 5.0 * 200
    n, m = clean.shape
    return TouchMeans(
        touch=np.arange(n),
        readings=clean + sd / np.sqrt(reads) * rng.standard_normal(clean.shape),
        counts=np.full((n, m), reads),
        pure_error_variance=np.full(m, sd**2),
        pure_error_dof=np.full(m, 4.0 * n),
        load=true_load + force_noise / np.sqrt(reads) * rng.standard_normal(n),
        indenter_radius_mm=indenter_radius(radius_mm, chain.outer_radius_mm),
        depth_mm=np.full(n, np.nan),
        time_s=np.arange(n, dtype=float),
        angle_deg=angle_deg,
        x_mm=None,
        y_mm=None,
    )


def model_fit(means: TouchMeans, chain: FingerChain, force_noise: float) -> FingerFit:
    sensor = Sensor(
        "simulated",
        Finger(*RADII, 9.9, tuple(np.degrees(chain.angle))),
        Rubber(0.15, 0.46),
        1.0,
        "counts",
        "strain",
        {},
    )
    priors, _ = FingerPriors.of(sensor)
    # as good as given: what is tested here is the map
    priors = replace(priors, force_noise=LogNormal(max(force_noise, 1e-6), 1e-3))
    fit, _ = fit_finger(means, sensor.body, priors)
    return fit


@cache
def half_circle_fit(
    force_noise: float = 1.0, seed: int = 1, bump: float = 0.0
) -> tuple[FingerFit, EmpiricalFingerChain]:
    """Edges and flats over ±90°, on a finger whose E departs from the elastic one by `bump` at low modes."""
    chain = elastic((-40.0, -10.0, 15.0, 45.0))
    e = elastic_e_matrix(chain, modes_of(chain))
    departure = np.random.default_rng(7).standard_normal((len(e), 31)) * np.abs(e).max()
    e[:, :31] += bump * departure
    truth = EmpiricalFingerChain(chain, e)
    angle = np.concatenate([np.arange(-90, 91, 2.0), np.arange(-90, 91, 4.0)])
    radius = np.where(np.arange(len(angle)) < 91, 0.0, RADII[1])
    means = touched(truth, angle, radius, noise=1.0, force_noise=force_noise, seed=seed)
    return model_fit(means, chain, force_noise), truth


def test_chain_is_the_series_whatever_the_map() -> None:
    """Interpolated in angle: off by less than 1e-5 of the peak for the elastic bandwidth (see `ResponseTable`)."""
    chain = elastic((-20.0, 5.0, 30.0))
    e = elastic_e_matrix(chain, modes_of(chain))
    rng = np.random.default_rng(0)
    # random phases: elements that are neither even nor where the model has them
    skew = EmpiricalFingerChain(
        chain, e + 0.3 * np.abs(e).max() * np.exp(-np.arange(e.shape[1]) / 15) * rng.normal(size=e.shape)
    )
    radius, angle, load = rng.uniform(0, 12.7, 300), rng.uniform(-np.pi, np.pi, 300), rng.uniform(50, 290, 300)
    series = pressure_matrix(chain, radius, angle, load, skew.n_coefficients) @ skew.e_matrix.T
    np.testing.assert_allclose(skew.predict(radius, angle, load), series, atol=1e-5 * np.abs(series).max())
    model = EmpiricalFingerChain(chain, e)
    np.testing.assert_allclose(
        model.predict(radius, angle, load), chain.predict(radius, angle, load), rtol=1e-9, atol=1e-8
    )
    np.testing.assert_allclose(model.response, chain.response, rtol=1e-12)
    table = ReadingTable.of_map(skew, -1.2, 1.2)
    inside = np.abs(angle) < 1.2
    kappa = load * radius / 1000 / chain.shear_modulus_MPa
    found = table(kappa[inside], angle[inside]) * load[inside, None]
    # bilinear in 0.09°: 1e-4 of the peak, as the table of the model
    np.testing.assert_allclose(found, series[inside], atol=1e-4 * np.abs(series).max())


@pytest.mark.parametrize(
    "changes",
    [
        {"friction": 0.3},
        {"element_weight": ElementWeight(2.0)},
        {"friction": -0.2, "element_weight": ElementWeight(3.0), "finite_strain": 1.0},
    ],
)
def test_map_of_a_finger_that_effects_have_changed(changes: dict[str, float]) -> None:
    """Friction turns each mode, the width of an element weakens it, and finite strain comes on top of the map."""
    chain = elastic((-20.0, 5.0, 30.0)).with_(**changes)
    mapped = EmpiricalFingerChain(chain, elastic_e_matrix(chain, modes_of(chain)))
    rng = np.random.default_rng(0)
    radius, angle, load = rng.uniform(0, 12.7, 50), rng.uniform(-np.pi, np.pi, 50), rng.uniform(50, 290, 50)
    expected = chain.predict(radius, angle, load)
    peak = np.abs(expected).max()
    # by the series without interpolation in angle, which is good to 1e-5 of the peak; else the same table
    np.testing.assert_allclose(mapped.series(radius, angle, load), expected, atol=1e-5 * peak)
    np.testing.assert_allclose(mapped.predict(radius, angle, load), expected, rtol=1e-9, atol=1e-10 * peak)


def test_without_prior_it_is_equation_6() -> None:
    """Touches all around, full rank, equal noise: least squares to rounding; and strong priors approach it."""
    chain = elastic((-40.0, 0.0, 40.0))
    angle = np.arange(48) * 7.5 - 180
    n_c = 12
    means = touched(chain, angle, np.zeros(48), noise=1.0, force_noise=0.0, seed=3)
    fit = model_fit(means, chain, 0.0)
    p = pressure_matrix(fit.chain, np.zeros(48), np.radians(angle), means.load, n_c)
    expected = empirical_e_matrix(p.T, means.readings.T)
    size = np.abs(expected).max()
    for family in (True, False):
        found = fit_empirical(fit, n_coefficients=n_c, strength=np.inf, family=family).calibration
        # a well-conditioned problem of 25 unknowns (condition 1.7): a few hundred units in the last place
        np.testing.assert_allclose(found.chain.e_matrix, expected, atol=1e-12 * size * (100 if family else 1))
        variance = np.diag(np.linalg.inv(p.T @ p)) * found.noise.tactile_sd[:, None] ** 2 / 5
        factor = np.sqrt(np.einsum("epp->ep", found.covariance) / variance)
        # the covariance is that of least squares, with the element's error as what is left over shows it
        np.testing.assert_allclose(factor, factor[:, :1] * np.ones(25), rtol=1e-9)
    distances = [
        np.abs(
            fit_empirical(fit, n_coefficients=n_c, strength=s, family=False).calibration.chain.e_matrix - expected
        ).max()
        for s in (10.0, 100.0)
    ]
    # the pull towards the model falls with λ²
    assert distances[1] == pytest.approx(distances[0] / 100, rel=0.05)
    with pytest.raises(InputError, match="determine only 48 of 61 coefficients"):
        fit_empirical(fit, n_coefficients=30, strength=np.inf, family=False)


def test_without_departure_it_is_the_model() -> None:
    fit, _ = half_circle_fit()
    held = fit_empirical(fit, strength=0.0, family=False).calibration
    n_c = modes_of(fit.chain)
    np.testing.assert_array_equal(held.chain.e_matrix, elastic_e_matrix(fit.chain, n_c))
    assert not held.covariance.any()
    known = fit.likelihood.known
    pose = (known.radius_mm, known.angle, known.load)
    np.testing.assert_allclose(held.chain.predict(*pose), fit.chain.predict(*pose), rtol=1e-9, atol=1e-7)
    # the fit interpolates contacts in its own way, good to some 1e-5 of the peak
    np.testing.assert_allclose(held.chain.predict(*pose), fit.predicted, atol=3e-5 * np.abs(fit.predicted).max())
    # With the family free it is the posterior of the model calibration: the same normal approximation, but that φ is
    # integrated (its mean square is 1.03 where repeats explain all) and the load's error is each element's own.
    moving = fit_empirical(fit, strength=0.0).calibration
    rng = np.random.default_rng(0)
    pose = (rng.uniform(0.5, 12, 60), rng.uniform(-0.8, 0.8, 60), rng.uniform(150, 250, 60))
    model = reading_covariance(calibration_jacobian(fit.chain, *pose), fit.covariance)
    found = moving.reading_covariance(*pose)
    scale = np.sqrt(np.einsum("tee->te", model))
    np.testing.assert_allclose(np.sqrt(np.einsum("tee->te", found)), scale, rtol=0.04)
    assert np.abs((found - model) / (scale[:, :, None] * scale[:, None, :])).max() < 0.1
    assert np.abs((moving.chain.predict(*pose) - fit.chain.predict(*pose)) / scale).max() < 0.1


def small_problem(seed: int, n: int = 30, p: int = 9, k: int = 2) -> tuple[ElementData, MapPrior]:
    rng = np.random.default_rng(seed)
    prior = MapPrior(rng.normal(size=p), rng.uniform(0.2, 1.5, p), rng.normal(size=(p, k)), rng.normal(size=k))
    design = rng.normal(size=(n, p))
    truth = prior.mean + prior.tangents @ rng.normal(size=k) + 0.3 * prior.scale * rng.normal(size=p)
    sd = rng.uniform(0.3, 0.6, n)
    return ElementData(design, design @ truth + sd * rng.normal(size=n), sd), prior


@pytest.mark.parametrize(("n", "k"), [(30, 2), (30, 0), (5, 2)])
def test_evidence_and_posterior_are_those_of_dense_algebra(n: int, k: int) -> None:
    data, prior = small_problem(4, n=n, k=k)
    element = DiagonalElement.of(data, prior)
    strengths, factors = np.array([0.05, 0.4, 2.0]), np.array([1.0, 1.7])
    expected = np.empty((3, 2))
    means, covariances = {}, {}
    for i, strength in enumerate(strengths):
        for j, factor in enumerate(factors):
            spread = strength**2 * np.diag(prior.scale**2) + factor**2 * prior.tangents @ prior.tangents.T
            centre = prior.mean + prior.tangents @ prior.start
            total = data.design @ spread @ data.design.T + factor**2 * np.diag(data.sd**2)
            miss = data.readings - data.design @ centre
            expected[i, j] = multivariate_normal(cov=total).logpdf(miss)
            gain = spread @ data.design.T @ np.linalg.inv(total)
            means[i, j], covariances[i, j] = centre + gain @ miss, spread - gain @ data.design @ spread
    found = element.log_evidence(strengths, factors)
    np.testing.assert_allclose(found - found[0, 0], expected - expected[0, 0], atol=1e-8)
    weights = Weights(np.array([0.05, 2.0]), np.array([1.0, 1.7]), np.array([0.3, 0.7]))
    mean, covariance = element.posterior(weights)
    parts = [(0.3, means[0, 0], covariances[0, 0]), (0.7, means[2, 1], covariances[2, 1])]
    centre = sum(w * each for w, each, _ in parts)
    spread = sum(w * (c + np.outer(each - centre, each - centre)) for w, each, c in parts)
    np.testing.assert_allclose(mean, centre, atol=1e-9)
    np.testing.assert_allclose(covariance, spread, atol=1e-9)


def test_strength_is_that_of_direct_enumeration() -> None:
    """Two elements with φ known: the joint posterior of (Λ, λ_1, λ_2) summed over all combinations of the grid."""
    elements = [DiagonalElement.of(*small_problem(seed)) for seed in (1, 2)]
    found = infer_strength(elements, [True, True])
    factor = found.weights[0].factor
    assert found.scale_weight.sum() == pytest.approx(1) and factor.min() == 1.0
    nodes = np.exp(np.arange(0.0, 3.4, 0.03))
    edges = np.exp(2 * np.concatenate([[0.0], np.log(nodes[1:]) - 0.015, [np.log(nodes[-1]) + 0.015]])) - 1
    mass = np.diff(np.arctan(np.sqrt(np.maximum(edges, 0))))
    own = [np.exp(e.log_evidence(STRENGTHS, nodes)) @ mass for e in elements]
    half_cauchy = STRENGTHS[:, None] / (SCALES * (1 + (STRENGTHS[:, None] / SCALES) ** 2))
    half_cauchy /= half_cauchy.sum(axis=0)
    joint = np.einsum("il,jl,i,j->lij", half_cauchy, half_cauchy, *own)
    joint /= joint.sum()
    np.testing.assert_allclose(found.scale_weight, joint.sum(axis=(1, 2)), atol=1e-9)
    for e, axis in ((0, 2), (1, 1)):
        marginal = np.array([found.weights[e].weight[found.weights[e].strength == s].sum() for s in STRENGTHS])
        np.testing.assert_allclose(marginal, joint.sum(axis=(0, axis)), atol=1e-7)


def test_simulated_departures_are_covered() -> None:
    """Fingers drawn from the prior itself: 90 % intervals of Λ, of λ and of predictions hold the truth as often."""
    rng = np.random.default_rng(12)
    fingers, m, n, p = 100, 4, 40, 21
    scale = np.exp(-np.arange(p) / 8)
    inside, scale_rank, z = [], [], []
    for _ in range(fingers):
        common = np.exp(rng.uniform(np.log(SCALES[0]), np.log(SCALES[-1])))
        elements, truths = [], []
        while len(elements) < m:
            strength = common * np.abs(rng.standard_cauchy())
            if not STRENGTHS[0] < strength < STRENGTHS[-1]:
                continue
            prior = MapPrior(np.zeros(p), scale, rng.normal(size=(p, 2)), np.zeros(2))
            factor = np.sqrt(1 + rng.standard_cauchy() ** 2)
            if factor > 30:
                continue
            # the wide prior of the family is scaled along with the error
            truth = factor * prior.tangents @ rng.normal(size=2) + strength * scale * rng.normal(size=p)
            design = rng.normal(size=(n, p))
            sd = np.full(n, 0.1)
            readings = design @ truth + factor * sd * rng.normal(size=n)
            elements.append(DiagonalElement.of(ElementData(design, readings, sd), prior))
            truths.append((strength, truth))
        found = infer_strength(elements, [True] * m)
        scale_rank.append(found.scale_weight[found.scale < common].sum())
        for element, weights, (strength, truth) in zip(elements, found.weights, truths, strict=True):
            inside.append(weights.weight[weights.strength < strength].sum())
            mean, covariance = element.posterior(weights)
            touch = rng.normal(size=p)
            z.append(touch @ (truth - mean) / np.sqrt(touch @ covariance @ touch))
    for ranks in (np.array(scale_rank), np.array(inside)):
        share = np.mean((ranks > 0.05) & (ranks < 0.95))
        # 90 % with a binomial standard error (four of them); grid points blur a rank by at most a few per cent
        assert abs(share - 0.9) < 4 * np.sqrt(0.09 / len(ranks))
    share = np.mean(np.abs(z) < 1.645)
    assert abs(share - 0.9) < 4 * np.sqrt(0.09 / len(z))
    # a mixture over Λ and λ has longer tails than a normal: the error of the mean square is taken from the squares
    assert np.mean(np.square(z)) == pytest.approx(1, abs=4 * np.std(np.square(z)) / np.sqrt(len(z)))


def test_shared_load_error_taken_as_each_elements_own() -> None:
    """What leaving out that a load's error is the same for all elements costs, at the paper's 0.5 % force noise.

    The exact posterior has all elements and loads at once. Sensor noise of a mean is 0.4 % of the peak there.
    """
    fit, _ = half_circle_fit(force_noise=1.0 * np.sqrt(5), seed=5, bump=0.01)
    fit = replace(fit, noise=replace(fit.noise, tactile_sd=np.full(4, 0.004 * 1000 * np.sqrt(5))))
    known, n_c, strength = fit.likelihood.known, 40, 0.02
    design = pressure_matrix(fit.chain, known.radius_mm, known.angle, known.load, n_c)
    priors = finger_prior(fit.likelihood.prior, fit.chain, n_c)
    sensor = fit.noise.tactile_sd / np.sqrt(5)
    direction = fit.predicted * (known.load_sd(fit.noise.force_sd) / known.load)[:, None]
    t, m = direction.shape
    p = design.shape[1]
    # exact: coefficients of all elements given everything, by the covariance of all readings
    spread = np.zeros((m * p, m * p))
    whole = np.zeros((m * t, m * p))
    noise = np.zeros((m * t, m * t))
    centre = np.concatenate([prior.mean + prior.tangents @ prior.start for prior in priors])
    for e, prior in enumerate(priors):
        block = slice(e * p, (e + 1) * p)
        spread[block, block] = strength**2 * np.diag(prior.scale**2) + prior.tangents @ prior.tangents.T
        whole[e * t : (e + 1) * t, block] = design
        for f in range(m):
            noise[e * t : (e + 1) * t, f * t : (f + 1) * t] = np.diag(direction[:, e] * direction[:, f])
    noise[np.diag_indices(m * t)] += np.repeat(sensor**2, t)
    total = whole @ spread @ whole.T + noise
    gain = np.linalg.solve(total, whole @ spread).T
    exact = (centre + gain @ (known.readings.T.ravel() - whole @ centre)).reshape(m, p)
    exact_covariance = spread - gain @ whole @ spread
    here = pressure_matrix(fit.chain, np.zeros(90), np.radians(np.linspace(-60, 60, 90)), np.full(90, 200.0), n_c)
    for e, prior in enumerate(priors):
        data = ElementData(design, known.readings[:, e], np.hypot(sensor[e], direction[:, e]))
        mean, covariance = DiagonalElement.of(data, prior).posterior(
            Weights(np.array([strength]), np.ones(1), np.ones(1))
        )
        block = slice(e * p, (e + 1) * p)
        sd = np.sqrt(np.einsum("tp,pq,tq->t", here, exact_covariance[block, block], here))
        own_sd = np.sqrt(np.einsum("tp,pq,tq->t", here, covariance, here))
        # The other elements can only narrow: by 0.2 % at most here, as many touches average the loads' errors anyway;
        assert np.all(own_sd > sd * (1 - 1e-6))
        assert (own_sd / sd).max() < 1.01
        # and they move the mean by a small part of the sd (0.13 at most, 0.04 on the whole).
        shift = here @ (mean - exact[e]) / sd
        assert np.abs(shift).max() < 0.3 and np.sqrt(np.mean(shift**2)) < 0.1


def test_covariance_is_that_of_refits() -> None:
    """Own part against draws of E; the part of μ against calibrations refitted beside it."""
    fit, _ = half_circle_fit(bump=0.01)
    found = fit_empirical(fit)
    empirical = found.calibration
    rng = np.random.default_rng(2)
    pose = (np.array([3.0, 12.0]), np.array([0.1, -0.3]), np.array([200.0, 180.0]))
    alone = replace(empirical, contact_covariance=np.zeros((2, 2)))
    design = pressure_matrix(fit.chain, *pose, empirical.chain.n_coefficients)
    values, vectors = np.linalg.eigh(empirical.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0))[:, None, :]
    draws = 4000
    scatter = np.stack([design @ (root[e] @ rng.standard_normal((root.shape[1], draws))) for e in range(4)], axis=-1)
    own = alone.reading_covariance(*pose)
    # a variance of 4000 draws scatters by sqrt(2/4000) = 2.2 %; five of them
    np.testing.assert_allclose(np.einsum("tee->te", own), scatter.var(axis=1), rtol=0.11)
    assert not own[:, ~np.eye(4, dtype=bool)].any()
    step = 0.1
    shared = empirical.reading_covariance(*pose) - own
    assert np.allclose(shared, shared.swapaxes(1, 2))
    sides = []
    for sign in (1, -1):
        moved = fit.chain.with_(shear_modulus_MPa=fit.chain.shear_modulus_MPa * np.exp(sign * step))
        again = fit_empirical(replace(fit, chain=moved)).calibration
        sides.append(again.chain.predict(*pose))
    refitted = (sides[0] - sides[1]) / (2 * step)
    only_mu = replace(empirical, contact_covariance=np.diag([0.0, 1.0])).reading_covariance(*pose) - own
    largest = np.abs(refitted).max()
    # steps of 0.1 and 0.05 in log μ and λ found anew: a few per cent of the largest derivative
    np.testing.assert_allclose(np.sqrt(np.einsum("tee->te", only_mu)), np.abs(refitted), atol=0.06 * largest)


def test_departure_is_found_and_put_to_use() -> None:
    """A finger whose E departs: strength, readings within their error, and touches read without bias."""
    fit, truth = half_circle_fit(bump=0.03, seed=8)
    found = fit_empirical(fit)
    low, high = found.strength.interval()
    # the elements' own strengths are about bump times the peak over the scale's, 0.01; Λ is known from four of them
    assert low < 0.02 and high > 0.004 and np.all(found.strengths > 0.003)
    assert fit.lack_of_fit > 1.5 and np.all(found.lack_of_fit < 1.3)
    rng = np.random.default_rng(3)
    pose = (rng.uniform(0.5, 12, 200), rng.uniform(-1.0, 1.0, 200), rng.uniform(150, 250, 200))
    covariance = found.calibration.reading_covariance(*pose)
    sd = np.sqrt(np.einsum("tee->te", covariance))
    clean = truth.predict(*pose)
    z = (found.calibration.chain.predict(*pose) - clean) / sd
    wrong = fit.chain.predict(*pose) - clean
    assert np.sqrt(np.mean((z * sd) ** 2)) < 0.5 * np.sqrt(np.mean(wrong**2))
    # 200 touches of 4 elements share some 60 coefficients: a mean square scatters by sqrt(2/60) = 0.18; three of them
    assert np.mean(z**2) == pytest.approx(1, abs=0.55)


def test_touches_are_read_with_an_empirical_chain() -> None:
    """Noiseless readings of a finger that is not elastic: its own map gives back the touches, the model does not."""
    chain = elastic(tuple(-35.2 + 8.8 * np.arange(9)))
    e = elastic_e_matrix(chain, modes_of(chain))
    rng = np.random.default_rng(3)
    e[:, :31] += 0.03 * np.abs(e).max() * rng.standard_normal((9, 31))
    truth = EmpiricalFingerChain(chain, e)
    pose = (rng.uniform(2.0, 11.0, 60), rng.uniform(-0.5, 0.5, 60), rng.uniform(150, 250, 60))
    clean = truth.predict(*pose)
    touches = TouchReadings(clean, np.ones(clean.shape, dtype=np.int64), pose[2], np.ones(60))
    noise = Noise(np.full(9, 1.0), np.zeros(9), 0.0, 1.0)
    priors = IndenterPriors.of(truth, 200.0)
    table = ReadingTable.of_map(truth, *priors.location.support)
    misses = []
    for finger, lookup in ((truth, None), (truth, table), (chain, None)):
        posterior = FingerPosterior(finger, touches, priors, noise_whitener(noise, touches), lookup)
        mode = find_modes(posterior)
        misses.append(posterior.radius(mode[:, 0]) - pose[0])
    # Noise of 0.1 % of the peak leaves an sd of some 0.05 mm in R; the Jacobian of the coordinate and the table's
    # interpolation (1e-4 of the peak) each pull the mode by a tenth of that.
    assert np.abs(misses[0]).max() < 0.02
    assert np.abs(misses[1]).max() < 0.02
    assert np.median(np.abs(misses[2])) > 0.3


def test_missing_readings_and_a_dead_element() -> None:
    fit, _ = half_circle_fit()
    known = fit.likelihood.known
    whole = fit_empirical(fit, n_coefficients=30)
    readings = known.readings.copy()
    readings[::3, 1] = np.nan
    readings[:, 2] = np.nan
    sparse = fit_finger_again(fit, readings)
    found = fit_empirical(sparse, n_coefficients=30, repeated=np.ones(4, dtype=bool))
    e = found.calibration.chain.e_matrix
    assert np.isfinite(e).all() and np.isfinite(found.calibration.covariance).all()
    # fewer touches know less; none leave the prior, which is wide
    size = np.einsum("epp->e", found.calibration.covariance) / np.einsum("epp->e", whole.calibration.covariance)
    assert size[1] > 1 and size[2] > 100
    np.testing.assert_allclose(e[2], elastic_e_matrix(fit.chain, 30)[2] + tangent_start(sparse, 2), rtol=1e-9)


def fit_finger_again(fit: FingerFit, readings: np.ndarray) -> FingerFit:
    """The same model calibration, about to be refined with some readings missing."""
    likelihood = fit.likelihood
    return replace(fit, likelihood=likelihood.with_known(replace(likelihood.known, readings=readings)))


def tangent_start(fit: FingerFit, element: int) -> np.ndarray:
    prior = finger_prior(fit.likelihood.prior, fit.chain, 30)[element]
    return prior.tangents @ prior.start


def test_without_repeats_the_noise_comes_from_what_is_left() -> None:
    chain = elastic((-40.0, -10.0, 15.0, 45.0))
    angle = np.concatenate([np.arange(-90, 91, 2.0), np.arange(-90, 91, 4.0)])
    radius = np.where(np.arange(len(angle)) < 91, 0.0, RADII[1])
    means = touched(chain, angle, radius, noise=1.0, force_noise=0.1, seed=4, reads=1)
    means = replace(means, pure_error_variance=np.full(4, np.nan), pure_error_dof=np.zeros(4))
    found = fit_empirical(model_fit(means, chain, 0.1))
    noise = found.calibration.noise
    assert not noise.discrepancy_sd.any()
    # an sd from 137 touches scatters by 1/sqrt(2 137) = 6 %, that of all four elements by 3 %; four of these
    np.testing.assert_allclose(noise.tactile_sd, 0.0172 * 5.0 * 200, rtol=4 / np.sqrt(2 * 137))
    assert np.sqrt(np.mean(noise.tactile_sd**2)) == pytest.approx(0.0172 * 5.0 * 200, rel=4 / np.sqrt(2 * 4 * 137))
    assert found.strength.interval()[0] < 0.005


def test_discrepancy_is_found_beside_the_error_of_noisy_loads() -> None:
    """Errors of 20 units of each element and touch, where the error of the load is up to 90 units and noise is 2."""
    chain = elastic((-40.0, -10.0, 15.0, 45.0))
    angle = np.concatenate([np.arange(-90, 91, 2.0), np.arange(-90, 91, 4.0)])
    radius = np.where(np.arange(len(angle)) < 91, 0.0, RADII[1])
    means = touched(chain, angle, radius, noise=0.3, force_noise=40.0, seed=4)
    error = 20.0 * np.random.default_rng(5).standard_normal(means.readings.shape)
    found = fit_empirical(model_fit(replace(means, readings=means.readings + error), chain, 40.0)).calibration.noise
    # an sd from 137 touches scatters by 1/sqrt(2 137) = 6 %, that of all four elements by 3 %; four of these
    np.testing.assert_allclose(found.discrepancy_sd, 20.0, rtol=4 / np.sqrt(2 * 137))
    assert np.sqrt(np.mean(found.discrepancy_sd**2)) == pytest.approx(20.0, rel=4 / np.sqrt(2 * 4 * 137))


def test_arrays_make_the_same_calibration() -> None:
    fit, _ = half_circle_fit()
    one = fit_empirical(fit, n_coefficients=40).calibration
    two = EmpiricalCalibration.from_arrays(one.arrays(), fit.chain, one.noise)
    pose = (np.array([3.0]), np.array([0.1]), np.array([200.0]))
    np.testing.assert_array_equal(one.reading_covariance(*pose), two.reading_covariance(*pose))
    np.testing.assert_array_equal(one.chain.predict(*pose), two.chain.predict(*pose))


def practice(shared_folder: Path, name: str) -> Path:
    folder = shared_folder / "practice" / name
    if not folder.is_dir():
        pytest.skip(f"no practice/{name} in the shared folder")
    return folder


def test_a_finger_without_effect_is_read_no_worse(shared_folder: Path) -> None:
    module = study("empirical_calibration")
    finger = module.calibrated(practice(shared_folder, "finger-a"))
    difference, error = module.change(finger, "Bayesian")
    assert difference < 3 * error
    # equation (6) pays for 60 coefficients that nothing asked for
    worse, error = module.change(finger, "least sq.")
    assert worse > 3 * error
    low, high = finger.empirical.strength.interval()
    assert low < 0.0015 and high < 0.01
    model, bayes = (module.read(finger, name, every=4, draws=128) for name in ("model", "Bayesian"))
    # the same touches: their own noise cancels, and half a standard error of the rms of 93 touches is left
    assert bayes["R_rms"] < model["R_rms"] * (1 + 0.5 / np.sqrt(2 * 93))


def test_a_finger_with_a_far_lobe_is_read_better(shared_folder: Path) -> None:
    module = study("empirical_calibration")
    finger = module.calibrated(practice(shared_folder, "finger-e"))
    model, least, bayes = (module.error(module.squared_errors(finger, name)) for name in module.CALIBRATIONS)
    # 1.26, 0.79 and 0.77 % of the peak, of which noise is 0.74 %
    assert bayes < 0.65 * model and bayes < least
    better, error = module.change(finger, "least sq.")
    best, _ = module.change(finger, "Bayesian")
    assert best < better < -20 * error
    low, high = finger.empirical.strength.interval()
    assert low > 0.01 and high < 0.1
    assert finger.fit.lack_of_fit > 2.5 and finger.empirical.lack_of_fit.mean() < 1.2
    plain, found = (module.read(finger, name, every=4, draws=128) for name in ("model", "Bayesian"))
    assert abs(found["R_bias"]) < 0.6 * abs(plain["R_bias"]) and found["R_rms"] < 0.95 * plain["R_rms"]
    edges = module.table_2(finger)
    assert edges["least sq. of edges alone"][1] < edges["Bayesian"][1] < edges["model"][1]
