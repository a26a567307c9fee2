"""Noise of touches to come on a pad that drifts, against courses of the drift that are drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drifting_pad import BASELINE, GAIN, fitted_pad, matern, pad_of, parameters

from bayestouch.chain.kernels import GaussianKernel
from bayestouch.chain.noise import Noise
from bayestouch.effects.effect import Values
from bayestouch.effects.pad import LoadNonlinearity
from bayestouch.effects.random import RandomEffect
from bayestouch.model.fitting import drift_columns
from bayestouch.pad.later_drifts import with_later_drifts

T = 24


@pytest.mark.parametrize("length", [3.0, 40.0, 2000.0])
@pytest.mark.parametrize(("drift", "kind"), [(BASELINE, ()), (GAIN, (0.0,)), (GAIN, (1.0,))])
def test_residuals_and_what_is_added_make_the_error_of_a_later_touch(
    length: float, drift: RandomEffect, kind: Values
) -> None:
    """Mean square of residuals about the mean, plus the addition = mean square of a later value about that mean.

    A gain that the elements share is added to the scatter of the load, over the rms load; one of each element to its
    own noise, over the signal.
    """
    size, n = 0.04, 40_000
    model = pad_of(T, GaussianKernel(6.0))
    time = np.asarray(model.known.touch_time_s)
    second = time > model.known.sessions[0][1]
    assert 0 < second.sum() < T
    rng = np.random.default_rng(1)
    # The tables and the later touch have courses of their own, as they are long after each other.
    correlation = matern(time, length) * (second[:, None] == second)
    course = size * np.linalg.cholesky(correlation + 1e-9 * np.eye(T)) @ rng.standard_normal((T, n))
    mean = course.mean(axis=0)
    shown = float(((course - mean) ** 2).mean())
    later = float(((size * rng.standard_normal(n) - mean) ** 2).mean())
    fitted = fitted_pad(model, (drift, (size, length, *kind)))
    noise = with_later_drifts(Noise(np.full(2, 0.05), np.full(2, 0.1), 0.02, load_scatter=0.03), fitted)
    # In units of the peaks, 5 and 7 kPa; the mean square of 40,000 normal values scatters by 0.7 %.
    zero = (noise.discrepancy_sd**2 - 0.1**2) / model.peak**2
    gain = noise.signal_share**2 - 0.02**2
    load = (noise.load_scatter**2 - 0.03**2) / np.mean(model.known.means.load**2)
    added, others = {(): (zero, [gain, load]), (0.0,): (load, [*zero, gain]), (1.0,): (gain, [*zero, load])}[kind]
    np.testing.assert_allclose(shown + added, later, rtol=0.03)
    np.testing.assert_allclose(others, 0.0, atol=1e-15)


def test_without_drifts_the_noise_is_that_of_the_calibration() -> None:
    before = Noise(np.full(2, 0.05), np.full(2, 0.1), 0.02)
    noise = with_later_drifts(before, fitted_pad(pad_of(T, GaussianKernel(6.0))))
    np.testing.assert_array_equal(noise.tactile_sd, before.tactile_sd)
    np.testing.assert_allclose(noise.discrepancy_sd, before.discrepancy_sd, rtol=1e-15)
    assert noise.signal_share == pytest.approx(0.02, rel=1e-15)


def test_effects_beside_the_drift_change_nothing() -> None:
    alone = fitted_pad(pad_of(T, GaussianKernel(6.0)), (BASELINE, (0.04, 40.0)))
    before = Noise(np.full(2, 0.05), np.full(2, 0.1), 0.02)
    model = alone.model.with_effects((LoadNonlinearity(parameters()),))
    bent = replace(alone, model=model, vector=model.extended(alone.vector, (0.01, 60.0)))
    expected = with_later_drifts(before, alone).discrepancy_sd
    np.testing.assert_allclose(with_later_drifts(before, bent).discrepancy_sd, expected, rtol=1e-12)


def test_what_the_drift_that_was_added_last_does() -> None:
    """With the earlier one it is all that drifts."""
    fitted = fitted_pad(pad_of(40, GaussianKernel(6.0)), (BASELINE, (0.04, 40.0)), (GAIN, (0.03, 60.0, 0.0)))
    first = replace(fitted, drifts=fitted.drifts[:1])
    functions = fitted.linear.functions
    assert functions is not None
    n = len(functions.raw) - len(drift_columns(fitted.model, fitted.vector, fitted.drifts[1:]))
    assert n == len(drift_columns(first.model, first.vector, first.drifts))
    earlier = np.tensordot(fitted.linear.weights()[:n], functions.raw[:n], axes=1)
    np.testing.assert_allclose(fitted.last_drifted + earlier, fitted.drifted, atol=1e-12)
    assert np.abs(fitted.last_drifted).max() > 0
