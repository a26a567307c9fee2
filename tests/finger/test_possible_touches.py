"""Touches that could decide between two models: which tips, places and loads, and their series in words."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.finger import possible_touches as possible

COLUMNS = {"tip": [0.0, 0.0, np.inf, np.inf, 6.0, 6.0], "load": [50.0, 120.0] * 3}


def observed(**changes: Any) -> Any:
    """Touches with an edge, a flat and a tip of 6 mm under two loads, between -10 and 25.5 degree."""
    columns = {**COLUMNS, **changes}
    means = SimpleNamespace(
        angle_deg=np.linspace(-10, 25.5, len(columns["tip"])),
        load=np.array(columns["load"]),
        indenter_radius_mm=np.array(columns["tip"]),
    )
    return SimpleNamespace(means=means)


def test_series_in_words() -> None:
    kinds = dict(possible._series(observed()))
    over = "evenly from -10 to 25.5 degree"
    wanted = {
        f"with an edge, {over}, under 50 N/m": [0],
        f"with a tip of 6 mm, {over}, under 50 N/m": [4],
        f"with a flat, {over}, under 50 N/m": [2],
        f"with all the tips in turn, {over}, under 50 N/m": [0, 2, 4],
        f"with an edge, {over}, under 120 N/m": [1],
        f"with a tip of 6 mm, {over}, under 120 N/m": [5],
        f"with a flat, {over}, under 120 N/m": [3],
        f"with all the tips in turn, {over}, under 120 N/m": [1, 3, 5],
    }
    assert {name: rows.tolist() for name, rows in kinds.items()} == wanted


def test_elements_that_are_never_read_are_not_predicted() -> None:
    table: Any = SimpleNamespace(readings=np.array([[1.0, np.nan, np.nan], [2.0, np.nan, 4.0]]))
    np.testing.assert_array_equal(possible._some_readings(table, 2), [[0.0, np.nan, 0.0]] * 2)


def test_touches_that_are_considered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two tips, eleven places from first to last, least, median and largest load; at the end of the time."""
    table = SimpleNamespace(readings=np.ones((5, 2)))
    table.select = lambda rows: SimpleNamespace(with_=lambda **columns: columns)
    means = SimpleNamespace(
        angle_deg=np.array([-20.0, 30.0, 5.0]),
        indenter_radius_mm=np.array([6.0, np.inf, 6.0]),
        counts=np.array([[1.5, 0], [2, 2.5], [3, 1]]),
        samples=np.array([3.0, 5.0, 9.0]),
    )
    known = SimpleNamespace(table=table, means=means, unit="s", history="h", span=(3.0, 70.0), sessions=())
    monkeypatch.setattr(possible, "Observations", SimpleNamespace(of=lambda *given: given))
    monkeypatch.setattr(possible, "_series", lambda observed: iter([("with all", observed)]))
    found = possible.possible_touches(known, np.array([10.0, 50.0, 20.0]))  # type: ignore[arg-type]
    rows, time, held, *_ = found.observed  # type: ignore[misc]
    assert found.series == (("with all", found.observed),)
    n = 2 * 11 * 3
    assert (time.tolist(), held.tolist()) == ([70.0] * n, [0.0] * n)
    np.testing.assert_allclose(np.unique(rows["angle_deg"]), np.arange(-20, 31, 5.0))
    assert set(rows["indenter_radius_mm"]) == {6.0, np.inf} and set(rows["load"]) == {10.0, 20.0, 50.0}
    assert len(set(zip(rows["angle_deg"], rows["indenter_radius_mm"], rows["load"], strict=True))) == n
    np.testing.assert_array_equal(rows["touch"], np.arange(n))
    assert set(rows["reads"]) == {5.0} and set(rows["contact"]) == {1.0} and set(rows["sample"]) == {0}
    assert np.isnan(rows["time_s"]).all() and rows["readings"].shape == (n, 2) and rows["readings_sd"] is None
