"""Touch posteriors of a finger against dense quadrature, and their coverage."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import emcee
import numpy as np
import pytest
from scipy import stats

from bayestouch.chain.finger import FingerChain
from bayestouch.chain.neighbours import calibration_jacobian
from bayestouch.chain.noise import Noise
from bayestouch.finger.reading.covariance import reading_covariance
from bayestouch.finger.reading.draws import FingerSampler
from bayestouch.finger.reading.modes import find_modes, hessian_at
from bayestouch.finger.reading.profile import profile_proposal
from bayestouch.finger.reading.reader import (
    FingerPosterior,
    IndenterPriors,
    TouchReadings,
    full_whitener,
    noise_whitener,
)
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.priors.radius import RadiusOfTips
from bayestouch.reading.draws import DrawPlan, draw
from bayestouch.sampling import BlockStreams, sample_blocks

ELEMENTS = 16
NOISE_PERCENT = 1.72


def paper_finger(modulus: float = 0.15) -> FingerChain:
    angles = np.radians((np.arange(ELEMENTS) - 7.5) * 8.8)
    return FingerChain(
        9.4, 12.7, np.full(ELEMENTS, 5.0), np.full(ELEMENTS, 9.9), angles, np.zeros(ELEMENTS), 0.46, modulus, 300.0
    )


def noise() -> Noise:
    return Noise(np.full(ELEMENTS, NOISE_PERCENT / 100 * 5.0 * 200), np.zeros(ELEMENTS), 0.0, 1.0)


def readings_of(
    chain: FingerChain, radius: np.ndarray, angle: np.ndarray, seed: int, load_known: bool
) -> TouchReadings:
    rng = np.random.default_rng(seed)
    load = np.full(len(radius), 200.0)
    clean = chain.predict(radius, angle, load)
    return TouchReadings(
        readings=clean + noise().tactile_sd * rng.standard_normal(clean.shape),
        counts=np.ones(clean.shape, dtype=np.int64),
        load=load + rng.standard_normal(len(load)) if load_known else np.full(len(load), np.nan),
        load_sd=np.ones(len(load)),
    )


def posterior_of(touches: TouchReadings, chain: FingerChain) -> FingerPosterior:
    priors = IndenterPriors.of(chain, 200.0)
    table = ReadingTable.of(chain, *priors.location.support)
    return FingerPosterior(chain, touches, priors, noise_whitener(noise(), touches), table)


# Composite radius and angle: an edge, within 2 % of the flat, between two elements, above one, beyond the last one.
HARD = np.array([[0.3, 0.0], [12.5, 0.0], [4.0, 8.8], [4.0, 4.4], [6.0, 70.0], [9.5, -30.0]])


def quadrature(posterior: FingerPosterior, touch: int, mode: np.ndarray, hessian: np.ndarray) -> dict[str, np.ndarray]:
    """Mean, sd and 5 / 95 % quantiles of R, θ_c and P by summing the density, written out, over a box of 8 sds (all R).

    Independent normal readings and load, uniform R and location; the chain itself in place of its table.
    """
    sd, touches = np.sqrt(np.diag(np.linalg.inv(hessian))), posterior.touches
    radius = (np.arange(160) + 0.5) / 160 * posterior.chain.outer_radius_mm
    angle = mode[1] + sd[1] * np.linspace(-8, 8, 49)
    load = mode[2] + sd[2] * np.linspace(-8, 8, 49)
    log = np.empty((160, 49, 49))
    for i, one in enumerate(radius):
        predicted = posterior.chain.predict(one, angle[:, None], load)
        z = (predicted - touches.readings[touch]) / noise().tactile_sd
        log[i] = -0.5 * (z * z).sum(axis=-1)
    if np.isfinite(touches.load[touch]):
        log += stats.norm(touches.load[touch], touches.load_sd[touch]).logpdf(load)
    weight = np.exp(log - log.max())
    out = {}
    for name, axis, values in (("R", 0, radius), ("theta_c", 1, angle), ("P", 2, load)):
        marginal = weight.sum(axis=tuple(i for i in range(3) if i != axis))
        marginal /= marginal.sum()
        mean = marginal @ values
        cumulative = np.cumsum(marginal) - 0.5 * marginal
        out[name] = np.array(
            [
                mean,
                np.sqrt(marginal @ (values - mean) ** 2),
                np.interp(0.05, cumulative, values),
                np.interp(0.95, cumulative, values),
            ]
        )
    return out


@pytest.mark.slow
@pytest.mark.parametrize("load_known", [True, False])
def test_posteriors_agree_with_quadrature(load_known: bool) -> None:
    agree_with_quadrature(HARD, load_known, draws=40000)


@pytest.mark.slow
def test_posteriors_by_moves_of_emcee_agree_with_quadrature() -> None:
    agree_with_quadrature(HARD[:1], True, draws=40000, moves=emcee.moves.StretchMove())


def agree_with_quadrature(cases: np.ndarray, load_known: bool, **options: Any) -> None:
    chain = paper_finger()
    touches = readings_of(chain, cases[:, 0], np.radians(cases[:, 1]), 11, load_known)
    posterior = posterior_of(touches, chain)
    exact = replace(posterior, table=None)
    mode = find_modes(exact)
    hessian = hessian_at(exact, mode)
    proposal = profile_proposal(posterior, mode, hessian)
    drawn = sample_blocks(posterior.log_density, proposal, walkers=4, seed=2, **options)
    draws = drawn.draws.reshape(-1, len(cases), 3)
    ess = drawn.ess_bulk.min(axis=1)
    for touch in range(len(cases)):
        expected = quadrature(posterior, touch, mode[touch], hessian[touch])
        values = {
            "R": posterior.radius(draws[:, touch, 0]),
            "theta_c": draws[:, touch, 1],
            "P": draws[:, touch, 2],
        }
        # A quantile scatters by 2.1 sds over the root of the effective sample size.
        within = max(0.05, 4 * 2.1 / np.sqrt(ess[touch]))
        for name, (mean, sd, low, high) in expected.items():
            monte_carlo = sd / np.sqrt(ess[touch])
            where = f"touch {touch} {name}"
            # plus a thousandth of the sd for the quadrature's own step
            assert abs(values[name].mean() - mean) < 4 * monte_carlo + 1e-3 * sd, where
            assert values[name].std() == pytest.approx(sd, rel=max(0.03, 4 / np.sqrt(2 * ess[touch]))), where
            np.testing.assert_allclose(
                np.quantile(values[name], [0.05, 0.95]), [low, high], atol=within * sd, err_msg=where
            )


def test_table_is_the_chain_to_within_a_hundredth_of_the_log_likelihood() -> None:
    """DESIGN allows 0.03; at a raw sample's noise the worst of a thousand points within three sds is below 0.02."""
    chain = paper_finger()
    rng = np.random.default_rng(1)
    radius, angle = rng.uniform(0.3, 12.6, 64), rng.uniform(-0.9, 0.9, 64)
    posterior = posterior_of(readings_of(chain, radius, angle, 3, True), chain)
    exact = replace(posterior, table=None)
    mode = find_modes(exact)
    root = np.linalg.cholesky(np.linalg.inv(hessian_at(exact, mode)))
    x = mode[:, None] + np.einsum("bij,bwj->bwi", root, rng.standard_normal((64, 16, 3)))
    difference = posterior.log_density(x, np.arange(64)) - exact.log_density(x, np.arange(64))
    assert np.abs(difference - np.median(difference, axis=1, keepdims=True)).max() < 0.03


def test_modes_are_maxima_whatever_the_radius() -> None:
    chain = paper_finger()
    rng = np.random.default_rng(9)
    radius, angle = rng.uniform(0.05, 12.65, 200), rng.uniform(-1.0, 1.0, 200)
    posterior = replace(posterior_of(readings_of(chain, radius, angle, 4, True), chain), table=None)
    mode = find_modes(posterior)
    blocks = np.arange(200)
    at_mode = posterior.log_density(mode[:, None], blocks)[:, 0]
    truth = np.stack([np.log(radius / (12.7 - radius)), angle, np.full(200, 200.0)], axis=-1)
    assert np.all(at_mode >= posterior.log_density(truth[:, None], blocks)[:, 0])
    steps = np.array([0.02, 2e-4, 0.05])
    for axis in range(3):
        for sign in (-1, 1):
            moved = mode.copy()
            moved[:, axis] += sign * steps[axis]
            # no neighbour is higher by more than the climb's tolerance
            assert np.all(posterior.log_density(moved[:, None], blocks)[:, 0] < at_mode + 2e-3)


def test_missing_readings_drop_out() -> None:
    """A touch whose element is missing has the posterior of a finger without that element."""
    chain = paper_finger()
    touches = readings_of(chain, np.array([5.0]), np.array([0.02]), 5, True)
    lost = touches.readings.copy()
    lost[0, 8] = np.nan
    counts = touches.counts.copy()
    counts[0, 8] = 0
    part = replace(touches, readings=lost, counts=counts)
    keep = np.arange(ELEMENTS) != 8
    smaller = FingerChain(
        9.4,
        12.7,
        chain.response[keep],
        chain.sensing_radius_mm[keep],
        chain.angle[keep],
        np.zeros(15),
        0.46,
        0.15,
        300.0,
    )
    without = TouchReadings(touches.readings[:, keep], touches.counts[:, keep], touches.load, touches.load_sd)
    small_noise = replace(noise(), tactile_sd=noise().tactile_sd[keep], discrepancy_sd=np.zeros(15))
    priors = IndenterPriors.of(chain, 200.0)
    a = FingerPosterior(chain, part, priors, noise_whitener(noise(), part))
    b = FingerPosterior(smaller, without, priors, noise_whitener(small_noise, without))
    x = np.array([[[0.1, 0.02, 200.0], [-1.0, 0.0, 199.0]]])
    np.testing.assert_allclose(a.log_density(x, np.array([0])), b.log_density(x, np.array([0])), rtol=1e-9)


def test_calibration_covariance_is_that_of_repeated_calibrations() -> None:
    """Readings predicted with calibrations drawn from a small covariance scatter as the propagated covariance says."""
    chain = paper_finger()
    rng = np.random.default_rng(6)
    m = ELEMENTS
    sd = np.concatenate([np.full(m, 0.01), np.full(m, 0.01), np.full(m, 2e-4), [3e-4, 0.02]])
    mix = rng.standard_normal((len(sd), len(sd))) / np.sqrt(len(sd))
    covariance = sd[:, None] * (0.5 * np.eye(len(sd)) + 0.5 * mix @ mix.T) * sd
    touch = (np.array([6.0]), np.array([0.03]), np.array([200.0]))
    expected = reading_covariance(calibration_jacobian(chain, *touch), covariance)[0]
    root = np.linalg.cholesky(covariance)
    draws = 300
    predicted = np.empty((draws, m))
    for i in range(draws):
        step = root @ rng.standard_normal(len(sd))
        moved = chain.with_(
            response=chain.response + step[:m],
            sensing_radius_mm=chain.sensing_radius_mm + step[m : 2 * m],
            angle=chain.angle + step[2 * m : 3 * m],
            poisson_ratio=chain.poisson_ratio + step[3 * m],
            shear_modulus_MPa=chain.shear_modulus_MPa * np.exp(step[3 * m + 1]),
        )
        predicted[i] = moved.predict(*touch)[0]
    # Readings in units in which they are to be independent and of variance 1: m draws times so many squares, whose mean
    # scatters by sqrt(2/(m draws)) = 2 %, so that 4 of these are 4 % of an sd
    white = np.linalg.solve(np.linalg.cholesky(expected), (predicted - chain.predict(*touch)[0]).T)
    assert np.mean(white**2) == pytest.approx(1, abs=4 * np.sqrt(2 / (m * draws)))
    # each alone, and each pair
    scatter = np.cov(white) - np.eye(m)
    assert np.abs(np.diag(scatter)).max() < 4 * np.sqrt(2 / draws)
    assert np.abs(scatter - np.diag(np.diag(scatter))).max() < 4.5 / np.sqrt(draws)


def test_full_whitener_inverts_the_whole_covariance() -> None:
    chain = paper_finger()
    touches = readings_of(chain, np.array([5.0, 2.0]), np.array([0.0, 0.1]), 5, True)
    rng = np.random.default_rng(1)
    root = rng.standard_normal((2, ELEMENTS, ELEMENTS))
    extra = root @ root.swapaxes(1, 2)
    whitener = full_whitener(noise(), touches, extra)
    total = extra + np.eye(ELEMENTS) * noise().tactile_sd ** 2
    np.testing.assert_allclose(
        whitener @ total @ whitener.swapaxes(1, 2), np.tile(np.eye(ELEMENTS), (2, 1, 1)), atol=1e-9
    )


def test_proposal_density_is_that_of_its_draws() -> None:
    """The density it states integrates to one over its draws' neighbours: mean of p/q over draws from q is 1."""
    chain = paper_finger()
    touches = readings_of(chain, HARD[:, 0], np.radians(HARD[:, 1]), 12, True)
    posterior = posterior_of(touches, chain)
    mode = find_modes(posterior)
    proposal = profile_proposal(posterior, mode, hessian_at(posterior, mode))
    x, log_q = proposal.draw(BlockStreams(1, range(len(HARD))), 20_000)
    np.testing.assert_allclose(proposal.log_density(x), log_q, atol=1e-9)
    # any normalised density inside the proposal's support has mean weight 1: a normal a third as wide
    centre, sd = np.median(x, axis=1), np.subtract(*np.quantile(x, [0.75, 0.25], axis=1)) / 1.35 / 3
    z = (x - centre[:, None]) / sd[:, None]
    log_p = -0.5 * (z * z).sum(axis=-1) - np.log(sd).sum(axis=-1)[:, None] - 1.5 * np.log(2 * np.pi)
    weight = np.exp(log_p - log_q)
    error = weight.std(axis=1) / np.sqrt(weight.shape[1])
    assert np.all(np.abs(weight.mean(axis=1) - 1) < 4.5 * error)


def weak_touches() -> tuple[FingerSampler, TouchReadings]:
    """A finger of six elements, and three light touches 14° or 16° beside them, then one on them."""
    angles, one = np.radians((np.arange(6) - 2.5) * 8.8), np.ones(6)
    chain = FingerChain(9.4, 12.7, 5.0 * one, 9.9 * one, angles, 0 * one, 0.46, 0.15, 300.0)
    noisy = Noise(17.2 * one, 0 * one, 0.0, 1.0)
    load = np.array([30.0, 25.0, 20.0, 200.0])
    clean = chain.predict(np.array([6.0, 11.0, 2.0, 8.0]), np.radians([36.0, -36.0, 38.0, 3.0]), load)
    readings = clean + 17.2 * np.random.default_rng(2).standard_normal(clean.shape)
    touches = TouchReadings(readings, np.ones(clean.shape, dtype=np.int64), load, np.ones(4))
    priors = IndenterPriors.of(chain, 200.0)
    return FingerSampler(chain, priors, ReadingTable.of(chain, *priors.location.support), noisy, None), touches


def location_on_a_grid(sampler: FingerSampler, touches: TouchReadings, number: int) -> tuple[float, float]:
    """Mean and sd of θ_c, degree, by a sum over R, θ_c and P of the written-out density."""
    low, high = sampler.priors.location.support
    radius = 12.7 * (np.arange(40) + 0.5) / 40
    angle = low + (high - low) * (np.arange(600) + 0.5) / 600
    load = touches.load[number] + np.linspace(-4, 4, 9)
    predicted = sampler.chain.predict(*np.meshgrid(radius, angle, load, indexing="ij"))
    z = (predicted - touches.readings[number]) / sampler.noise.tactile_sd
    log = -0.5 * (z**2).sum(axis=-1) - 0.5 * (load - touches.load[number]) ** 2
    share = np.exp(log - log.max()).sum(axis=(0, 2))
    share /= share.sum()
    mean = share @ np.degrees(angle)
    return float(mean), float(np.sqrt(share @ (np.degrees(angle) - mean) ** 2))


@pytest.mark.parametrize("method", ["emcee", "importance"])
@pytest.mark.parametrize("tips", [False, True])
def test_light_touches_may_be_at_several_locations(method: str, tips: bool) -> None:
    """Beside either end of the elements: the draws are at all of these places, each as often as it is probable."""
    sampler, touches = weak_touches()
    if tips:
        # Forty tips that lie as those of the grid: the posterior of the location is the same.
        radius = 12.7 * (np.arange(40) + 0.5) / 40
        tip = tuple((radius * 12.7 / (12.7 - radius)).tolist())
        known = RadiusOfTips(tip, (1 / 40,) * 40, None, 12.7)
        sampler = replace(sampler, priors=replace(sampler.priors, radius=known))
    drawn = draw(sampler, touches.select(np.arange(3)), DrawPlan(8192, seed=1, method=method), workers=1)
    np.testing.assert_array_equal(drawn["grade"], 1.0)
    for number in range(3):
        mean, sd = location_on_a_grid(sampler, touches, number)
        assert sd > 12.0
        found = drawn["theta_c"][:, :, number]
        # 2,000 effective draws at least
        assert found.mean() == pytest.approx(mean, abs=4 * sd / np.sqrt(2000))
        assert found.std() == pytest.approx(sd, rel=0.08)


def test_a_touch_at_one_location_is_drawn_as_without_the_others() -> None:
    sampler, touches = weak_touches()
    groups = list(sampler.groups(touches, np.arange(4)))
    assert [group.rows.tolist() for group in groups] == [[3], [0, 1, 2]]
    (alone,) = sampler.groups(touches, np.array([3]))
    together, _ = groups[0].proposal.draw(BlockStreams(1, [7]), 50)
    by_itself, _ = alone.proposal.draw(BlockStreams(1, [7]), 50)
    np.testing.assert_array_equal(together, by_itself)


@pytest.mark.parametrize(
    ("touches", "again", "sizes"),
    [
        (0, False, []),
        (1, False, [1]),
        (1000, False, [500, 500]),
        (1500, False, [375] * 4),
        (2048, False, [512] * 4),
        (4096, False, [1024] * 4),
        (4097, False, [683] * 5 + [682]),
        (512, True, [128] * 4),
        (1024, True, [128] * 8),
    ],
)
def test_four_cores_have_work_where_there_is_enough(touches: int, again: bool, sizes: list[int]) -> None:
    """Two pieces of 1,024 would leave two of four cores without work. Numbers of pieces are even, for two cores."""
    sampler: Any = None
    pieces = FingerSampler.pieces(sampler, np.arange(touches), again)
    assert [len(each) for each in pieces] == sizes
    assert [row for each in pieces for row in each] == list(range(touches))
