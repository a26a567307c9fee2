"""Readings that are more likely wrong than not: limits worked out by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.effects.noise import Outliers
from bayestouch.model.outliers import from_median, without_wrong


def table(readings: np.ndarray, touch: list[int], contact: list[bool] | None = None) -> Any:
    made = SimpleNamespace(readings=readings, touch=np.array(touch))
    made.in_contact = np.ones(len(touch), dtype=bool) if contact is None else np.array(contact)
    made.with_ = lambda readings: table(readings, touch, contact)
    return made


def test_from_the_median_of_the_touch() -> None:
    """Of three samples or more, in any order of rows, rest left out."""
    nan = np.nan
    readings = np.array([[1.0, 5.0], [100.0, 7.0], [4.0, nan], [9.0, 1.0], [2.0, 8.0], [50.0, 50.0]])
    found = from_median(table(readings, [7, 3, 7, 7, 3, 7], [True] * 5 + [False]))
    np.testing.assert_array_equal(found[:, 0], [-3.0, nan, 0.0, 5.0, nan, nan])
    assert np.isnan(found[:, 1]).all(), "two samples do not tell which is off"


def test_where_wrong_becomes_more_likely() -> None:
    """Sizes 0.5 and sqrt(0.25 + 2) = 1.5: x²/2 (4 - 4/9) = log((1 - p)/p) + log 3 at the limit."""
    sd, peak = np.array([0.5]), np.array([np.sqrt(50.0)])
    probability, size = 0.1, 0.2
    limit = np.sqrt(2 * (np.log(9) + np.log(3)) / (4 - 4 / 9))
    near = limit * np.array([[1 - 1e-9], [1 + 1e-9], [-1 + 1e-9], [-1 - 1e-9], [np.nan]])
    found = Outliers().wrong(near, sd, peak, (probability, size))
    np.testing.assert_array_equal(found[:, 0], [False, True, False, True, False])
    assert not Outliers().wrong(np.array([[10.0]]), sd, peak, (0.0, size)).any()


def test_wrong_readings_are_left_out() -> None:
    readings = np.array([[1.0, 2.0], [1.1, 2.1], [9.0, 2.2]])
    found = without_wrong(
        table(readings, [0, 0, 0]), Outliers(), (0.05, 0.5), np.full(2, 0.1), np.full(2, 10.0), np.ones((3, 2))
    ).readings
    np.testing.assert_array_equal(np.isnan(found), [[False, False], [False, False], [True, False]])
    np.testing.assert_array_equal(found[:2], readings[:2])
