"""What random effects and effects of the noise draw in a simulation, against closed forms of their distributions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from bayestouch.chain.recording import Recording
from bayestouch.effects.listing import FINGER
from bayestouch.effects.noise import CommonModeNoise, Outliers, SignalDependentNoise
from bayestouch.effects.random import BaselineDrift, GainDrift, RandomEffect

PEAK = np.array([500.0, 1000.0, 1500.0])


def recording(n: int, peak: np.ndarray, time_s: np.ndarray | None = None) -> Recording:
    """Readings of 0.8 of the peaks."""
    zero, time_s = np.zeros(n), np.arange(n) * 1.0 if time_s is None else time_s
    return Recording(
        zero, (zero,), zero + 1, time_s, zero, (np.zeros(len(peak)),), peak, 1.0, np.tile(0.8 * peak, (n, 1))
    )


@pytest.mark.parametrize(("kind", "more", "scale"), [(BaselineDrift, (), 1.0), (GainDrift, (1.0,), 0.8)])
def test_drifts_have_the_stated_sd_and_the_matern_correlation(
    kind: type[RandomEffect], more: tuple[float, ...], scale: float
) -> None:
    """At the knots, half a correlation time apart, the process has both exactly."""
    effect = kind.suited(FINGER)
    assert effect is not None
    sd, time, m = 0.02, 600.0, 20000
    row = recording(11, np.full(m, 1000.0), np.arange(11) * time / 2)
    course = effect.simulate(row, (sd, time, *more), np.random.default_rng(1)) / 1000 - 0.8
    away = np.sqrt(3) * np.abs(np.subtract.outer(row.time_s, row.time_s)) / time
    wanted = (scale * sd) ** 2 * (1 + away) * np.exp(-away)
    # a covariance from 20,000 courses is known to 1 % of the variance: five times that
    np.testing.assert_allclose(course @ course.T / m, wanted, rtol=0, atol=0.05 * wanted[0, 0])
    # all variances together to 0.5 %: this sees 5 % in the sd, which is 10 % here
    assert np.trace(course @ course.T) / m == pytest.approx(np.trace(wanted), rel=0.03)


@pytest.mark.parametrize("values", [(0.03, 0.0), (0.03, 1.0), (0.03, 0.4)])
def test_errors_that_all_elements_share_have_the_stated_sd(values: tuple[float, float]) -> None:
    sd, shared = values
    errors = CommonModeNoise().errors(recording(20000, PEAK), values, np.random.default_rng(1))
    # an sd from 20,000 draws is known to 0.5 %
    np.testing.assert_allclose(errors.std(axis=0), sd * PEAK ** (1 - shared) * 1000.0**shared, rtol=0.02)
    assert np.corrcoef(errors.T).min() > 1 - 1e-12
    assert stats.kstest(errors[:, 0] / errors[:, 0].std(), "norm").pvalue > 1e-3


@pytest.mark.parametrize("power", [1.0, 0.5, 2.0])
def test_errors_that_grow_with_the_signal_have_the_stated_sd(power: float) -> None:
    errors = SignalDependentNoise().errors(recording(20000, PEAK), (0.05, power), np.random.default_rng(1))
    np.testing.assert_allclose(errors.std(axis=0), 0.05 * 0.8**power * PEAK, rtol=0.02)
    assert np.abs(np.corrcoef(errors.T) - np.eye(3)).max() < 0.03
    assert stats.kstest(errors[:, 0] / errors[:, 0].std(), "norm").pvalue > 1e-3


def test_outliers_have_the_stated_share_and_sd() -> None:
    errors = Outliers().errors(recording(100000, PEAK), (0.1, 0.3), np.random.default_rng(1)) / PEAK
    hit = errors != 0
    # 300,000 readings, 30,000 of them wrong: the share is known to 0.5 %, the sd to 0.4 %
    assert hit.mean() == pytest.approx(0.1, rel=0.02)
    assert errors[hit].std() == pytest.approx(0.3, rel=0.02)
    assert stats.kstest(errors[hit] / 0.3, "norm").pvalue > 1e-3
    assert np.abs(np.corrcoef(hit.T.astype(float)) - np.eye(3)).max() < 0.02
