"""The drift along a stream equals the regression of a Gaussian process on all touches so far, written out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.finger.reading.live_drift import DriftFilter

TIMES = np.array([3.0, 4.5, 9.0, 10.0, 31.0])
SD, TIME = 0.4, 8.0
SCALE = np.array([2.0, 5.0])


def drift(own: bool) -> Any:
    return SimpleNamespace(own=lambda values: own, scale=lambda recording: SCALE[None])


def matern(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    lag = np.sqrt(3) * np.abs(a[:, None] - b) / TIME
    return SD**2 * (1 + lag) * np.exp(-lag)


def test_filter_equals_regression() -> None:
    rng = np.random.default_rng(1)
    for own in (False, True):
        noise = np.array([[0.3, 0.1], [0.1, 0.2]])
        precision = np.linalg.inv(noise)
        seen = rng.standard_normal((len(TIMES), 2))
        state = DriftFilter.of([(drift(own), (SD, TIME))], 2)
        for k, time in enumerate(TIMES):
            state = state.at(time)
            columns = state.columns(SimpleNamespace())  # type: ignore[arg-type]
            # Regression on the touches before: covariances between elements are those of one or of two functions.
            between = np.outer(SCALE, SCALE) if not own else np.diag(SCALE**2)
            past = TIMES[:k]
            known = np.kron(matern(past, past), between) + np.kron(np.eye(k), noise)
            across = np.kron(matern(TIMES[k : k + 1], past), between)
            mean = across @ np.linalg.solve(known, seen[:k].ravel()) if k else np.zeros(2)
            covariance = SD**2 * between - (across @ np.linalg.solve(known, across.T) if k else 0.0)
            np.testing.assert_allclose(columns @ state.mean, mean, atol=1e-10)
            np.testing.assert_allclose(columns @ state.covariance @ columns.T, covariance, atol=1e-10)
            state = state.after(columns, precision, precision @ seen[k])
