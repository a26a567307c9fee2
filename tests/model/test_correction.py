"""Sizes of corrections and what they gain, by closed forms."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from bayestouch.model import correction
from bayestouch.model.columns import WhiteColumns
from bayestouch.model.correction import SIZES, _best_sizes, _gains, fit_correction, weights_of
from bayestouch.model.linear import Functions, Linearised, Score

SLOPE, INFORMATION = np.array([60.0, -150.0]), np.array([[400.0, 100.0], [100.0, 900.0]])


def evidence(slope: np.ndarray, information: np.ndarray, size: np.ndarray) -> float:
    """Log density of a slope whose weights have these sds, over that without."""
    wide = information + information @ np.diag(size**2) @ information
    zero = np.zeros(len(slope))
    return float(
        stats.multivariate_normal(zero, wide).logpdf(slope) - stats.multivariate_normal(zero, information).logpdf(slope)
    )


def test_gain_of_a_correction() -> None:
    score = Score(SLOPE, INFORMATION, np.diag(INFORMATION))
    for other in (0.0, 0.03, 0.2):
        wanted = [evidence(SLOPE, INFORMATION, np.array([size, other])) for size in SIZES]
        assert _gains(score, np.array([True, False]), np.array([0.0, other])) == pytest.approx(wanted, abs=1e-9)
    assert _gains(score, np.array([False, True]), np.zeros(2))[0] == 0.0


def test_sizes_of_the_parts_of_a_correction() -> None:
    """Independent parts of one and of two functions: each has its own best size."""
    assert SIZES == (0.0, 0.003, 0.01, 0.03, 0.1)
    information = np.diag([1e4, 1e4, 1e4])
    slope = np.array([400.0, 50.0, -60.0])
    score, part = Score(slope, information, np.diag(information)), np.array([0, 1, 1])
    sizes, gain = _best_sizes(score, part, 2)
    best = max(((a, b) for a in SIZES for b in SIZES), key=lambda s: evidence(slope, information, np.array(s)[part]))
    assert tuple(sizes) == best and gain == pytest.approx(evidence(slope, information, np.array(best)[part]))
    nothing, gain = _best_sizes(Score(np.zeros(3), information, np.ones(3)), part, 2)
    assert not nothing.any() and gain == 0.0


@pytest.mark.parametrize(("slope", "chosen"), [(0.0, None), (400.0, 0.03)])
def test_a_correction_that_gains_nothing_is_none(
    monkeypatch: pytest.MonkeyPatch, slope: float, chosen: float | None
) -> None:
    """Information 1e4: a slope of 400 is a weight of 0.04 with sd 0.01; none, no correction."""
    made = SimpleNamespace(columns=lambda *where: {"a": np.ones((1, 2, 1))})
    score = Score(np.array([slope]), np.array([[1e4]]), np.array([1e4]))
    model = SimpleNamespace(correction_basis=lambda vector: made, correction_inputs=lambda vector: ())
    monkeypatch.setattr(correction, "Scorer", lambda linear: SimpleNamespace(of_columns=lambda columns: score))
    monkeypatch.setattr(correction, "functions_of", lambda *given: given[-1])
    monkeypatch.setattr(correction, "with_functions", lambda linear, functions: ("with", functions))
    monkeypatch.setattr(correction, "replace", lambda one, linear: (one, linear))
    whitening = SimpleNamespace(columns=lambda raw: raw)
    fitted: Any = SimpleNamespace(model=model, vector=None, linear=None, whitening=whitening, drifts=())
    found: Any = fit_correction(fitted)
    if chosen is None:
        assert found is None
    else:
        assert found[0].sizes == {"a": chosen}
        np.testing.assert_allclose(found[1][1], chosen * np.ones((1, 2, 1)))


def test_weights_of_a_correction_given_the_parameters(monkeypatch: pytest.MonkeyPatch) -> None:
    """Joint normal posterior of two parameters, a drift's weight and three of the correction, written out.

    The second parameter is held at its bound, which its derivatives count as none for; its covariance, and what the
    weights do where it goes, count it as free.
    """
    rng = np.random.default_rng(2)
    raw, jacobian, residual = rng.normal(size=(4, 5, 2)), rng.normal(size=(10, 2)), rng.normal(size=(5, 2))
    functions = Functions.of(raw, WhiteColumns.of(raw, np.broadcast_to(np.eye(2), (5, 2, 2))))
    linear = Linearised(
        residual, jacobian, np.zeros((0, 2)), None, np.zeros(0, dtype=int), np.zeros(2), np.array([0.5, 2.0]), functions
    ).holding(np.array([False, True]))
    monkeypatch.setattr(correction, "drift_columns", lambda model, vector, drifts: raw[:1])
    fitted: Any = SimpleNamespace(model=None, vector=None, drifts=(), linear=linear)
    found = weights_of(fitted)
    design = np.hstack([jacobian, raw.reshape(4, -1).T])
    joint = np.linalg.inv(design.T @ design + np.diag([0.5, 2.0, 1, 1, 1, 1]))
    own, cross, of_parameters = joint[3:, 3:], joint[3:, :2], joint[:2, :2]
    np.testing.assert_allclose(found.slope, cross @ np.linalg.inv(of_parameters))
    np.testing.assert_allclose(found.covariance, own - cross @ np.linalg.inv(of_parameters) @ cross.T)
    at_mode = np.linalg.solve(design[:, 2:].T @ design[:, 2:] + np.eye(4), design[:, 2:].T @ residual.ravel())
    np.testing.assert_allclose(found.mean, at_mode[1:])
