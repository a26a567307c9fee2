"""Residuals of touches on a pad: which of them count in the tests of the columns."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayestouch.chain.noise import Noise
from bayestouch.data.averages import TouchMeans
from bayestouch.pad.reading import misfit
from bayestouch.pad.reading.misfit import PadMisfit
from bayestouch.pad.reading.reader import PadTouches
from bayestouch.reading.fault_tests import SensorMisfit

LOW, HIGH = np.array([-2.0, -1.0]), np.array([2.0, 1.0])
GAIN = np.array([[1.0, 0.3, 0.2], [1.1, -0.3, 0.2], [0.9, 0.3, -0.2], [1.0, -0.3, -0.2]])


class Plane:
    """Four elements that read load times (gain · (1, place)), known exactly, with noise that is the same everywhere."""

    load, load_sd, load_measured = 2.0, 0.1, True
    usable = np.ones(4, dtype=bool)
    noise = Noise(np.full(4, 0.1), np.full(4, 0.01), 0.01, 0.1)

    def __init__(self, by_noise: np.ndarray | None = None) -> None:
        self.by_noise = by_noise
        self.map = SimpleNamespace(
            low=LOW,
            high=HIGH,
            dimensions=2,
            n_elements=4,
            offset=np.zeros(4),
            sensitivity=GAIN[:, 0],
            slopes=self.slopes,
        )
        self.map.at = lambda place, load: (self.slopes(place)[0], np.zeros(len(place)), np.zeros((len(place), 4)))
        self.map.reading_variance = lambda variance, covariance, load: np.zeros((len(load), 4))

    def slopes(self, place: np.ndarray, load: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        return GAIN[:, 0] + place @ GAIN[:, 1:].T, np.broadcast_to(GAIN[:, 1:].T, (len(place), 2, 4))

    def predict(self, place: np.ndarray, load: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return load[:, None] * self.slopes(place)[0], np.full((len(place), 4), 0.01)

    def touches(self, means: TouchMeans) -> PadTouches:
        return PadTouches(
            means.readings, means.counts, means.load, np.full(len(means.load), 0.1), by_noise=self.by_noise
        )


def fitted(plane: Plane, place: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> SensorMisfit:
    """Residuals of touches that read one everywhere under a load of 2, fitted at `place` (t, 2)."""
    t = len(place)
    monkeypatch.setattr(misfit, "_modes", lambda *_: np.column_stack([place, np.full(t, 2.0)]))
    unknown = np.full(t, np.nan)
    means = TouchMeans(
        np.arange(t), np.ones((t, 4)), np.ones((t, 4), dtype=np.int64), np.full(4, np.nan), np.zeros(4),
        np.full(t, 2.0), unknown, unknown, unknown, None, unknown, unknown,
    )  # fmt: skip
    return PadMisfit(plane, None, means, np.arange(4), lambda _: means)(np.zeros(5, dtype=bool))  # type: ignore[arg-type]


def test_touches_at_an_edge_of_the_calibrated_region_tell_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """At any of the four edges, also where the other coordinate is well inside: the touch may lie beyond it."""
    place = np.array([[0.5, 0.4], [-1.5, 0.4], [0.5, -1.0], [0.5, 1.0], [-2.0, 0.4], [2.0, 0.4]])
    told = (fitted(Plane(), place, monkeypatch).information > 0).any(axis=1)
    np.testing.assert_array_equal(told, [True, True, False, False, False, False])


def test_what_the_others_say_of_an_element_has_the_errors_that_all_share(monkeypatch: pytest.MonkeyPatch) -> None:
    """Inverse covariance of the readings of a touch, written out: own noise, shared errors, location and load."""
    by_noise = np.array([[[0.3, 0.2, 0.3, 0.25], [0.1, 0.0, -0.1, 0.05]]])
    place = np.array([[0.5, 0.4]])
    found = fitted(Plane(by_noise), place, monkeypatch)
    signal = 2 * (GAIN[:, 0] + place[0] @ GAIN[:, 1:].T)
    noise = 0.01 * np.eye(4) + by_noise[0].T @ by_noise[0]
    slope = np.column_stack([2 * GAIN[:, 1:], signal / 2])
    touch = np.diag([*(HIGH - LOW) ** 2, 0.1**2])
    expected = np.diag(np.linalg.inv(noise + slope @ touch @ slope.T))
    np.testing.assert_allclose(found.information[0, :4], expected, rtol=1e-9)
    np.testing.assert_allclose(found.score[0, :4], np.linalg.solve(noise, 1 - signal), rtol=1e-9)
