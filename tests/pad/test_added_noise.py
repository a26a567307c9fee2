"""Noise of a pad with effects of the noise: covariance of means against samples that are drawn one by one."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.chain.noise import Noise
from bayestouch.model.noise import AddedNoise
from bayestouch.pad.added_noise import NoiseByEffects, PadNoise

M, DRAWS = 4, 100_000
SD, PEAK, ZERO = np.array([1.0, 2.0, 0.5, 1.5]), np.array([100.0, 80.0, 120.0, 50.0]), np.array([5.0, 0.0, -3.0, 1.0])
SIGNAL, LACK, SHARE = np.array([90.0, -20.0, 5.0, 40.0]), np.array([0.3, 0.2, 0.1, 0.4]), 0.01
# Elements that lack a few of the samples: those that lack more lack those of the others, too.
COUNTS = np.array([4.0, 2.0, 1.0, 2.0])
TOGETHER = PEAK**0.7 * PEAK.mean() ** 0.3
# Relative standard error of a variance from so many draws is sqrt(2/n); five of them.
CLOSE = 5 * np.sqrt(2 / DRAWS)


def noise(**changes: float) -> PadNoise:
    added = {"share": 0.03, "power": 0.5, "common": 0.02, "common_touch": 0.015, "common_shared": 0.3} | changes
    return NoiseByEffects(AddedNoise(**added), PEAK, ZERO).to(Noise(SD, LACK, SHARE, 0.1, 0.2))


def drawn(rng: np.random.Generator) -> np.ndarray:
    """Means of the samples of a touch, (DRAWS, m)."""
    total = np.zeros((DRAWS, M))
    for sample in range(4):
        one = SD * rng.standard_normal((DRAWS, M))
        one += 0.03 * PEAK * np.sqrt(np.abs(ZERO + SIGNAL) / PEAK) * rng.standard_normal((DRAWS, M))
        one += 0.02 * TOGETHER * rng.standard_normal((DRAWS, 1))
        total += np.where(sample < COUNTS, one, 0.0)
    lasting = 0.015 * TOGETHER * rng.standard_normal((DRAWS, 1))
    return total / COUNTS + lasting + np.hypot(LACK, SHARE * SIGNAL) * rng.standard_normal((DRAWS, M))


def test_covariance_of_means() -> None:
    found, made = np.cov(drawn(np.random.default_rng(3)).T), noise()
    shared = made.shared_errors(COUNTS[None])[:, 0]
    wanted = np.diag(made.own_variance(COUNTS, SIGNAL)) + shared.T @ shared
    scale = np.sqrt(np.diag(found))
    np.testing.assert_allclose(wanted / np.outer(scale, scale), found / np.outer(scale, scale), atol=CLOSE)
    np.testing.assert_allclose(made.mean_variance(COUNTS, SIGNAL), np.diag(wanted), rtol=1e-12)
    np.testing.assert_allclose(made.mean_sd(COUNTS, SIGNAL) ** 2, np.diag(wanted), rtol=1e-12)


def test_errors_of_each_element_alone_have_the_same_variance() -> None:
    made = noise()
    np.testing.assert_array_equal(made.apart().own_variance(COUNTS, SIGNAL), made.mean_variance(COUNTS, SIGNAL))
    assert len(made.apart().shared_errors(COUNTS[None])) == 0


def test_what_averaging_leaves() -> None:
    """The discrepancy, the share of the signal, and the error that all samples of a touch have in common."""
    wanted = LACK**2 + (SHARE * SIGNAL) ** 2 + (0.015 * TOGETHER) ** 2
    np.testing.assert_allclose(noise().lasting_variance(SIGNAL), wanted, rtol=1e-12)
    many = noise().mean_variance(np.full(M, 1e12), SIGNAL)
    np.testing.assert_allclose(many, wanted, rtol=1e-6)


def test_an_element_without_readings_has_no_noise_that_is_known() -> None:
    counts = np.array([[0.0, 3.0, 3.0, 3.0]])
    assert np.isinf(noise().own_variance(counts, SIGNAL)[0, 0])
    assert np.isinf(noise().mean_variance(counts, SIGNAL)[0, 0])
    assert np.isfinite(noise().shared_errors(counts)).all()


@pytest.mark.parametrize("common_touch", [0.0, 0.015])
def test_without_shared_errors_there_are_none(common_touch: float) -> None:
    made = noise(common=0.0, common_touch=common_touch)
    assert len(made.shared_errors(COUNTS[None])) == (common_touch > 0)


@pytest.mark.parametrize("share_of_peak", [0.0, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("made", [noise(), noise().without_effects()], ids=["with effects", "without"])
def test_a_misfit_widens_the_noise_at_every_signal(made: Noise, share_of_peak: float) -> None:
    wide, signal = made.widened(3.0), share_of_peak * PEAK
    for before, after in (
        (made.mean_sd(COUNTS, signal), wide.mean_sd(COUNTS, signal)),
        (made.own_sd(COUNTS, signal), wide.own_sd(COUNTS, signal)),
        (made.shared_errors(COUNTS[None]), wide.shared_errors(COUNTS[None])),
    ):
        np.testing.assert_allclose(after, 3 * before, rtol=1e-12)
    assert (wide.force_sd, wide.load_scatter) == (made.force_sd, made.load_scatter)


def test_the_noise_of_the_calibration_is_that_without_effects() -> None:
    plain = noise().without_effects()
    assert type(plain) is Noise
    np.testing.assert_array_equal(plain.tactile_sd, SD)
    assert (plain.signal_share, plain.force_sd, plain.load_scatter) == (SHARE, 0.1, 0.2)
