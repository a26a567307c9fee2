"""Noise of the loads that a fit shows, against the marginal likelihood of a linear model, written out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from bayestouch.model.columns import WhiteColumns
from bayestouch.model.linear import Functions, Linearised
from bayestouch.model.load_noise import load_noise_again
from bayestouch.model.noise import LoadNoise

T, M, TRUE, NOW = 60, 4, 1.0, 3.5


@pytest.mark.parametrize("with_functions", [False, True])
def test_mean_logarithm_of_the_noise(with_functions: bool) -> None:
    """Parameters with priors, functions of time, loads read one to four times, one load not measured."""
    rng = np.random.default_rng(4)
    reads, noise = rng.integers(1, 5, T).astype(float), 0.3
    by_load = rng.uniform(0.2, 1.0, (T, M))
    jacobian, prior = rng.standard_normal((T * M, 3)), np.array([2.0, 1.0, 0.5])
    time = np.arange(T) / T
    courses = np.stack([np.sin(2 * np.pi * time), np.cos(2 * np.pi * time)])
    columns = 0.5 * courses[:, :, None] * by_load if with_functions else np.zeros((0, T, M))
    flat = columns.reshape(-1, T * M).T
    along = np.zeros((T * M, T))
    for t in range(T):
        along[t * M : (t + 1) * M, t] = by_load[t] / np.sqrt(reads[t])
    measured = np.arange(T) != 7
    sd = np.where(measured, NOW, 30.0)
    true = along @ (np.where(measured, TRUE, 30.0) * rng.standard_normal(T))
    true += jacobian @ (prior * rng.standard_normal(3)) + flat @ rng.standard_normal(flat.shape[1])
    readings = true + noise * rng.standard_normal(T * M)
    known = LoadNoise(np.log(1.4), 0.6, scatter=5.0, freedom=3.0)

    # Written out: all readings are normal given the noise s of one reading of the load.
    fixed = noise**2 * np.eye(T * M) + jacobian @ np.diag(prior**2) @ jacobian.T + flat @ flat.T

    def covariance(s: float) -> np.ndarray:
        return np.asarray(fixed + along @ np.diag(np.where(measured, s, 30.0) ** 2) @ along.T)

    logs = np.linspace(np.log(1.4) - 4 * 0.6, np.log(1.4) + 4 * 0.6, 161)
    density = np.array([multivariate_normal(cov=covariance(np.exp(u))).logpdf(readings) for u in logs])
    density += -0.5 * ((logs - np.log(1.4)) / 0.6) ** 2 - 3.0 * logs - 0.5 * 5.0 * np.exp(-2 * logs)
    weight = np.exp(density - density.max())
    wanted = np.exp(weight @ logs / weight.sum())
    assert 0.7 < wanted < 1.6 < NOW

    # The fit, whose loads have a noise of 3.5: whitened touch by touch, parameters at their most probable values.
    root = np.stack(
        [
            np.linalg.inv(np.linalg.cholesky(noise**2 * np.eye(M) + sd[t] ** 2 * np.outer(u, u) / reads[t]))
            for t, u in enumerate(by_load)
        ]
    )
    functions = Functions.of(columns, WhiteColumns.of(columns, root)) if with_functions else None
    white = np.einsum("tij,tjd->tid", root, jacobian.reshape(T, M, 3)).reshape(T * M, 3)
    there = covariance(NOW)
    mode = prior**2 * (jacobian.T @ np.linalg.solve(there, readings))
    left = np.einsum("tij,tj->ti", root, (readings - jacobian @ mode).reshape(T, M))
    linear = Linearised(left, white, np.zeros((0, M)), None, np.zeros(0, dtype=np.int64), -mode, prior**-2.0, functions)
    assert np.abs(linear.gradient()).max() < 1e-6
    load = np.where(measured, 1.0, np.nan)
    observed = SimpleNamespace(load=load, means=SimpleNamespace(reads_of_load=reads, load=load))
    fitted: Any = SimpleNamespace(
        vector=mode,
        linear=linear,
        whitening=SimpleNamespace(touches=lambda rows: np.einsum("tij,tj->ti", root, rows)),
        noise=SimpleNamespace(load_sd=sd / np.sqrt(reads)),
        model=SimpleNamespace(by_load=lambda vector: by_load, known=observed),
    )
    found = load_noise_again(fitted, known)
    np.testing.assert_allclose(found[measured], wanted / np.sqrt(reads[measured]), rtol=2e-3)
    assert found[7] == sd[7] / np.sqrt(reads[7])
