"""What touches say of a drift: by hand."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.chain.noise import Noise
from bayestouch.finger.reading import touches_with_effects as module
from bayestouch.finger.reading.effects import EffectContext
from bayestouch.finger.reading.reader import TouchReadings
from bayestouch.finger.reading.true_load import TrueLoads

MODE = np.array([[0.3, 0.1, 20.0], [0.6, -0.2, 50.0]])
PLACES = np.array([0.0, 0.2])


class Chain:
    """Readings P · (R + place · angle)."""

    def predict(self, radius: np.ndarray, angle: np.ndarray, load: np.ndarray) -> np.ndarray:
        return load[:, None] * (radius[:, None] + PLACES * angle[:, None])


class Context(EffectContext):
    """Readings are doubled; the covariance tells which radius, angle and load it was asked for."""

    def __init__(self) -> None:
        model = SimpleNamespace(peak=np.array([4.0, 5.0]), reference_load=30.0)
        object.__setattr__(self, "effects_chain", SimpleNamespace(model=model))

    def readings(self, static: np.ndarray, radius: Any, angle: Any, load: Any, index: Any) -> np.ndarray:
        return 2 * static

    def covariance(self, radius: np.ndarray, angle: np.ndarray, load: np.ndarray) -> np.ndarray:
        return np.stack([np.array([[r, 0.1 * a], [0.1 * a, p]]) for r, a, p in zip(radius, angle, load, strict=True)])


def evidence() -> Any:
    readings = SimpleNamespace(
        context=Context(),
        counts=np.array([[4, 1], [9, 0]]),
        readings=np.array([[13.0, 12.0], [60.0, np.nan]]),
        load=np.array([21.0, np.nan]),
        load_sd=np.array([0.5, 7.0]),
    )
    posterior: Any = SimpleNamespace(touches=readings, radius=lambda w: 5 * w**2, chain=Chain())
    return module._evidence(posterior, MODE, Noise(np.array([0.2, 0.3]), np.zeros(2)))


def test_settings() -> None:
    assert module.ROUNDS == 3


def test_what_a_touch_says_of_an_addition() -> None:
    found = evidence()
    radius = 5 * MODE[:, 0] ** 2
    predicted = 2 * MODE[:, 2:] * (radius[:, None] + PLACES * MODE[:, 1:2])
    np.testing.assert_allclose(
        found.residual, [[13 - predicted[0, 0], 12 - predicted[0, 1]], [60 - predicted[1, 0], 0]]
    )
    # Over w, angle and load: quadratic, linear and linear, so that central differences are exact.
    for touch, (w, angle, load) in enumerate(MODE):
        wanted = 2 * np.stack([np.full(2, load * 10 * w), load * PLACES, 5 * w**2 + PLACES * angle], axis=1)
        np.testing.assert_allclose(found.jacobian[touch], wanted, rtol=1e-8, atol=1e-9)


def test_covariance_of_the_readings_of_a_touch() -> None:
    """What the calibration leaves there, and noise of the mean; a hundred peaks where it is missing."""
    found = evidence()
    radius = 5 * MODE[:, 0] ** 2
    np.testing.assert_allclose(found.covariance[0], [[radius[0] + 0.04 / 4, 0.01], [0.01, 20 + 0.09]])
    np.testing.assert_allclose(found.covariance[1], [[radius[1] + 0.04 / 9, -0.02], [-0.02, 50 + 500.0**2]])


def test_prior_of_the_coordinates() -> None:
    """Loose but for a load that was measured: 4, half a radian, the reference load."""
    found = evidence()
    np.testing.assert_allclose(found.precision, [[1 / 16, 4.0, 4.0], [1 / 16, 4.0, 1 / 900]])
    np.testing.assert_allclose(found.shift, [[0, 0, 1.0], [0, 0, 0]])


@pytest.mark.parametrize("own", [False, True])
def test_columns_of_drifts(monkeypatch: pytest.MonkeyPatch, own: bool) -> None:
    """What each weight adds: the course in time times the signal, zero where it is not known."""
    drift = SimpleNamespace(name="drift", scale=lambda recording: recording.signal, own=lambda values: own)
    monkeypatch.setattr(module, "drift_basis", lambda drift, values, observed: np.array([[1.0, 2.0], [3.0, 4.0]]))
    model = SimpleNamespace(
        n_elements=2,
        peak=np.ones(2),
        reference_load=1.0,
        finger=SimpleNamespace(element_angles_deg=(0.0, 1.0)),
    )
    made: Any = SimpleNamespace(model=model, listed=SimpleNamespace(drifts=(drift,)), values={"drift": (0.1,)})
    observed: Any = SimpleNamespace(touch_time_s=np.zeros(2))
    found = module._columns(made, observed, np.array([[1.0, 10.0], [np.nan, 100.0]]))
    if own:
        assert found.shape == (2, 2, 4)
        np.testing.assert_array_equal(found[0], [[1, 2, 0, 0], [0, 0, 10, 20]])
        np.testing.assert_array_equal(found[1], [[0, 0, 0, 0], [0, 0, 300, 400]])
    else:
        np.testing.assert_array_equal(found, [[[1, 2], [10, 20]], [[0, 0], [300, 400]]])


@pytest.mark.parametrize(("drifts", "shift"), [((), 0.0), (("one",), 0.25)])
def test_drifts_are_looked_for_only_where_there_are_any(
    monkeypatch: pytest.MonkeyPatch, drifts: tuple[str, ...], shift: float
) -> None:
    """Loads are set right in both cases; what drifts add to a reading, 0.25, is taken only where one is listed."""

    @dataclass
    class Posterior:
        chain: Any
        touches: Any
        priors: Any
        whitener: Any
        table: Any

        def radius(self, logit: np.ndarray) -> np.ndarray:
            return logit

    one, many = np.ones((2, 2)), np.zeros((2, 2, 2))
    monkeypatch.setattr(EffectContext, "covariance", lambda *given: many)
    stubs: dict[str, Any] = {
        "timed_scale_and_shift": lambda *given: (one, 0 * one),
        "timed_slopes": lambda *given: np.zeros((0, 2, 2, 2)),
        "changes_load": lambda chain: True,
        "true_loads": lambda chain, angle, load, sd, exact: TrueLoads(
            load + 1.0, sd, np.zeros((3, 2)), np.zeros((2, 2))
        ),
        "FingerPosterior": Posterior,
        "noise_whitener": lambda *given: None,
        "full_whitener": lambda *given: None,
        "with_whitener": lambda posterior, whitener: posterior,
        "find_modes": lambda posterior, start: MODE,
        "_evidence": lambda *given: SimpleNamespace(about_addition=lambda: (None, None)),
        "_predicted": lambda *given: None,
        "_columns": lambda *given: None,
        "drift_of_others": lambda *given: (0.25 * one, many),
    }
    for name, stub in stubs.items():
        monkeypatch.setattr(module, name, stub)
    readings = TouchReadings(one, np.full((2, 2), 4), np.array([20.0, 30.0]), np.ones(2))
    chain: Any = SimpleNamespace(vector=None, listed=SimpleNamespace(drifts=drifts))
    sampler: Any = SimpleNamespace(noise=None, chain=None, priors=None, table=None)
    found = module.prepare(readings, None, chain, sampler, plug_in=True)  # type: ignore[arg-type]
    assert isinstance(found.context, EffectContext)
    np.testing.assert_array_equal(found.context.shift, np.full((2, 2), shift))
    np.testing.assert_array_equal(found.load, [21.0, 31.0])
