"""Integrals over location and load of one touch, against the moments of densities in closed form."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from bayestouch.finger.reading import live_nodes
from bayestouch.finger.reading.live_nodes import nodes_of

#: Mode and sd of the location (rad) and of the load (N/m) near the mode.
ANGLE, ANGLE_SD, LOAD, LOAD_SD = 0.6, 0.01, 200.0, 2.0


def integrated(monkeypatch: pytest.MonkeyPatch, tail: float, far: float) -> tuple[Any, list[int]]:
    """Nodes of a normal density with a second normal one, of twice its sd, `far` sd beside it; points used.

    `tail` is the weight of the second one; the load is normal and independent.
    """
    points = []

    def log_density(radius: np.ndarray, angle: np.ndarray, load: np.ndarray) -> np.ndarray:
        points.append(len(radius))
        z = (angle - ANGLE) / ANGLE_SD
        both = (1 - tail) * stats.norm.pdf(z) + tail * stats.norm.pdf(z, far, 2.0)
        return np.asarray(np.log(both) + stats.norm.logpdf((load - LOAD) / LOAD_SD))

    def modes(touch: Any, radius: np.ndarray, *_: Any) -> Any:
        curvature = np.array([ANGLE_SD**-2, 0.0, LOAD_SD**-2])
        return (np.full(2, ANGLE), np.full(2, LOAD)), curvature[:, None] * np.ones((3, 2))

    monkeypatch.setattr(live_nodes, "_conditional_modes", modes)
    touch: Any = SimpleNamespace(ends=(-1.0, 1.0, 0.0, 600.0), log_density=log_density)
    two = np.array([3.0, 8.0])
    return nodes_of(touch, two, np.log([0.25, 0.75]), np.full(2, ANGLE), np.full(2, LOAD)), points


def test_settings() -> None:
    assert (live_nodes.FAR_OUT, live_nodes.TAIL, live_nodes.WIDE, live_nodes.WIDE_STEP) == (4.0, 5e-3, 12, 0.75)


def test_a_normal_location_has_three_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nine points and two that look at the tails, for each of two indenters; all moments are exact."""
    nodes, points = integrated(monkeypatch, 0.0, 0.0)
    assert points == [22]
    np.testing.assert_allclose(nodes.mean, [[ANGLE] * 2, [LOAD] * 2])
    np.testing.assert_allclose(nodes.covariance, [[ANGLE_SD**2] * 2, [0.0] * 2, [LOAD_SD**2] * 2], atol=1e-12)
    np.testing.assert_allclose(nodes.log_rise, 0.0, atol=1e-12)
    np.testing.assert_allclose(nodes.log_mass, np.log([0.25, 0.75]) + np.log(ANGLE_SD * LOAD_SD))


@pytest.mark.parametrize("far", [3.0, -3.0])
def test_a_long_tail_of_the_location_is_reached(monkeypatch: pytest.MonkeyPatch, far: float) -> None:
    """A tenth of the probability is in a tail three sd away, which three points hardly see."""
    tail = 0.1
    nodes, points = integrated(monkeypatch, tail, far)
    assert points == [22, 150]
    mean = tail * far
    variance = (1 - tail) * (1 + mean**2) + tail * (4 + (far - mean) ** 2)
    np.testing.assert_allclose(nodes.mean[0], ANGLE + ANGLE_SD * mean, atol=0.01 * ANGLE_SD)
    np.testing.assert_allclose(nodes.covariance[0], ANGLE_SD**2 * variance, rtol=0.03)
    np.testing.assert_allclose(nodes.covariance[2], LOAD_SD**2)
    np.testing.assert_allclose(nodes.log_mass, np.log([0.25, 0.75]) + np.log(ANGLE_SD * LOAD_SD), atol=2e-3)
