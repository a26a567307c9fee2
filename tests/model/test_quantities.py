"""What residuals are looked at against: values of two touches and two elements by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.finger.quantities import quantities as of_finger
from bayestouch.model.quantities import Quantity, previous_readings
from bayestouch.pad.quantities import quantities as of_pad


def observed() -> Any:
    """Touches at 5 to 6 and at 9 s; others ended at 2, 5 and 8 s."""
    history = SimpleNamespace(end_s=np.array([2.0, 5.0, 8.0]), readings=np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]))
    return SimpleNamespace(
        n_touches=2,
        row_touch=np.array([0, 1, 0]),
        time_s=np.array([5.0, 9.0, 6.0]),
        touch_time_s=np.array([5.5, 9.0]),
        history=history,
        unit="s",
    )


def test_reading_of_the_touch_before() -> None:
    """One that ended at the very time at which a touch begins is that touch itself; none before the first is zero."""
    np.testing.assert_array_equal(previous_readings(observed()), [[1.0, 2.0], [5.0, 6.0]])
    first = observed()
    first.time_s = np.array([2.0, 2.1, 3.0])
    np.testing.assert_array_equal(previous_readings(first), [[0.0, 0.0], [1.0, 2.0]])


def test_quantities_of_a_finger() -> None:
    found = of_finger(
        observed(),
        np.array([10.0, 30.0]),
        np.array([12.0, 25.0]),
        np.array([3.0, 3.0]),
        np.array([40.0, 80.0]),
        np.array([[0.5, 0.1], [0.2, 0.9]]),
        np.array([10.0, 20.0]),
    )
    values = {each.name: (each.unit, each.values.tolist()) for each in found}
    assert values == {
        "angle from element to touch": ("degree", [[2.0, -18.0], [15.0, -5.0]]),
        "location": ("degree", [[12.0, 12.0], [25.0, 25.0]]),
        "load": ("N/m", [[40.0, 40.0], [80.0, 80.0]]),
        "time": ("s", [[5.5, 5.5], [9.0, 9.0]]),
        "predicted reading": ("% of the peak", [[50.0, 10.0], [20.0, 90.0]]),
        "reading of the touch before": ("% of the peak", [[10.0, 10.0], [50.0, 30.0]]),
    }, "R is the same in both touches"


def test_quantities_of_a_pad() -> None:
    """The first element reads 1 without touch, and the touches before 1 and 5."""
    zero = np.array([1.0, 0.0])
    share, peak, load = np.array([[0.5, 0.1], [0.2, 0.9]]), np.array([10.0, 20.0]), np.array([np.nan, 2.0])
    x, y = np.array([1.0, 4.0]), np.array([2.0, 2.0])
    ends = (np.array([0.0, 5.0]),)
    line = {e.name: e.values.tolist() for e in of_pad(observed(), ends, (x,), load, share, peak, zero)}
    assert line["place from element to touch"] == [[1.0, -4.0], [4.0, -1.0]] and line["x"] == [[1, 1], [4, 4]]
    assert "load" not in line and "y" not in line and line["predicted signal"] == [[50, 10], [20, 90]]
    assert line["reading of the touch before"] == [[0, 10], [40, 30]] and line["time"] == [[5.5, 5.5], [9, 9]]
    elements = (np.array([1.0, 5.0]), np.array([2.0, -1.0]))
    plane = {e.name: e.values.tolist() for e in of_pad(observed(), elements, (x, y), load, share, peak, zero)}
    assert plane["distance from element to touch"] == [[0.0, 5.0], [3.0, np.hypot(1, 3)]]
    assert "y" not in plane and "place from element to touch" not in plane and plane["x"] == [[1, 1], [4, 4]]


def test_what_varies() -> None:
    """By more than a billionth of the largest value."""
    for values, varies in (
        ([1.0, 1.0], False),
        ([1.0, np.nan], False),
        ([np.nan, np.nan], False),
        ([1.0, 1 + 2e-9], True),
        ([1.0, 1 + 5e-10], False),
        ([-1.0, 1.0], True),
        ([0.0, 0.0], False),
    ):
        assert Quantity("", "", np.array([values])).varies == varies
