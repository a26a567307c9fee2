"""Polynomials that stand for the series near a fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_fingers import known_touches, sensor

from bayestouch.finger.density import FingerDensity
from bayestouch.finger.fit import FingerFit, fit_finger
from bayestouch.finger.local_series import LARGEST_ERROR, REACH, LocalSeries, local_series
from bayestouch.finger.priors import FingerPriors
from bayestouch.finger.series import TouchSeries


@pytest.fixture(scope="module")
def fit() -> FingerFit:
    return fit_finger(known_touches(2).averaged(), sensor().body, FingerPriors.of(sensor())[0])[0]


@pytest.fixture(scope="module")
def near(fit: FingerFit) -> LocalSeries:
    found = FingerDensity.of(fit).predict
    assert isinstance(found, LocalSeries)
    return found


def draws(fit: FingerFit, times: float, count: int = 40) -> np.ndarray:
    rng = np.random.default_rng(5)
    return fit.vector + np.pad(
        times * rng.uniform(-1, 1, (count, len(fit.laplace.mode))) * fit.laplace.sd,
        ((0, 0), (0, len(fit.vector) - len(fit.laplace.mode))),
    )


def test_readings_near_the_fit_are_those_of_the_finger(fit: FingerFit, near: LocalSeries) -> None:
    """Against the chain, which looks readings up in tables (1e-5 of the peak), and against the series."""
    known = fit.likelihood.known
    vectors = draws(fit, REACH, 4)
    readings, slopes = near(vectors)
    series_readings, series_slopes = near.series(vectors)
    peak = np.abs(fit.chain.response) * known.typical_load
    assert np.abs((readings - series_readings) / peak).max() < 3e-6
    assert np.abs(slopes - series_slopes).max() < 1e-4 * np.abs(slopes).max()
    for vector, found in zip(vectors, readings, strict=True):
        exact = fit.likelihood.chain(vector).predict(known.radius_mm, known.angle, known.load)
        assert np.abs((found - exact) / peak).max() < 3e-5


def test_log_densities_are_those_of_the_series(fit: FingerFit, near: LocalSeries) -> None:
    """To what is allowed: of a hundred proposals one or two might be decided otherwise."""
    density = FingerDensity.of(fit)
    slow = replace(density, predict=near.series)
    vectors = draws(fit, 2.5)
    difference = density(vectors) - slow(vectors)
    assert np.ptp(slow(vectors)) > 10
    assert np.abs(difference).max() < LARGEST_ERROR


def test_beyond_its_range_the_series_is_evaluated(fit: FingerFit, near: LocalSeries) -> None:
    vectors = draws(fit, 1.0, 3)
    vectors[1, fit.likelihood.layout.log_mu] += 20 * fit.laplace.sd[fit.likelihood.layout.log_mu]
    readings, slopes = near(vectors)
    exact = near.series(vectors[1:2])
    np.testing.assert_array_equal(readings[1], exact[0][0])
    np.testing.assert_array_equal(slopes[1], exact[1][0])
    peak = np.abs(fit.chain.response) * fit.likelihood.known.typical_load
    assert np.abs((readings - near.series(vectors)[0]) / peak).max() < 3e-6


def test_a_wide_posterior_keeps_the_series(fit: FingerFit, near: LocalSeries) -> None:
    noise_sd = fit.likelihood.standard_errors(fit.vector).sd
    found = local_series(fit.likelihood.series, fit.laplace.mode, 60 * fit.laplace.sd, noise_sd)
    assert isinstance(found, TouchSeries)
