"""Noise of means of samples with what effects of the noise add, against samples of that noise drawn one by one."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.chain.noise import Noise
from bayestouch.effects.noise import Outliers
from bayestouch.model.noise import AddedNoise, NoiseModel

M, DRAWS = 4, 100_000
SD, PEAK = np.array([1.0, 2.0, 0.5, 1.5]), np.array([100.0, 80.0, 120.0, 50.0])
SIGNAL = np.array([[90.0, -20.0, 5.0, 40.0], [3.0, 60.0, 110.0, -10.0]])
# The second touch has elements that lack a few of its samples: those that lack more lack those of the others, too.
READS = np.array([6, 2])
COUNTS = np.array([[6, 6, 6, 6], [4, 2, 1, 2]])
ADDED = AddedNoise(share=0.03, power=0.5, common=0.02, common_touch=0.015, common_shared=0.3)
NOISE = NoiseModel(SD, np.ones(2), PEAK, ADDED)
# Relative standard error of a variance from so many draws is sqrt(2/n); five of them, for some thirty numbers.
CLOSE = {"rtol": 5 * np.sqrt(2 / DRAWS), "atol": 5 * np.sqrt(2 / DRAWS)}


def means_of_samples(touch: int, rng: np.random.Generator) -> np.ndarray:
    """Means of a touch's samples, (DRAWS, m): own noise, noise that grows with the signal, one error for all."""
    together = PEAK**0.7 * PEAK.mean() ** 0.3
    total = np.zeros((DRAWS, M))
    for sample in range(COUNTS[touch].max()):
        one = SD * rng.standard_normal((DRAWS, M))
        one += 0.03 * PEAK * np.sqrt(np.abs(SIGNAL[touch]) / PEAK) * rng.standard_normal((DRAWS, M))
        one += 0.02 * together * rng.standard_normal((DRAWS, 1))
        total += np.where(sample < COUNTS[touch], one, 0.0)
    return total / COUNTS[touch] + 0.015 * together * rng.standard_normal((DRAWS, 1))


@pytest.mark.parametrize("touch", [0, 1])
def test_covariance_of_means(touch: int) -> None:
    found = np.cov(means_of_samples(touch, np.random.default_rng(touch)).T)
    scale = np.sqrt(np.diag(found))
    shared = NOISE.shared_errors(COUNTS)[:, touch]
    wanted = np.diag(NOISE.own_variance(SIGNAL)[touch] / COUNTS[touch]) + shared.T @ shared
    np.testing.assert_allclose(wanted / np.outer(scale, scale), found / np.outer(scale, scale), **CLOSE)
    np.testing.assert_allclose(NOISE.variance(SIGNAL, COUNTS)[touch], np.diag(wanted), rtol=1e-12)
    added = ADDED.covariance(SIGNAL, PEAK, COUNTS)[touch]
    np.testing.assert_allclose(added + np.diag(SD**2 / COUNTS[touch]), wanted, rtol=1e-12)


def test_elements_read_equally_often_have_one_error_together() -> None:
    """An element without a sample is no part of its own; what all samples of a touch share is in the first error."""
    counts = np.array([[6, 0, 6, 6], [2, 2, 2, 2]])
    found, together = NOISE.shared_errors(counts), PEAK**0.7 * PEAK.mean() ** 0.3
    wanted = np.sqrt(0.02**2 / np.array([[6.0], [2.0]]) + 0.015**2) * together
    np.testing.assert_allclose(found, wanted[None], rtol=1e-12)
    assert np.isfinite(ADDED.covariance(SIGNAL, PEAK, 0 * counts)).all()
    only = NoiseModel(SD, np.ones(2), PEAK, AddedNoise(common_touch=0.015))
    assert len(only.shared_errors(COUNTS)) == 1


def test_shared_error_of_a_sample_is_without_that_of_its_touch() -> None:
    only = NoiseModel(SD, np.ones(2), PEAK, AddedNoise(common=0.02, common_shared=0.3))
    one_each = only.shared_errors(np.broadcast_to(READS[:, None], (2, M)))
    np.testing.assert_allclose(NOISE.shared_sd_of_sample(READS)[None], one_each, rtol=1e-12)


def test_mean_of_the_force_sensor() -> None:
    """Standard error of a mean; NaN where there is no force sensor."""
    rng = np.random.default_rng(3)
    means = rng.normal(0.0, 0.3, (DRAWS, 6)).mean(axis=1)
    assert Noise(SD, 0 * SD, 0.0, 0.3).mean_load_sd(6) == pytest.approx(means.std(), rel=5 * np.sqrt(0.5 / DRAWS))
    assert np.isnan(Noise(SD, 0 * SD).mean_load_sd([1, 4])).all()


def test_shares_of_smaller_peaks() -> None:
    """The same noise in the unit of the readings where all peaks are a fifth."""
    before = ADDED.covariance(SIGNAL, PEAK, COUNTS)
    after = ADDED.for_peaks(5.0).covariance(SIGNAL, PEAK / 5, COUNTS)
    np.testing.assert_allclose(after, before, rtol=1e-12)


def test_nothing_is_added_by_default() -> None:
    plain = NoiseModel(SD, np.ones(2), PEAK)
    np.testing.assert_array_equal(plain.own_variance(SIGNAL), np.tile(SD**2, (2, 1)))
    assert not plain.shared_errors(COUNTS).any() and not plain.shared_sd_of_sample(READS).any() and plain.names == ()
    assert AddedNoise() == AddedNoise(0.0, 1.0, 0.0, 0.0, 0.0)
    assert plain.with_(effects=((Outliers(), (0.1, 0.2)),)).names == ("outliers",)
