"""Densities of effects of the noise against scipy.stats, what they add to the noise of readings, and drifts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from bayestouch.chain.recording import Recording
from bayestouch.effects import RandomEffect, effect_classes
from bayestouch.effects.listing import FINGER
from bayestouch.effects.noise import CommonModeNoise, Outliers, Scatter, SignalDependentNoise
from bayestouch.model.noise import AddedNoise

RNG = np.random.default_rng(21)
N, M = 50, 5
PEAK = RNG.uniform(500.0, 1500.0, M)
RELATIVE = PEAK / PEAK.mean()
SD = RNG.uniform(0.01, 0.03, M)
SIGNAL = RNG.uniform(-0.2, 1.1, (N, M))
Z = RNG.standard_normal((N, M))
SCATTER = Scatter(Z, SIGNAL, SD, RELATIVE)


def same_but_for_a_constant(found: np.ndarray, wanted: np.ndarray, offset: float) -> None:
    np.testing.assert_allclose(found, wanted + offset, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("values", [(0.02, 0.0), (0.02, 1.0), (0.05, 0.4)])
def test_common_mode_noise_is_one_normal_variable_in_all_elements(values: tuple[float, float]) -> None:
    effect, (sd, shared) = CommonModeNoise(), values
    size = sd * PEAK ** (1 - shared) * PEAK.mean() ** shared / PEAK / SD
    covariance = np.diag(effect.own(SCATTER, values)) + np.outer(size, size)
    wanted = stats.multivariate_normal(np.zeros(M), covariance).logpdf(Z)
    same_but_for_a_constant(effect.log_density(SCATTER, values), wanted, 0.5 * M * np.log(2 * np.pi))


@pytest.mark.parametrize("values", [(0.008, 1.0), (0.01, 0.5), (0.006, 2.0)])
def test_signal_dependent_noise_adds_variances(values: tuple[float, float]) -> None:
    share, power = values
    added = (share * np.abs(SIGNAL) ** power / SD) ** 2
    variance = 1 - added.mean(axis=0) + added
    assert (1 - added.mean(axis=0)).min() > 0.1
    wanted = stats.norm(0, np.sqrt(variance)).logpdf(Z).sum(axis=1)
    found = SignalDependentNoise().log_density(SCATTER, values)
    same_but_for_a_constant(found, wanted, 0.5 * M * np.log(2 * np.pi))


@pytest.mark.parametrize("values", [(0.02, 0.05), (0.1, 0.02)])
def test_outliers_are_a_share_of_the_readings(values: tuple[float, float]) -> None:
    probability, size = values
    ratio = (size / SD) ** 2
    usual = 1 - probability * ratio
    assert usual.min() > 0.3
    density = (1 - probability) * stats.norm(0, np.sqrt(usual)).pdf(Z)
    density += probability * stats.norm(0, np.sqrt(usual + ratio)).pdf(Z)
    found = Outliers().log_density(SCATTER, values)
    same_but_for_a_constant(found, np.log(density).sum(axis=1), 0.5 * M * np.log(2 * np.pi))


def test_noise_that_is_added_to_readings() -> None:
    """In units of the readings: what whitens touches with, and what readers read with."""
    noise = AddedNoise(share=0.03, power=0.7, common=0.02, common_touch=0.01, common_shared=0.4)
    signal = SIGNAL * PEAK
    np.testing.assert_allclose(noise.variance(signal, PEAK), (0.03 * PEAK * np.abs(SIGNAL) ** 0.7) ** 2)
    np.testing.assert_allclose(noise.together(PEAK), PEAK**0.6 * PEAK.mean() ** 0.4)
    np.testing.assert_allclose(noise.shared_variance([1, 4]), [0.02**2 + 0.01**2, 0.02**2 / 4 + 0.01**2])


def test_noise_of_other_peaks_is_as_large_as_it_was() -> None:
    noise = AddedNoise(share=0.03, power=0.7, common=0.02, common_touch=0.01, common_shared=0.4)
    signal, larger = SIGNAL * PEAK, 1.2 * PEAK
    moved = noise.for_peaks(1 / 1.2)
    np.testing.assert_allclose(moved.variance(signal, larger), noise.variance(signal, PEAK))
    before, after = (
        each.shared_variance(5) * np.outer(each.together(peak), each.together(peak))
        for each, peak in ((noise, PEAK), (moved, larger))
    )
    np.testing.assert_allclose(after, before)


@pytest.mark.parametrize("name", ["baseline_drift", "gain_drift"])
def test_a_drift_has_its_size_and_time(name: str) -> None:
    """Covariance at the knots, where it is exact: sd² (1 + √3 d/l) exp(-√3 d/l); knots lie half a length apart."""
    effect = effect_classes()[name].suited(FINGER)
    assert isinstance(effect, RandomEffect)
    knots = np.arange(0.0, 1201.0, 50.0)
    basis = effect.basis(knots, (0.03, 100.0), 0.0, 1200.0)
    lag = np.sqrt(3) * np.abs(knots[:, None] - knots) / 100
    # A millionth of a millionth is added to the knots' correlation so that it has a root.
    np.testing.assert_allclose(basis @ basis.T, 0.03**2 * (1 + lag) * np.exp(-lag), atol=1e-7 * 0.03**2)


def test_a_drift_of_zeros_is_in_peaks_and_one_of_gains_in_signals() -> None:
    blank = np.zeros(N)
    recording = Recording(
        indenter_radius_mm=blank,
        place=(blank,),
        load=blank,
        time_s=blank,
        held_s=blank,
        element_place=(np.zeros(M),),
        peak=PEAK,
        reference_load=200.0,
        signal=SIGNAL * PEAK,
    )
    zeros, gains = (effect_classes()[name].suited(FINGER) for name in ("baseline_drift", "gain_drift"))
    assert isinstance(zeros, RandomEffect) and isinstance(gains, RandomEffect)
    np.testing.assert_array_equal(zeros.scale(recording), np.tile(PEAK, (N, 1)))
    np.testing.assert_array_equal(gains.scale(replace(recording, signal=SIGNAL * PEAK)), SIGNAL * PEAK)
    assert zeros.own((0.01, 60.0))
    assert gains.own((0.01, 60.0, 1.0)) and not gains.own((0.01, 60.0, 0.0))


def test_what_is_left_of_an_elements_own_noise() -> None:
    """The pooled variance less the mean of what is added: over readings that are there, and never below a floor."""
    signal = np.array([[1.0, 0.5, 1.0], [0.5, -0.25, 0.0], [0.25, 0.25, 1.0]])
    z = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, np.nan, 1.0]])
    scatter = Scatter(z, signal, np.array([0.1, 0.05, 0.01]), np.ones(3))
    # (0.05/sd)² times the mean of |signal|: 0.25 · 7/12, 1 · 3/8, 25 · 2/3.
    np.testing.assert_allclose(SignalDependentNoise().own(scatter, (0.05, 0.5)), [1 - 1.75 / 12, 1 - 0.375, 0.02])
    # 1 - 0.01 (0.5/sd)²: 1 - 0.25, 1 - 1 and below.
    np.testing.assert_allclose(Outliers().own(scatter, (0.01, 0.5)), [0.75, 0.005, 0.005])


@pytest.mark.parametrize("values", [(0.02, 0.0), (0.03, 1.0)])
def test_elements_without_readings_do_not_change_the_own_noise_of_others(values: tuple[float, float]) -> None:
    """Two of five elements are dead: the others have the own noise that they have without them, and not that of all."""
    rng = np.random.default_rng(3)
    size = 0.02 / np.array([0.024, 0.028, 0.03])
    z = size * rng.standard_normal((4000, 1)) + np.sqrt(1 - size**2) * rng.standard_normal((4000, 3))
    peak, sd = np.array([0.8, 1.0, 1.2]), 0.02 / size
    living = Scatter(z, np.zeros((4000, 3)), sd, peak)
    dead = Scatter(
        np.column_stack([np.full((4000, 2), np.nan), z]),
        np.zeros((4000, 5)),
        np.append([0.001, 0.001], sd),
        np.append([1.0, 1.0], peak),
    )
    own = CommonModeNoise().own(dead, values)
    np.testing.assert_allclose(own[2:], CommonModeNoise().own(living, values), rtol=1e-9)
    np.testing.assert_allclose(
        CommonModeNoise().log_density(dead, values), CommonModeNoise().log_density(living, values)
    )
    if values == (0.02, 0.0):
        np.testing.assert_allclose(own[2:], 1 - size**2, atol=0.04)
