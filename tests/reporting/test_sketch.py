"""Drawings of the sensor: shapes are where the elements are, and colours follow the error."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from bayestouch.reporting.finger.sketch import sketch as finger_sketch
from bayestouch.reporting.pad.sketch import sketch as pad_sketch
from bayestouch.reporting.sketch import colours, fractions


def points(shape: Any) -> np.ndarray:
    return np.array(
        [[float(v) for v in each.split(",")] for each in re.findall(r"[-\d.]+,[-\d.]+", shape.attributes["d"])]
    )


def test_elements_of_a_finger_are_drawn_at_their_angles() -> None:
    angle = np.linspace(-60, 60, 25)
    error = 1.0 + (angle / 60.0) ** 2
    places = {
        "by_location": {"angle_deg": list(angle), "R_error_mm": list(error)},
        "body_mm": {"outer_radius": 10.0, "core_radius": 6.0, "sensing_radius": 8.0},
        "elements_deg": [-30.0, 0.0, 30.0],
        "best": {"angle_deg": 0.0, "R_error_mm": 1.0},
        "worst": {"angle_deg": 60.0, "R_error_mm": 2.0},
    }
    drawn = finger_sketch({"places": places})
    elements = [points(shape).mean(axis=0) for shape in drawn.shapes if shape.attributes.get("class") == "element"]
    turned = [np.degrees(np.arctan2(x, -y)) for x, y in elements]
    assert turned == pytest.approx([-30, 0, 30], abs=0.5)
    assert [np.hypot(x, y) for x, y in elements] == pytest.approx([80.0] * 3, rel=0.01)
    assert [shape.text for shape in drawn.shapes if shape.text] == ["core", "best 0°", "worst 60°"]
    assert (drawn.low, drawn.high) == ("1 mm", "2 mm")
    band = [shape.attributes["stroke"] for shape in drawn.shapes if shape.attributes.get("stroke", "").startswith("#")]
    assert len(band) == 24 and band[0] == band[-1] != band[12]


def test_a_plane_is_a_map_with_its_largest_y_on_top() -> None:
    x, y = (grid.ravel() for grid in np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0, 2.0, 3.0, 4.0], indexing="ij"))
    places = {
        "by_location": {"x_mm": list(x), "y_mm": list(y), "error_mm": list(1.0 + y)},
        "elements_mm": [[1.0, 4.0]],
        "within": "the calibrated region",
        "size_mm": {"x": 2.0, "y": 4.0},
        "best": {"x_mm": 0.0, "y_mm": 0.0, "error_mm": 1.0},
        "worst": {"x_mm": 2.0, "y_mm": 4.0, "error_mm": 5.0},
    }
    drawn = pad_sketch({"places": places})
    marks = [shape.attributes for shape in drawn.shapes if shape.attributes.get("class") == "mark"]
    assert [(float(each["cx"]), float(each["cy"])) for each in marks] == [(0.0, 300.0), (150.0, 0.0)]
    (element,) = (points(shape) for shape in drawn.shapes if shape.attributes.get("class") == "element")
    assert element.mean(axis=0) == pytest.approx([75.0, 0.0], abs=0.01)
    assert "2 × 4 mm; best and worst are within the calibrated region" in drawn.title


def test_colours_follow_the_values() -> None:
    assert fractions(np.array([2.0, 4.0, 3.0])) == pytest.approx([0, 1, 0.5])
    assert fractions(np.array([1.0, 100.0, 10.0]), logarithmic=True) == pytest.approx([0, 1, 0.5])
    assert fractions(np.array([3.0, 3.0])) == pytest.approx([0.5, 0.5])
    first, last = colours(np.array([0.0, 1.0]))
    assert first != last and re.fullmatch("#[0-9a-f]{6}", first)


@pytest.mark.parametrize("second", [-27.0, -20.0, 0.0, 40.0])
@pytest.mark.parametrize("first", [-23.0, 0.0, 30.0])
def test_labels_of_near_places_do_not_overlap(first: float, second: float) -> None:
    places = {
        "by_location": {"angle_deg": [-60.0, 0.0, 60.0], "R_error_mm": [2.0, 1.0, 2.0]},
        "body_mm": {"outer_radius": 10.0, "core_radius": 6.0, "sensing_radius": 8.0},
        "elements_deg": [0.0],
        "best": {"angle_deg": first, "R_error_mm": 1.0},
        "worst": {"angle_deg": second, "R_error_mm": 2.0},
    }
    drawn = finger_sketch({"places": places})
    best, worst = (each.attributes for each in drawn.shapes if each.text.startswith(("best", "worst")))
    # a line of the font is 9 units high, and "worst -27°" about 55 units wide
    near = abs(float(best["x"]) - float(worst["x"])) < 20 or best["text-anchor"] == worst["text-anchor"] == "end"
    assert not near or abs(float(best["y"]) - float(worst["y"])) >= 9
    top = float(drawn.view.split()[1])
    assert all(float(each["y"]) - 9 >= top for each in (best, worst))


@pytest.mark.parametrize("plane", [False, True])
def test_elements_outside_the_touched_places_are_drawn(plane: bool) -> None:
    x = np.repeat(np.linspace(10.0, 90.0, 5), 5)
    columns = {"x_mm": list(x), "error_mm": list(1.0 + x)}
    elements, best = [[0.0], [100.0]], {"x_mm": 10.0, "error_mm": 1.0}
    if plane:
        columns["y_mm"] = list(np.tile(np.linspace(0.0, 40.0, 5), 5))
        elements, best = [[0.0, -20.0], [100.0, 60.0]], best | {"y_mm": 0.0}
    places = {"by_location": columns, "elements_mm": elements, "within": "", "size_mm": {"x": 80.0, "y": 40.0}}
    drawn = pad_sketch({"places": {**places, "best": best, "worst": best}})
    left, top, width, height = map(float, drawn.view.split())
    found = [points(shape) for shape in drawn.shapes if shape.attributes.get("class") == "element"]
    assert len(found) == 2 and np.ptp([each[:, 0].mean() for each in found]) == pytest.approx(100 / 80 * 300, abs=0.1)
    for each in found:
        assert (each > [left, top]).all() and (each < [left + width, top + height]).all()
