"""Errors of the mean readings of a finger's calibration touches with outliers among their samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.noise_with_effects import EffectNoise
from bayestouch.model.outlier_likelihood import OutlierLikelihood

# Least variance of an expected reading, over that of a sample: an element far from the touch does not feel the load.
LEAST = 1e-6


@dataclass(frozen=True, eq=False)
class MeanErrors:
    """Errors of the mean readings of n vectors, given their samples.

    Attributes
    ----------
    left, weight : (n, t, m) arrays
        Mean readings minus predicted ones, and their inverse variances; 0 where missing.
    gained : (n, t) array
        Log factor of the density of the mean readings of each touch.
    samples : (n,) array or None
        Log density of the deviations of the samples from each other; None without outliers.
    """

    left: FloatArray
    weight: FloatArray
    gained: FloatArray
    samples: FloatArray | None


def mean_errors(
    noise: EffectNoise, vectors: FloatArray, left: FloatArray, weight: FloatArray, load_sd: FloatArray | None
) -> MeanErrors:
    """Errors of the mean readings, with outliers among the samples.

    Parameters
    ----------
    noise : EffectNoise
        Noise of the samples.
    vectors : (n, d) array
        Flat vectors.
    left, weight : (n, t, m) arrays
        Errors of the means without the readings that are probably wrong, and their inverse variances.
    load_sd : (n, t, m) array or None
        Standard deviation of the expected readings by the errors of the loads. None: the vector does not say which
        readings to expect, because drifts or a correction are integrated out.
    """
    out = noise.terms
    if not isinstance(out, OutlierLikelihood):
        return MeanErrors(left, weight, np.zeros(left.shape[:2]), None)
    assert noise.scale is not None and noise.raw is not None
    at, known = noise.layout, noise.known
    predicted, missing = np.where(known.missing, 0.0, known.readings) - left, np.isnan(noise.raw)
    true, variance = np.tile(noise.raw, (len(vectors), 1, 1)), np.empty(weight.shape)
    gained, samples = np.zeros(left.shape[:2]), np.zeros(len(vectors))
    groups, scale = (out.touch, out.element), noise.scale[out.element]
    for i, vector in enumerate(vectors):
        own, (values, *_) = np.exp(2 * vector[at.noise]), noise.values(vector)
        discrepancy = np.zeros(len(own))
        if at.discrepancy:
            discrepancy = own * np.exp(2 * vector[at.log_discrepancy]) / known.typical_reads
        expected, spread = np.zeros(len(scale)), np.full(len(scale), np.inf)
        if load_sd is not None:
            expected = (predicted[i] - noise.raw)[groups] / scale
            spread = np.maximum(discrepancy + load_sd[i] ** 2, LEAST * own)[groups] / scale**2
        means = out.true_means(values, own / noise.scale**2, expected, spread)
        # A single sample: its variance is that of usual and wrong readings together.
        variance[i] = own + values[0] * (values[1] * noise.peak) ** 2
        variance[i][groups] = means.variance * scale**2
        variance[i] += discrepancy
        true[i][groups] += means.mean * scale
        gained[i] = np.bincount(out.touch, means.gained, minlength=left.shape[1])
        samples[i] = means.log_samples.sum()
    return MeanErrors(np.where(missing, 0.0, true - predicted), np.where(missing, 0.0, 1 / variance), gained, samples)
