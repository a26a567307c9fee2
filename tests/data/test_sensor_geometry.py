"""Geometries answer the same questions for every body, and refuse where another body is needed."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from bayestouch.data.geometry import geometries
from bayestouch.data.sensor import Finger, Pad, Sensor, finger_of, pad_of
from bayestouch.data.sensor_toml import sensor_from_toml
from bayestouch.errors import InputError

FINGER = Finger(10.0, 14.0, 12.0, (20.0, -10.0, 0.0, 8.0))
LINE = Pad((0.0, 6.0, 13.0), thickness_mm=3.0)
PLANE = Pad((0.0, 6.0), (1.0, 5.0), thickness_mm=3.0, depth_mm=2.0)
# What one geometry has beside its own lengths.
OWN = {"pitch_deg", "near", "dimensions", "places_mm"}


def public(body: type) -> set[str]:
    """Names that are no length or angle of the body itself."""
    return {name for name in dir(body) if not name.startswith("_")} - {each.name for each in fields(body)} - OWN


def test_every_body_answers_the_same_questions() -> None:
    first, *others = (public(body) for body in geometries().values())
    assert len(first) > 10
    assert all(other == first for other in others)


@pytest.mark.parametrize("body", geometries().values())
def test_keys_are_those_of_the_geometry(body: type[Finger] | type[Pad]) -> None:
    assert body.geometry_keys == tuple(each.name for each in fields(body))
    assert set(body.required_keys) | {body.elements_key} <= set(body.geometry_keys)
    for key in body.geometry_keys:
        assert f"\n{key} = " in body.template or f"\n# {key} = " in body.template
    assert f"# {body.force_noise_key} = " in body.template


def test_pitch_is_the_median_of_neighbours_in_order() -> None:
    """Angles in order: -10, 0, 8, 20; differences 10, 8, 12."""
    assert FINGER.pitch_deg == 10.0
    assert Finger(10.0, 14.0, 12.0, (3.0,)).pitch_deg is None


@pytest.mark.parametrize(
    ("angles", "pitch"),
    [
        ((350.0, 0.0, 10.0), 10.0),
        ((-10.0, 370.0, 0.0), 10.0),
        ((350.0, 10.0), 20.0),
        ((0.0, 90.0, 180.0, 270.0), 90.0),
        ((0.0, 200.0), 160.0),
        ((-8.8, 0.0, 8.8), 8.8),
    ],
)
def test_neighbours_are_found_around_the_circle(angles: tuple[float, ...], pitch: float) -> None:
    """Without the largest gap, at which the row of elements ends; at equal angles to the bit as before."""
    assert Finger(10.0, 14.0, 12.0, angles).pitch_deg == pitch


def test_rows_of_what_was_built() -> None:
    rows = {quantity: (value, unit) for quantity, value, unit in FINGER.as_built()}
    assert rows["sensing radius r_s, design"] == (12.0, "mm")
    # 14 mm times 10 degrees is 14 pi / 18.
    assert rows["the same along the surface"] == (2.443, "mm")
    built = {quantity: value for quantity, value, _ in PLANE.as_built()}
    assert built["elements from y ="] == 1.0 and built["to x ="] == 6.0 and built["depth of the elements"] == 2.0
    assert "elements from y =" not in {quantity for quantity, *_ in LINE.as_built()}


def test_location_columns_of_a_line_and_a_plane() -> None:
    assert (LINE.location_columns, PLANE.location_columns) == (("x_mm",), ("x_mm", "y_mm"))
    assert LINE.places_mm == {"x": (0.0, 6.0, 13.0)} and PLANE.places_mm["y"] == (1.0, 5.0)


def test_another_body_is_refused_in_one_line() -> None:
    finger, pad = Sensor("f", FINGER), Sensor("p", LINE)
    assert finger_of(finger) is FINGER and pad_of(pad) is LINE
    with pytest.raises(InputError, match=r"^reading a radius is offered for fingers; this sensor is a pad$"):
        finger_of(pad, "reading a radius")
    with pytest.raises(InputError, match=r"^a kernel is offered for pads; this sensor is a finger$"):
        pad_of(finger, "a kernel")


def test_a_body_that_is_not_known_is_refused_with_those_that_are() -> None:
    for kind in ('"ball"', '["pad"]'):
        with pytest.raises(InputError, match='expected "finger" or "pad", got'):
            sensor_from_toml(f"body = {kind}\n")


@pytest.mark.parametrize("elements", [(-30.0, 0.0, 30.0), (0.0, 30.0, 330.0)])
@pytest.mark.parametrize("angles", [[-28.0, -10.0, np.nan, 5.0, 26.0], [332.0, 350.0, np.nan, 5.0, 26.0]])
def test_extent_of_a_finger_does_not_depend_on_the_turn(elements: tuple[float, ...], angles: list[float]) -> None:
    finger = Finger(core_radius_mm=9.0, outer_radius_mm=12.0, sensing_radius_mm=10.0, element_angles_deg=elements)
    low, high = finger.extent(np.array(angles))
    assert high - low == pytest.approx(54.0)
    assert (low + 28.0) % 360 == pytest.approx(0.0)


def test_extent_all_around_and_in_the_turn_of_the_elements() -> None:
    finger = Finger(
        core_radius_mm=9.0, outer_radius_mm=12.0, sensing_radius_mm=10.0, element_angles_deg=(170.0, 180.0, 190.0)
    )
    assert finger.extent(np.arange(0.0, 360.0, 10.0)) == (0.0, 350.0)
    assert finger.extent(np.array([-170.0, 165.0])) == pytest.approx((165.0, 190.0))
    assert Pad((0.0, 6.0), None, 6.0, 6.0).extent(np.array([3.0, np.nan, -1.0])) == (-1.0, 3.0)
