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

LOW, HIGH = np.array([-2.0, -1.0]), np.array([2.0, 1.0])
GAIN = np.array([[1.0, 0.3, 0.2], [1.1, -0.3, 0.2], [0.9, 0.3, -0.2], [1.0, -0.3, -0.2]])


class Plane:
    """Four elements that read load times (gain · (1, place)), known exactly, with noise that is the same everywhere."""

    load, load_sd, load_measured = 2.0, 0.1, True
    usable = np.ones(4, dtype=bool)
    noise = Noise(np.full(4, 0.1), np.full(4, 0.01), 0.01, 0.1)

    def __init__(self) -> None:
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

    @property
    def apart(self) -> Plane:
        return self

    def slopes(self, place: np.ndarray, load: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        return GAIN[:, 0] + place @ GAIN[:, 1:].T, np.broadcast_to(GAIN[:, 1:].T, (len(place), 2, 4))

    def predict(self, place: np.ndarray, load: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return load[:, None] * self.slopes(place)[0], np.full((len(place), 4), 0.01)

    def touches(self, means: TouchMeans) -> PadTouches:
        return PadTouches(means.readings, means.counts, means.load, np.full(len(means.load), 0.1))


def test_touches_at_an_edge_of_the_calibrated_region_tell_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """At any of the four edges, also where the other coordinate is well inside: the touch may lie beyond it."""
    place = np.array([[0.5, 0.4], [-1.5, 0.4], [0.5, -1.0], [0.5, 1.0], [-2.0, 0.4], [2.0, 0.4]])
    t = len(place)
    monkeypatch.setattr(misfit, "_modes", lambda *_: np.column_stack([place, np.full(t, 2.0)]))
    unknown = np.full(t, np.nan)
    means = TouchMeans(
        np.arange(t), np.ones((t, 4)), np.ones((t, 4), dtype=np.int64), np.full(4, np.nan), np.zeros(4),
        np.full(t, 2.0), unknown, unknown, unknown, None, unknown, unknown,
    )  # fmt: skip
    found = PadMisfit(Plane(), None, means, np.arange(4), lambda _: means)(np.zeros(5, dtype=bool))  # type: ignore[arg-type]
    told = (found.information > 0).any(axis=1)
    np.testing.assert_array_equal(told, [True, True, False, False, False, False])
