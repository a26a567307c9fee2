"""Noise of a pad from readings that are left out: the density written out, its slopes, and known noise found again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pad_simulation import line
from scipy.optimize import approx_fprime
from scipy.stats import multivariate_normal

import bayestouch
from bayestouch.chain.noise import Noise
from bayestouch.model.noise import AddedNoise
from bayestouch.model.split_data import SplitData
from bayestouch.pad.added_noise import NoiseByEffects, PadNoise
from bayestouch.pad.calibration import choose_pad
from bayestouch.pad.left_out import blocks_left_out
from bayestouch.pad.noise import LeftOut, _density_with_slopes, fit_noise, left_out_density

CHANNEL = Path(__file__).parents[2] / "studies" / "data" / "fluid-channels" / "fluid-water-1.5"
LOAD = np.array([1.0, 1.0, 2.0])


def left_out_of(seed: int) -> LeftOut:
    """Three touches on four elements: one reading is missing, one load was measured."""
    rng = np.random.default_rng(seed)
    signal, residual = rng.normal(size=(3, 4)), rng.normal(size=(3, 4))
    variance = rng.uniform(0.1, 0.2, (3, 4))
    residual[1, 2] = np.nan
    return LeftOut(residual, variance, signal, np.ones((3, 4), dtype=np.int64), LOAD, np.array([np.nan, np.nan, 0.3]))


def test_log_density_of_left_out_is_normal_with_a_common_load() -> None:
    left_out = left_out_of(0)
    signal, residual, variance = left_out.signal, left_out.residual, left_out.variance
    noise = Noise(np.full(4, 0.1), np.full(4, 0.2), 0.05, load_scatter=0.8)
    found = left_out_density(left_out, noise, 0.1)
    # The load scatter of 0.8 N is 0.4 of the measured load; with its standard error of 0.3 of the load it makes 0.5.
    for t, spread in enumerate((0.1, 0.1, 0.5)):
        here = np.isfinite(residual[t])
        diagonal = noise.mean_sd(np.ones(4), signal[t]) ** 2 + variance[t]
        covariance = np.diag(diagonal) + spread**2 * np.outer(signal[t], signal[t])
        expected = multivariate_normal(np.zeros(here.sum()), covariance[np.ix_(here, here)]).logpdf(residual[t, here])
        assert found[t] == pytest.approx(expected, rel=1e-10)


def test_slopes_are_those_of_the_density() -> None:
    left_out, noise = left_out_of(1), Noise(np.full(4, 0.1), np.full(4, 0.2), 0.05)
    _, by_variance, by_spread = _density_with_slopes(left_out, noise, 0.1)

    def of_variance(change: np.ndarray) -> float:
        moved = replace(left_out, variance=left_out.variance + change.reshape(3, 4))
        return float(left_out_density(moved, noise, 0.1).sum())

    # Forward differences of size h have an error of h/2 times the second derivative, here below 1e3.
    numeric = approx_fprime(np.zeros(12), of_variance, 1e-7).reshape(3, 4)
    assert by_variance[1, 2] == 0
    np.testing.assert_allclose(by_variance, numeric, atol=1e-4)
    changed = left_out_density(left_out, noise, 0.1 * np.exp(1e-6)) - left_out_density(left_out, noise, 0.1)
    np.testing.assert_allclose(by_spread[:2], changed[:2] / 1e-6, atol=1e-5)


PEAK, ZERO = np.array([1.0, 0.8, 1.2, 0.9]), np.array([0.3, 0.0, -0.1, 0.2])


def by_effects(left_out: LeftOut) -> tuple[LeftOut, PadNoise]:
    """The touches with several samples; noise of 2 % of the reading, and an error of all elements in a sample."""
    counts = np.array([[4, 4, 4, 4], [3, 3, 0, 3], [5, 5, 2, 5]])
    noise = NoiseByEffects(AddedNoise(share=0.2, common=0.3, common_touch=0.1, common_shared=0.0), PEAK, ZERO)
    return replace(left_out, counts=counts), noise.to(Noise(np.full(4, 0.1), np.full(4, 0.2), 0.05))


def test_log_density_with_effects_of_the_noise() -> None:
    left_out, noise = by_effects(left_out_of(0))
    found = left_out_density(left_out, noise, 0.1)
    for t, spread in enumerate((0.1, 0.1, 0.3)):
        here, count, signal = np.isfinite(left_out.residual[t]), left_out.counts[t], left_out.signal[t]
        most = np.maximum(np.maximum(count[:, None], count), 1)
        own = (0.1**2 + (0.2 * (ZERO + signal)) ** 2) / np.maximum(count, 1) + 0.2**2 + (0.05 * signal) ** 2
        covariance = np.diag(own + left_out.variance[t]) + spread**2 * np.outer(signal, signal)
        covariance += (0.3**2 / most + 0.1**2) * np.outer(PEAK, PEAK)
        expected = multivariate_normal(np.zeros(here.sum()), covariance[np.ix_(here, here)])
        assert found[t] == pytest.approx(expected.logpdf(left_out.residual[t, here]), rel=1e-10)


def test_slopes_with_effects_of_the_noise() -> None:
    left_out, noise = by_effects(left_out_of(1))
    _, by_variance, by_spread = _density_with_slopes(left_out, noise, 0.1)

    def of_variance(change: np.ndarray) -> float:
        moved = replace(left_out, variance=left_out.variance + change.reshape(3, 4))
        return float(left_out_density(moved, noise, 0.1).sum())

    numeric = approx_fprime(np.zeros(12), of_variance, 1e-7).reshape(3, 4)
    np.testing.assert_allclose(by_variance, numeric, atol=1e-4)
    changed = left_out_density(left_out, noise, 0.1 * np.exp(1e-6)) - left_out_density(left_out, noise, 0.1)
    np.testing.assert_allclose(by_spread[:2], changed[:2] / 1e-6, atol=1e-5)


def test_noise_is_found_again() -> None:
    rng = np.random.default_rng(5)
    n, m = 600, 4
    signal = rng.uniform(0, 1, (n, m)) * (rng.uniform(size=(n, m)) < 0.5)
    sd = np.hypot(0.01, 0.05 * signal)
    residual = sd * rng.normal(size=(n, m)) + 0.1 * rng.normal(size=(n, 1)) * signal
    one, unknown = np.ones((n, m), dtype=np.int64), np.full(n, np.nan)
    left_out = LeftOut(residual, np.zeros((n, m)), signal, one, np.ones(n), unknown)
    noise, spread = fit_noise(left_out, np.full(m, np.nan), np.nan)
    # Four standard errors of an sd from 600 touches for spread and share, half as many readings for floors.
    assert spread == pytest.approx(0.1, rel=0.13)
    assert noise.signal_share == pytest.approx(0.05, rel=0.13)
    np.testing.assert_allclose(noise.discrepancy_sd, 0.01, rtol=0.2)


def scattered(m: int, scatter: float) -> LeftOut:
    """600 touches with measured loads, which m elements read with a noise of their own and an error that they share."""
    rng = np.random.default_rng(6)
    n, floor, force = 600, 0.02, 0.01
    load, sensitivity = rng.uniform(1, 5, n), rng.uniform(0.2, 1, (n, m))
    felt = scatter * rng.normal(size=n) + force * rng.normal(size=n)
    residual = floor * rng.normal(size=(n, m)) + felt[:, None] * sensitivity
    signal = load[:, None] * sensitivity
    return LeftOut(residual, np.zeros((n, m)), signal, np.ones((n, m), dtype=np.int64), load, force / load)


@pytest.mark.parametrize("scatter", [0.05, 0.2])
def test_load_scatter_is_found_again(scatter: float) -> None:
    left_out = scattered(2, scatter)
    noise, spread = fit_noise(left_out, np.full(2, np.nan), 0.01, scattered=True)
    assert np.isnan(spread)
    # Four standard errors of an sd from 600 touches; the noise of the elements adds a third to that of the smaller one.
    assert noise.load_scatter == pytest.approx(scatter, rel=0.16)
    np.testing.assert_allclose(noise.discrepancy_sd / np.abs(left_out.signal).max(axis=0), 0.02 / 5, rtol=0.16)
    best = left_out_density(left_out, noise, spread).sum()
    for factor in (0.97, 1.03):
        moved = replace(noise, load_scatter=factor * noise.load_scatter)
        assert left_out_density(left_out, moved, spread).sum() < best


def test_noise_of_a_single_element_is_its_own() -> None:
    """It cannot be distinguished from an error that elements share."""
    noise, _ = fit_noise(scattered(1, 0.2), np.full(1, np.nan), 0.01, scattered=True)
    assert noise.load_scatter == 0
    assert noise.signal_share > 0.02


def test_elements_with_independent_errors_have_no_load_scatter() -> None:
    noise, _ = fit_noise(scattered(4, 0.0), np.full(4, np.nan), 0.01, scattered=True)
    # The force sensor's own noise of 0.01 N is known. Three standard errors of a variance that is zero.
    assert noise.load_scatter < 0.01


def test_blocks_are_of_touches_that_follow_each_other_in_time() -> None:
    """81 touches in 40 blocks, the first of three; in another order of the table the blocks have the same touches."""
    time_s = 5.0 * np.arange(81)
    shuffled = np.random.default_rng(0).permutation(81)
    for order in (np.arange(81), shuffled):
        blocks = [order[block].tolist() for block in blocks_left_out(time_s[order])]
        assert blocks == [[0, 1, 2], *([k, k + 1] for k in range(3, 81, 2))]


def test_noise_is_the_same_in_another_order_of_the_table() -> None:
    """The zeros wander with time, so that blocks of touches at other times would show another noise."""
    pad, rng, time_s = line(), np.random.default_rng(5), 5.0 * np.arange(81)
    touches = pad.touch(rng.permutation(np.linspace(6, 32, 81))[:, None], rng)
    wander = 0.1 * np.sin(time_s[:, None] / 20 + np.arange(touches.n_elements))
    touches = touches.with_(time_s=time_s, readings=touches.readings + wander)
    shuffled = touches.select(rng.permutation(81))
    first, second = (
        choose_pad(pad.dataset(each), kernel="gaussian", empirical=False).model for each in (touches, shuffled)
    )
    np.testing.assert_allclose(second.noise.discrepancy_sd, first.noise.discrepancy_sd, rtol=1e-4)
    assert second.load_spread == pytest.approx(first.load_spread, rel=1e-4)


def test_noise_of_a_measured_channel_is_not_that_of_a_lower_maximum(monkeypatch: pytest.MonkeyPatch) -> None:
    """From a small share alone, the fit takes a part of the load scatter for the floor of one element."""
    data = SplitData.of(bayestouch.load_dataset(CHANNEL))
    known = replace(data.dataset, calibration=data.table.select(data.training).with_(notes=()))
    chosen = choose_pad(known, kernel="layer", empirical=False)
    residual, variance = chosen.model.fit.without_blocks(blocks_left_out(chosen.problem.observed.touch_time_s))
    left_out = replace(chosen.model.left_out, residual=residual, variance=variance)

    def found() -> tuple[float, Noise]:
        noise, spread = fit_noise(left_out, np.full(2, np.nan), chosen.problem.force_sd, scattered=True)
        return float(left_out_density(left_out, noise, spread).sum()), noise

    best, noise = found()
    monkeypatch.setattr("bayestouch.pad.noise.START_SHARES", (0.01,))
    lower, mistaken = found()
    assert best > lower + 50
    assert mistaken.discrepancy_sd.max() > 1.5 * noise.discrepancy_sd.max()
