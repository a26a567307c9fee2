"""Drawing of the sensor on the first screen: shapes of an SVG, so that it follows light and dark and any width."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.output.pictures import ORDERED

_STOPS = 7
# Height of a line and width of a letter of a label, whose font has 9 units (style.css).
_LINE, _LETTER = 11.0, 5.5


@dataclass(frozen=True)
class Shape:
    """Element of an SVG: its tag, its attributes, and the text inside."""

    tag: str
    attributes: dict[str, str]
    text: str = ""


@dataclass(frozen=True)
class Sketch:
    """Drawing of a sensor with the expected error in colour.

    Attributes
    ----------
    view : str
        ``viewBox`` of the SVG.
    shapes : sequence of Shape
        What is drawn, from back to front.
    low, high : str
        Texts at the ends of the colour scale.
    title : str
        What the colour shows.
    alt : str
        Description for readers who cannot see it.
    """

    view: str
    shapes: Sequence[Shape]
    low: str
    high: str
    title: str
    alt: str

    @property
    def scale(self) -> str:
        """Colours of the scale, for a CSS gradient."""
        return ", ".join(colours(np.linspace(0.0, 1.0, _STOPS)))


def colours(fraction: FloatArray) -> list[str]:
    """Colours (hexadecimal) of values from 0 (small error) to 1."""
    import matplotlib
    from matplotlib.colors import to_hex

    return [to_hex(colour) for colour in matplotlib.colormaps[ORDERED](np.asarray(fraction, dtype=float))]


def fractions(values: FloatArray, *, logarithmic: bool = False) -> FloatArray:
    """Values relative to their range: 0 at the lowest, 1 at the highest; all 0.5 if they are equal."""
    values = np.log(values) if logarithmic else np.asarray(values, dtype=float)
    low, high = np.nanmin(values), np.nanmax(values)
    return np.full(values.shape, 0.5) if high <= low else np.asarray((values - low) / (high - low))


def path(points: FloatArray, *, closed: bool = False, **attributes: Any) -> Shape:
    """Line through points (n, 2)."""
    along = "L".join(f"{x:.2f},{y:.2f}" for x, y in points)
    return Shape("path", {"d": f"M{along}{'Z' if closed else ''}", **_named(attributes)})


def band(points: FloatArray, fraction: FloatArray, width: float) -> list[Shape]:
    """Coloured line through points (n, 2), with an outline that is seen on light and dark ground."""
    # Each piece reaches under the next one, so that no seam shows.
    middle = (fraction[1:] + fraction[:-1]) / 2
    pieces = [
        path(points[i : i + 3], stroke=colour, stroke_width=f"{width:g}", fill="none")
        for i, colour in enumerate(colours(middle))
    ]
    return [path(points, klass="edge", stroke_width=f"{width + 1.6:g}"), *pieces]


def element(x: float, y: float, size: float) -> Shape:
    """Triangle for one element."""
    corners = np.array([[x, y - size], [x - 0.87 * size, y + 0.5 * size], [x + 0.87 * size, y + 0.5 * size]])
    return path(corners, closed=True, klass="element")


def label(x: float, y: float, text: str, anchor: str = "middle") -> Shape:
    """Text at a point."""
    return Shape("text", {"x": f"{x:.2f}", "y": f"{y:.2f}", "text-anchor": anchor}, text)


def apart(labels: Sequence[Shape]) -> list[Shape]:
    """Labels in the same order, moved up until no two overlap, the lowest first."""
    done: dict[int, Shape] = {}
    for number in sorted(range(len(labels)), key=lambda i: -float(labels[i].attributes["y"])):
        each = labels[number]
        low, high = _span(each)
        y = float(each.attributes["y"])
        for other in done.values():
            left, right = _span(other)
            if low < right and left < high and y > float(other.attributes["y"]) - _LINE:
                y = float(other.attributes["y"]) - _LINE
        done[number] = Shape("text", {**each.attributes, "y": f"{y:.2f}"}, each.text)
    return [done[number] for number in range(len(labels))]


def top_of(labels: Sequence[Shape]) -> float:
    """Top of the labels, above which the drawing may end."""
    return min(float(each.attributes["y"]) for each in labels) - _LINE


def _span(label: Shape) -> tuple[float, float]:
    """Left and right end of a label, about."""
    width = _LETTER * len(label.text)
    left = (
        float(label.attributes["x"])
        - width * {"start": 0.0, "middle": 0.5, "end": 1.0}[label.attributes["text-anchor"]]
    )
    return left, left + width


def _named(attributes: dict[str, Any]) -> dict[str, str]:
    """Attributes of SVG from Python names: ``klass`` and underscores are replaced."""
    return {("class" if name == "klass" else name.replace("_", "-")): str(v) for name, v in attributes.items()}
