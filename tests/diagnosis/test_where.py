"""Where what is left of a residual lives: views of two or three bins, worked out by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.diagnosis import where
from bayestouch.diagnosis.where import View, bin_ends, views, where_it_is

ENDS = np.array([0.0, 10.0, 20.0, 30.0, 40.0])


def view(square: list[float], error: list[float], ends: np.ndarray | None = ENDS, name: str = "load") -> View:
    return View(name, "N/m", ends, np.array(square), np.array(error))


def test_contrast() -> None:
    """Bins 1 ± 0.5 and 4 ± 1: weights 4 and 1, common (4 + 4)/5 = 1.6, chi-square 4·0.36 + 5.76 = 7.2 of one."""
    assert view([1.0, 4.0], [0.5, 1.0]).contrast == pytest.approx((7.2 - 1) / np.sqrt(2))
    assert view([1.0, np.nan, 4.0], [0.5, np.nan, 1.0]).contrast == pytest.approx((7.2 - 1) / np.sqrt(2))
    # three bins of one size: chi-square 0.5² · ... about their mean 2: 1 + 0 + 1 over 2 degrees of freedom
    assert view([1.0, 2.0, 3.0], [1.0, 1.0, 1.0]).contrast == pytest.approx(0.0)
    assert view([4.0, np.nan], [1.0, np.nan]).contrast == 0.0


def test_outstanding_bins_are_joined() -> None:
    """Four standard errors above the mean of the bins."""
    assert view([9.0, 9.0, 1.0, 9.0], [0.1] * 4).outstanding() == ["0 to 20 N/m", "30 to 40 N/m"]
    assert view([1.0, 9.0, 1.0, np.nan], [0.1, 0.1, 0.1, np.nan]).outstanding() == ["10 to 20 N/m"]
    assert view([9.0, 1.0, 9.0], [0.1] * 3, None).outstanding() == ["e01", "e03"]
    # mean 2: 2 above it is 4 errors of 0.5 and no more
    assert view([4.0, 0.0], [0.5, 0.5], None).outstanding() == []
    assert view([4.0, 0.0], [0.499, 0.5], None).outstanding() == ["e01"]


def test_ends_of_bins() -> None:
    np.testing.assert_allclose(bin_ends(np.array([3.0, 1.0, 1.0, 7.0])), [1, 2, 5, 7])
    np.testing.assert_allclose(bin_ends(np.arange(12.0)), [0, *(np.arange(11) + 0.5), 11])
    np.testing.assert_allclose(bin_ends(np.arange(13.0)), np.arange(13.0))
    np.testing.assert_allclose(bin_ends(np.arange(25.0)), np.arange(0, 25, 2.0))


def held(quantities: tuple[Any, ...] = ()) -> Any:
    whitened = np.array([[1.0, 3.0], [2.0, 0.0], [5.0, 7.0]])
    present = np.array([[True, True], [True, True], [False, True]])
    return SimpleNamespace(residual=whitened / 100, whitened=whitened, present=present, quantities=quantities)


def test_views_of_elements_and_quantities() -> None:
    load = np.array([[10.0, 10.0], [20.0, 20.0], [20.0, np.nan]])
    element, second = views(held((SimpleNamespace(name="load", unit="N", values=load),)))
    assert (element.name, element.ends) == ("element", None)
    np.testing.assert_allclose(element.square, [(1 + 4) / 2, (9 + 0 + 49) / 3])
    np.testing.assert_allclose(element.error, [1.0, np.sqrt(2 / 3)])
    # ends at 10, 15 and 20: the last value lies in the last bin, the missing load in none
    assert (second.name, second.unit) == ("load", "N")
    np.testing.assert_allclose(second.square, [(1 + 9) / 2, (4 + 0) / 2])


def test_bins_without_readings() -> None:
    found = where._view(held(), "x", "", np.full((3, 2), 0.5), np.array([0.0, 1.0, 2.0]))
    np.testing.assert_allclose(found.square, [(1 + 9 + 4 + 0 + 49) / 5, np.nan])
    np.testing.assert_allclose(found.error, [np.sqrt(0.4), np.nan])
    # One reading is enough.
    one = where._view(held(), "x", "", np.array([[0.5, np.nan]] * 2 + [[1.5, np.nan]]), np.array([0.0, 1.0, 2.0]))
    np.testing.assert_allclose(one.square, [(1 + 4) / 2, np.nan])
    alone = where._view(held(), "x", "", np.array([[0.5, np.nan], [1.5, np.nan], [0, np.nan]]), np.array([0.0, 1, 2]))
    np.testing.assert_allclose(alone.square, [1.0, 4.0])


def test_sentences(monkeypatch: pytest.MonkeyPatch) -> None:
    """The three most uneven views, above 4 and half of the first."""
    high = [1.0, 1.0, 1.0, 9.0]

    def told(*some: View) -> str:
        monkeypatch.setattr(where, "views", lambda _: some)
        return where_it_is(held())

    load, element = view(high, [0.2] * 4), view(high, [0.1] * 4, None)
    assert told(load, element) == "most at elements e04"
    assert told(view(high, [0.11] * 4), element) == "most at elements e04; load 30 to 40 N/m"
    time, place, size = (view(high, [0.11] * 4, name=name) for name in ("time", "place", "size"))
    assert told(time, place, size, element) == "most at elements e04; time 30 to 40 N/m; place 30 to 40 N/m"
    even = "spread evenly over elements, locations, loads, radii and time"
    assert told(view([1.0, 1.1, 1.0, 1.0], [0.1] * 4)) == even
    assert where_it_is(None) == "no touches were held out to look at"
