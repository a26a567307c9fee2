"""Filter of drifts, beside the covariance of all readings written out."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.model.drift_filter import filtered


@pytest.mark.parametrize("time", [[0.7, 0.7, 0.7], [0.7, 2.0, 0.3]], ids=["one time", "three times"])
def test_equals_the_covariance_of_all_readings(time: list[float]) -> None:
    """Seven touches of two readings in two sessions, three Matérn functions, two rows, two cases."""
    rng = np.random.default_rng(4)
    t, m, c, r = 7, 2, 3, 2
    at = np.array([0.0, 0.1, 0.5, 1.4, 1.5, 2.5, 2.6])
    session = np.array([0, 0, 0, 0, 1, 1, 1])
    gap = np.where(np.diff(session, prepend=-1) == 0, np.diff(at, prepend=0.0), np.inf)
    rows, seen = rng.standard_normal((2, t, m, r)), 2 * rng.standard_normal((2, t, m, c))
    touches = [(rows[:, k], seen[:, k]) for k in range(t)]
    gram, volume = filtered(touches, gap, np.array([time, time[::-1]]))
    apart = np.abs(at[:, None] - at)
    same = session[:, None] == session
    for case, times in enumerate([time, time[::-1]]):
        covariance = np.eye(t * m)
        for k, length in enumerate(times):
            scaled = np.sqrt(3) * apart / length
            correlation = np.where(same, (1 + scaled) * np.exp(-scaled), 0.0)
            along = seen[case, :, :, k].ravel()
            covariance += along[:, None] * along * np.kron(correlation, np.ones((m, m)))
        flat = rows[case].reshape(t * m, r)
        np.testing.assert_allclose(gram[case], flat.T @ np.linalg.solve(covariance, flat), rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(volume[case], np.linalg.slogdet(covariance)[1], rtol=1e-10)
