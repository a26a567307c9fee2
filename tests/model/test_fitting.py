"""Fits of small models against their exact maxima, and the columns of drifts by hand."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.chain.recording import Recording
from bayestouch.effects.random import BaselineDrift, GainDrift
from bayestouch.model import fitting
from bayestouch.model.base import Predicted
from bayestouch.model.fitting import Fitted, drift_basis, drift_columns, fit, fit_from_both, spread_over_elements
from bayestouch.model.noise import NoiseModel

X = np.array([0.0, 1.0, 2.0, 3.0])


@dataclass(frozen=True)
class Curve:
    """One element reads a + x^b, with priors a ~ N(0, 2), b ~ N(1, 1) between bounds."""

    readings: np.ndarray
    low: tuple[float, float] = (-np.inf, -np.inf)
    high: tuple[float, float] = (np.inf, np.inf)
    home: tuple[float, float] | None = None
    effects: tuple[Any, ...] = ()
    n_base: int = 2

    @property
    def known(self) -> Any:
        n = len(X)
        means = SimpleNamespace(readings=self.readings[:, None], counts=np.full((n, 1), 4))
        return SimpleNamespace(
            means=means,
            n_touches=n,
            row_touch=np.zeros(0, dtype=np.int64),
            weight=np.zeros(0),
            deviation=np.zeros((0, 1)),
            touch_time_s=X,
            span=(0.0, 3.0),
            sessions=(),
        )

    def predict(self, vector: Any) -> Predicted:
        return Predicted((vector[0] + X ** vector[1])[:, None], None)

    def by_load(self, vector: Any) -> np.ndarray:
        return np.zeros((len(X), 1))

    def derivatives(self, vector: Any) -> tuple[np.ndarray, None]:
        log = np.log(np.maximum(X, 1e-300))
        return np.stack([np.ones(len(X)), np.where(X > 0, X ** vector[1] * log, 0.0)])[:, :, None], None

    def with_derivatives(self, vector: Any) -> tuple[Predicted, np.ndarray, None]:
        return self.predict(vector), *self.derivatives(vector)

    def prior(self) -> Any:
        return np.array([0.0, 1.0]), np.array([2.0, 1.0]), np.array(self.low), np.array(self.high)

    def reset_to_nominal(self, vector: Any) -> Any:
        return None if self.home is None else np.array(self.home)

    def zero(self, vector: Any) -> np.ndarray:
        return np.array([0.5])

    def poses(self, vector: Any) -> Recording:
        n = np.zeros(len(X))
        return Recording(n, (n,), n, X, n, (np.zeros(1),), np.array([7.0]), 1.0, np.zeros((len(X), 1)))

    def cost(self, a: float, b: float) -> float:
        """Half the squares of (reading - prediction) over 0.2/sqrt(4), and of the priors."""
        squares = ((self.readings - a - X**b) / 0.1) ** 2
        return 0.5 * float(squares.sum() + (a / 2) ** 2 + (b - 1) ** 2)


NOISE = NoiseModel(np.array([0.2]), np.zeros(4), np.array([7.0]))


def fitted(model: Curve, **options: Any) -> Fitted:
    return fit(model, np.array([0.0, 1.0]), NOISE, **options)  # type: ignore[arg-type]


def test_maximum_of_a_curve() -> None:
    from scipy.optimize import minimize

    model = Curve(np.array([0.3, 1.2, 3.1, 5.9]))
    found = fitted(model, enough=1e-12)
    exact = minimize(lambda v: model.cost(*v), [0.0, 1.0], options={"gtol": 1e-9})
    np.testing.assert_allclose(found.vector, exact.x, atol=1e-5)
    assert found.linear.cost() == pytest.approx(exact.fun) and found.n_readings == 4
    squares = ((model.readings - found.vector[0] - X ** found.vector[1]) / 0.1) ** 2
    assert found.chi_square() == pytest.approx(squares.sum())
    assert found.excess == pytest.approx(0.5 * (squares.sum() - 4))
    np.testing.assert_array_equal(found.drifted, np.zeros((4, 1)))
    # To within 0.05 of the maximum by default.
    assert fitted(model).linear.cost() < exact.fun + 0.05


@pytest.mark.parametrize("side", [-1, 1])
def test_a_parameter_that_would_leave_its_range_is_held(side: int) -> None:
    """The power would be 1.6: it is held at 1.5, or kept from below at 1.7; what is left is linear."""
    bounds = {"high": (np.inf, 1.5)} if side > 0 else {"low": (-np.inf, 1.7)}
    end = 1.5 if side > 0 else 1.7
    model = Curve(0.3 + X**1.6, **bounds)  # type: ignore[arg-type]
    found = fitted(model, enough=1e-12)
    assert found.vector[1] == pytest.approx(end, abs=1e-8)
    # Four readings with precision 100 each, a prior of precision 1/4.
    assert found.vector[0] == pytest.approx(100 * (model.readings - X**end).sum() / 400.25, rel=1e-6)
    assert found.linear.held is not None and found.linear.held.tolist() == [False, True]
    free = fitted(Curve(0.3 + X**1.6))
    assert free.linear.held is None


@pytest.mark.parametrize(
    ("home", "costs", "starts"),
    [
        (None, [4.0], []),
        ((0.0, 1.0), [5.0, 4.0], [[0.0, 1.0]]),
        # The same maximum from both: no third fit.
        ((0.0, 1.0), [4.0, 4.04], [[0.0, 1.0]]),
        ((0.0, 1.0), [4.5, 5.0, 4.0], [[0.0, 1.0], [0.0, 9.0]]),
    ],
)
def test_the_best_of_several_starts(monkeypatch: pytest.MonkeyPatch, home: Any, costs: Any, starts: Any) -> None:
    """The first parameter is of the body, the second of an effect."""
    left = iter(costs)
    seen: list[Any] = []

    def one(model: Any, start: Any, noise: Any, drifts: Any, whitening: Any, enough: float) -> Any:
        seen.append((np.asarray(start).tolist(), whitening))
        cost = next(left)
        return SimpleNamespace(vector=start, whitening="first", linear=SimpleNamespace(cost=lambda: cost), cost=cost)

    monkeypatch.setattr(fitting, "fit", one)
    found: Any = fit_from_both(Curve(X, n_base=1, home=home), np.array([9.0, 9.0]), NOISE)  # type: ignore[arg-type]
    assert found.cost == 4.0 and seen[0] == ([9.0, 9.0], None)
    assert seen[1:] == [(start, "first") for start in starts]


def test_functions_that_have_hardly_changed() -> None:
    """By less than five per cent, root mean square."""
    then = np.full((2, 3, 4), 2.0)
    assert fitting._nearly_equal(then * 1.0499, then) and not fitting._nearly_equal(then * 1.0501, then)
    assert fitting._nearly_equal(then * 0.9501, then) and not fitting._nearly_equal(then * 0.9499, then)


def test_a_drift_of_its_own_for_each_session() -> None:
    """Ends belong to both sides of nothing: functions of one session are zero in the other."""
    drift = BaselineDrift(())
    time = np.array([0.0, 4.0, 10.0, 15.0])
    known: Any = SimpleNamespace(touch_time_s=time, span=(0.0, 15.0), sessions=((0.0, 4.0), (10.0, 15.0)))
    values = (0.3, 2.0)
    found = drift_basis(drift, values, known)
    first, second = drift.basis(time, values, 0.0, 4.0), drift.basis(time, values, 10.0, 15.0)
    k = first.shape[1]
    np.testing.assert_array_equal(found[:2, :k], first[:2])
    np.testing.assert_array_equal(found[2:, k:], second[2:])
    assert first[:2].any(axis=1).all() and not found[2:, :k].any() and not found[:2, k:].any()
    known.sessions = ()
    np.testing.assert_array_equal(drift_basis(drift, values, known), drift.basis(time, values, 0.0, 15.0))
    # A session that begins when the one before ends: a touch at that time has the functions of one of them.
    known.sessions = ((0.0, 4.0), (4.0, 15.0))
    found = drift_basis(drift, values, known)
    variance = (found**2).sum(axis=1)
    assert not found[1, :k].any() and np.ptp(variance) < 0.1 * variance.mean()


def test_columns_of_functions() -> None:
    """Of all elements together, or one for each."""
    basis, scale = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]), np.array([[1.0, 10.0], [2.0, 20.0]])
    together = spread_over_elements(basis, scale, own=False)
    np.testing.assert_array_equal(together[0], [[1, 10], [4, 40]])
    own = spread_over_elements(basis, scale, own=True)
    assert own.shape == (6, 2, 2)
    np.testing.assert_array_equal(own[1], [[3, 0], [8, 0]])
    np.testing.assert_array_equal(own[5], [[0, 50], [0, 120]])
    full = np.array([[[1.0, 2.0], [3.0, 4.0]]])
    np.testing.assert_array_equal(spread_over_elements(full, scale, own=False)[0], [[1, 20], [6, 80]])


def test_columns_of_drifts() -> None:
    """A gain multiplies the reading less that without touch; a baseline the peak."""
    model, vector = Curve(X), np.array([0.2, 2.0])
    drifts = ((GainDrift(()), (0.1, 1.0, 0.0)), (BaselineDrift(()), (0.2, 3.0)))
    found = drift_columns(model, vector, drifts)  # type: ignore[arg-type]
    gain = drifts[0][0].basis(X, drifts[0][1], 0.0, 3.0).T * (0.2 + X**2 - 0.5)
    base = drifts[1][0].basis(X, drifts[1][1], 0.0, 3.0).T * 7.0
    np.testing.assert_allclose(found[:, :, 0], np.concatenate([gain, base]))
    assert drift_columns(model, vector, ()).shape == (0, 4, 1)  # type: ignore[arg-type]


def test_a_drift_takes_what_a_curve_cannot() -> None:
    """The maximum over parameters and standard normal weights together, solved at once for b = 1 held."""
    readings = 0.3 + X + np.array([0.0, 0.4, -0.4, 0.2])
    model = Curve(readings, low=(-np.inf, 1.0), high=(np.inf, 1.0 + 1e-12))
    drifts = ((BaselineDrift(()), (0.05, 1.0)),)
    found = fitted(model, drifts=drifts, enough=1e-12)
    basis = drifts[0][0].basis(X, drifts[0][1], 0.0, 3.0) * 7.0
    design = np.column_stack([np.ones(4), basis])
    precision = np.diag([0.25, *np.ones(basis.shape[1])])
    mode = np.linalg.solve(100 * design.T @ design + precision, 100 * design.T @ (readings - X))
    assert found.vector[0] == pytest.approx(mode[0], abs=1e-6)
    np.testing.assert_allclose(found.drifted[:, 0], basis @ mode[1:], atol=1e-6)
    assert found.names == ("baseline_drift",)


class Broken(Curve):
    """The curve, which is no number beyond a power of 1.4."""

    def predict(self, vector: Any) -> Predicted:
        found = super().predict(vector)
        return found if vector[1] <= 1.4 else Predicted(np.full_like(found.touches, np.nan), None)


@pytest.mark.parametrize("drifts", [(), ((BaselineDrift(()), (0.05, 1.0)),)])
def test_a_step_to_no_number_is_not_taken(drifts: Any) -> None:
    """The maximum is at a power of 1.6; with drifts, too. NaN counted as a missing reading, which always fits."""
    found = fitted(Broken(0.3 + X**1.6), drifts=drifts)
    assert 1.1 < found.vector[1] <= 1.4
    assert np.isfinite(found.linear.cost())
