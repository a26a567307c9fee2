"""Touches in the order of their places are said to be; those in random order are not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.checking.order import ENOUGH, in_scan_order


def made(x: np.ndarray, y: np.ndarray | None = None, time: np.ndarray | None = None) -> Any:
    angle, x_mm = (x, None) if y is None else (None, x)
    time_s = np.full(len(x), np.nan) if time is None else time
    return SimpleNamespace(angle_deg=angle, x_mm=x_mm, y_mm=y, time_s=time_s)


def test_a_scan_of_a_finger() -> None:
    """To and fro, and several times, are scans too."""
    there = np.linspace(-90, 90, 40)
    for angle in (there, np.concatenate([there, there[::-1]]), np.tile(there, 4)):
        assert in_scan_order(made(angle))


@pytest.mark.parametrize("seed", range(20))
def test_a_random_order(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle = rng.permutation(np.linspace(-90, 90, ENOUGH))
    assert not in_scan_order(made(angle))
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(9.0), np.arange(9.0)))
    order = rng.permutation(81)
    assert not in_scan_order(made(x[order], y[order]))
    assert in_scan_order(made(x, y))


def test_times_decide_on_the_order_if_all_are_known() -> None:
    """A table may be sorted by place though the touches were made in random order, or the other way round."""
    order = np.random.default_rng(0).permutation(40)
    place = np.linspace(-90, 90, 40)
    assert not in_scan_order(made(place, time=order.astype(float)))
    assert in_scan_order(made(place[order], time=order.astype(float)))
    assert in_scan_order(made(place, time=np.zeros(40)))  # times that do not differ keep the order of the table
    assert in_scan_order(made(place, time=np.append(order[1:], np.nan)))


def test_what_cannot_be_a_scan() -> None:
    """Too few touches, one place, or unknown places."""
    assert not in_scan_order(made(np.linspace(-90, 90, ENOUGH - 1)))
    assert not in_scan_order(made(np.zeros(100)))
    assert not in_scan_order(made(np.full(100, np.nan)))
    assert not in_scan_order(SimpleNamespace(angle_deg=None, x_mm=None, y_mm=None))  # type: ignore[arg-type]


@pytest.mark.parametrize(("step", "scan"), [(0.45, True), (0.55, False)])
def test_limit(step: float, scan: bool) -> None:
    """On a circle of length one places a constant step apart; the median distance of random pairs of points is 0.293.

    Differences d of two even points in [0, 1] have density 2 (1 - d), so that their median is 1 - sqrt(0.5). A quarter
    of the steps go the long way round, which a median does not see.
    """
    place = (step * (1 - np.sqrt(0.5)) * np.arange(20_000)) % 1.0
    # Monte Carlo error of the median of random pairs: 1 / (2 density sqrt(n)) = 0.0025, under one per cent of it
    assert in_scan_order(made(place)) == scan
