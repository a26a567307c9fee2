"""Elements at other places than stated: readings that fall with the distance from where an element really is."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.data.averages import TouchMeans
from bayestouch.data.touches import touches_from
from bayestouch.model.misplaced import misplaced

PLACES = np.array([-20.0, -10.0, 0.0, 10.0, 20.0, 30.0])
ADVICE = "state the elements in the order of the columns, and all places in one direction"


def touched(true: np.ndarray, gain: np.ndarray | float = 1.0, width: float = 6.0, **columns: np.ndarray) -> TouchMeans:
    """Touches with loads from 1 to 3: an element reads its gain times the load over 1 + (distance/width)²."""
    rng = np.random.default_rng(3)
    place = np.stack(list(columns.values()), axis=1)
    square = ((place[:, None] - true[None]) ** 2).sum(axis=2)
    load = rng.uniform(1, 3, len(place))
    readings = gain * load[:, None] / (1 + square / width**2) + 1e-3 * rng.standard_normal(square.shape)
    return touches_from(np.arange(len(place)), readings, load=load, **columns).averaged()


ANGLES = np.arange(-28.0, 39.0, 4.0)


def said(true: np.ndarray, gain: np.ndarray | float = 1.0, **options: float) -> str:
    known = touched(true[:, None], gain, angle_deg=ANGLES, **options)
    return "".join(misplaced(known, PLACES[:, None], ("angle_deg",), "°"))


def test_elements_at_their_places() -> None:
    """As stated, a quarter of the pitch off, with gains of any sign, and as broad as the whole row."""
    assert said(PLACES) == said(PLACES + 2.5) == said(PLACES, np.array([-1.0, 5, 2, 1, 0.3, 1])) == ""
    assert said(PLACES[[0, 2, 1, 3, 4, 5]], width=40.0) == ""


def test_a_dead_element_reads_nowhere_most() -> None:
    assert said(PLACES, np.array([1.0, 1, 0, 1, 1, 1])) == ""


@pytest.mark.parametrize(
    ("order", "expected"),
    [
        (
            [0, 2, 1, 3, 4, 5],
            "elements read most at the places of others: e02 (stated at -10°) at 0° and e03 (stated at 0°) at -10°",
        ),
        (
            [2, 0, 1, 3, 4, 5],
            "elements read most at the places of others: e01 (stated at -20°) at 0°, e02 (stated at -10°) at -20° and "
            "e03 (stated at 0°) at -10°",
        ),
        (
            [5, 4, 3, 2, 1, 0],
            "the angles look reversed, as elements read most at the places of others: e01 (stated at -20°) at 30°, "
            "e02 (stated at -10°) at 20°, e03 (stated at 0°) at 10°, e04 (stated at 10°) at 0° and 2 more likewise",
        ),
    ],
)
def test_elements_in_another_order(order: list[int], expected: str) -> None:
    assert said(PLACES[order]) == f"{expected}; {ADVICE}"


def test_angles_may_pass_half_a_turn() -> None:
    known = touched(PLACES[[1, 0, 2, 3, 4, 5], None], angle_deg=ANGLES)
    turned = PLACES + 180
    known = TouchMeans(**{**vars(known), "angle_deg": np.where(ANGLES > 0, ANGLES - 180, ANGLES + 180)})
    assert "e01 (stated at 160°) at 170°" in "".join(misplaced(known, turned[:, None], ("angle_deg",), "°"))


def test_places_of_a_pad() -> None:
    """Three by two elements; x from right to left, or the list from its end."""
    places = np.array([(x, y) for y in (0.0, 8.0) for x in (0.0, 10.0, 20.0)])
    x, y = (each.ravel() for each in np.meshgrid(np.arange(-4.0, 25.0, 3.0), np.arange(-4.0, 13.0, 3.0)))
    for true, expected in (
        (places, ""),
        (places * [-1, 1] + [20, 0], "x_mm looks reversed, as elements read most at the places of others: "),
        (places[::-1], "the order of the elements looks reversed, as elements read most at the places of others: "),
        (
            places[[1, 0, 2, 3, 4, 5]],
            "elements read most at the places of others: e01 (stated at (0, 0) mm) at (10, 0) mm",
        ),
    ):
        line = "".join(misplaced(touched(true, x_mm=x, y_mm=y), places, ("x_mm", "y_mm"), " mm"))
        assert line.startswith(expected) if expected else line == ""


def test_without_loads_or_places_nothing_is_said() -> None:
    known = touched(PLACES[::-1, None], angle_deg=ANGLES)
    without = TouchMeans(**{**vars(known), "load": np.full(len(ANGLES), np.nan)})
    assert not list(misplaced(without, PLACES[:, None], ("angle_deg",), "°"))
    assert not list(misplaced(TouchMeans(**{**vars(known), "angle_deg": None}), PLACES[:, None], ("angle_deg",), "°"))
