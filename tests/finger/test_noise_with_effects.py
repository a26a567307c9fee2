"""Likelihood of the samples of a finger with noise effects, against the normal density that it stands for."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import block_diag, helmert
from scipy.stats import multivariate_normal

from bayestouch.array_types import FloatArray
from bayestouch.finger.noise_with_effects import EffectNoise, TouchSquares
from bayestouch.model.noise import AddedNoise

TOUCHES, SAMPLES, M = 9, 5, 4
PEAK = np.array([1.0, 1.3, 0.7, 1.1])
WEIGHT = np.tile([1.0, 3.0, 2.0, 1.0, 4.0], TOUCHES)
# The last element is not counted: its readings do not respond.
COUNTED = 3


def readings(lacking: bool) -> FloatArray:
    """Readings of an element are missing in one touch; single readings, too, in touches if some are `lacking`."""
    samples = np.random.default_rng(7).standard_normal((TOUCHES, SAMPLES, M))
    samples[3, :, 1], samples[4, 2], samples[2, 1, 3] = np.nan, np.nan, np.nan
    if lacking:
        samples[5, 0, 0], samples[6, :2, 2], samples[6, 3, 0], samples[7, 1] = np.nan, np.nan, np.nan, np.nan
        samples[8, 1:, 1], samples[8, 2, 0] = np.nan, np.nan
    return samples


def contrasts_density(samples: FloatArray, own: FloatArray, shared: FloatArray) -> float:
    """Density of all contrasts, written out; own variances (t, m), up to a constant."""
    total = 0.0
    for touch, rows in enumerate(samples[:, :, :COUNTED]):
        weight = np.diag(1 / WEIGHT[:SAMPLES])
        covariance = np.kron(np.diag(own[touch]) + np.outer(shared, shared), weight)
        there = ~np.isnan(rows.T)
        parts = [helmert(int(some.sum())) if some.any() else np.zeros((0, 0)) for some in there]
        contrasts, some = block_diag(*parts), there.ravel()
        law = contrasts @ covariance[np.ix_(some, some)] @ contrasts.T
        seen = contrasts @ rows.T.ravel()[some]
        total += multivariate_normal(np.zeros(len(seen)), law).logpdf(seen)
    return total


@pytest.mark.parametrize("predicts", [False, True])
@pytest.mark.parametrize("lacking", [False, True])
def test_shared_errors_of_samples_that_lack_readings(lacking: bool, predicts: bool) -> None:
    """Differences of the log density are those of the normal density of contrasts, for two noises."""
    samples, rng = readings(lacking), np.random.default_rng(8)
    signal = rng.uniform(-0.2, 1.1, (TOUCHES, M))
    weight = WEIGHT.reshape(TOUCHES, SAMPLES, 1) * ~np.isnan(samples)

    def centred(rows: FloatArray) -> FloatArray:
        mean = (weight * np.nan_to_num(rows)).sum(axis=1, keepdims=True)
        return rows - mean / np.maximum(weight.sum(axis=1, keepdims=True), 1)

    predicted = centred(0.5 * rng.standard_normal(samples.shape)) if predicts else None
    observed: Any = SimpleNamespace(
        row_touch=np.repeat(np.arange(TOUCHES), SAMPLES),
        n_touches=TOUCHES,
        deviation=centred(samples).reshape(-1, M),
        weight=WEIGHT,
    )
    squares = TouchSquares.of(observed)
    known: Any = SimpleNamespace(scatter_dof=squares.freedom.sum(axis=0) * (np.arange(M) < COUNTED))
    layout: Any = None
    noise = EffectNoise(known, layout, (), PEAK, AddedNoise(), squares)
    found, wanted = [], []
    for sd, common, share in [(0.9, 0.6, 0.2), (1.2, 0.4, 0.3), (0.5, 1.5, 0.1)]:
        own = np.full(M, sd**2) * [1.0, 1.5, 0.6, 1.0]
        added = AddedNoise(share=share, common=common, common_shared=0.4)
        per_sample = None if predicted is None else predicted.reshape(-1, M)
        found.append(noise._normal(own, added, signal, per_sample))
        grown = (share * PEAK * np.abs(signal / PEAK)) ** 2
        shared = common * PEAK**0.6 * PEAK.mean() ** 0.4
        left = samples if predicted is None else samples - predicted
        wanted.append(contrasts_density(left, (own + grown)[:, :COUNTED], shared[:COUNTED]))
    np.testing.assert_allclose(np.diff(found), np.diff(wanted), rtol=1e-10)
