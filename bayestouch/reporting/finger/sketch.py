"""Drawing of a finger in section, with the expected error of the radius around its surface."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.output.text import fixed, number
from bayestouch.reporting.sketch import Shape, Sketch, apart, band, element, fractions, label, top_of

# Radius of the surface in the drawing.
_OUTER = 100.0


def sketch(numbers: Mapping[str, Any]) -> Sketch:
    """Section of the finger, from the numbers of a report."""
    places, body = numbers["places"], numbers["places"]["body_mm"]
    angle, error = (np.array(places["by_location"][name], dtype=float) for name in ("angle_deg", "R_error_mm"))
    best, worst = places["best"], places["worst"]
    core, sensing = (_OUTER * body[name] / body["outer_radius"] for name in ("core_radius", "sensing_radius"))
    shapes = [_circle(_OUTER, "rubber"), _circle(core, "core"), label(0.0, 4.0, "core")]
    shapes += band(_at(angle, 1.06 * _OUTER), fractions(error), 9.0)
    shapes += [element(x, y, 3.6) for x, y in _at(np.asarray(places["elements_deg"], dtype=float), sensing)]
    labels = []
    for name, place in (("best", best), ("worst", worst)):
        x, y = _at(np.array([place["angle_deg"]]), 1.15 * _OUTER)[0]
        anchor = "start" if x > 20 else "end" if x < -20 else "middle"
        labels.append(label(x, y, f"{name} {fixed(place['angle_deg'], 0)}°", anchor))
    labels = apart(labels)
    low, high = number(best["R_error_mm"], 2), number(worst["R_error_mm"], 2)
    top = max(128.0, -top_of(labels))
    # Elements that reach round the sides need the whole section.
    bottom = 112.0 if np.abs(angle).max() > 110 else 48.0
    return Sketch(
        f"-165 {-top:g} 330 {top + bottom:g}",
        [*shapes, *labels],
        f"{low} mm",
        f"{high} mm",
        "Error of the radius R to expect at each place (rms)",
        f"Section of the finger with the expected error of R in colour around its surface: best {low} mm at "
        f"{fixed(best['angle_deg'], 0)}°, worst {high} mm at {fixed(worst['angle_deg'], 0)}°.",
    )


def _at(degrees: FloatArray, radius: float) -> FloatArray:
    """Points at angles from the tip of the finger, (n, 2); y of an SVG points down."""
    turn = np.radians(degrees)
    return radius * np.stack([np.sin(turn), -np.cos(turn)], axis=1)


def _circle(radius: float, name: str) -> Shape:
    return Shape("circle", {"r": f"{radius:.2f}", "class": name})
