"""Drawing of a pad with the expected error of the location: a line of elements, or a plane."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.output.pictures import ORDERED
from bayestouch.output.text import fixed, number
from bayestouch.reporting.sketch import Shape, Sketch, apart, band, element, fractions, label, top_of

# Longest side of the map in the drawing, and the free space around it.
_LONGEST, _MARGIN = 300.0, 18.0


def sketch(numbers: Mapping[str, Any]) -> Sketch:
    """Pad from above, or in section if its elements are in line, from the numbers of a report."""
    places = numbers["places"]
    columns = {name: np.array(values, dtype=float) for name, values in places["by_location"].items()}
    elements = np.asarray(places["elements_mm"], dtype=float)
    best, worst = places["best"], places["worst"]
    x, error = columns["x_mm"], columns["error_mm"]
    plane = "y_mm" in columns
    sides = [float(places["size_mm"][axis]) for axis in "xy"[: 1 + plane]]
    scale = _LONGEST / max(sides)
    width, height = scale * sides[0], scale * sides[1] if plane else 26.0
    top = float(columns["y_mm"].max()) if plane else 0.0

    def at(place: Mapping[str, float]) -> tuple[float, float]:
        return scale * (place["x_mm"] - float(x.min())), scale * (top - place["y_mm"]) if plane else -6.0

    drawn = np.array([at(dict(zip(("x_mm", "y_mm"), each, strict=False))) for each in elements])
    # Elements may be outside the places that were touched: a channel has them at its ends.
    left, right = min(0.0, drawn[:, 0].min() - 6.0), max(width, drawn[:, 0].max() + 6.0)
    if plane:
        shapes = [_map(columns, width, height)]
        shapes += [element(each[0], each[1], 5.0) for each in drawn]
    else:
        line = np.stack([scale * (x - x.min()), np.full(len(x), 4.0)], axis=1)
        rubber = {"x": f"{left:.2f}", "width": f"{right - left:.2f}", "height": f"{height:.2f}", "class": "rubber"}
        shapes = [Shape("rect", rubber), *band(line, fractions(error, logarithmic=True), 8.0)]
        shapes += [element(each[0], 18.0, 4.0) for each in drawn]
    labels = []
    for name, place in (("best", best), ("worst", worst)):
        across, down = at(place)
        if plane:
            shapes.append(Shape("circle", {"cx": f"{across:.2f}", "cy": f"{down:.2f}", "r": "7", "class": "mark"}))
        labels.append(label(across, down - 9.0 if plane else down, name))
    labels = apart(labels)
    up, bottom = (drawn[:, 1].min() - 6.0, drawn[:, 1].max() + 6.0) if plane else (0.0, height)
    top_margin = max(_MARGIN - min(0.0, up), -top_of(labels))
    bottom = max(height, bottom) + _MARGIN
    ends = number(float(error.min()), 2), number(float(error.max()), 2)
    return Sketch(
        f"{left - _MARGIN:g} {-top_margin:g} {right - left + 2 * _MARGIN:.2f} {bottom + top_margin:.2f}",
        [*shapes, *labels],
        f"{ends[0]} mm",
        f"{ends[1]} mm",
        f"Error of the location to expect at each place (rms, logarithmic colours), over "
        f"{' × '.join(number(side, 3) for side in sides)} mm; best and worst are within {places['within']}",
        f"The pad with the expected error of the location in colour: within {places['within']} best "
        f"{number(best['error_mm'], 2)} mm at x = {fixed(best['x_mm'], 1)} mm, worst {number(worst['error_mm'], 2)} mm "
        f"at x = {fixed(worst['x_mm'], 1)} mm.",
    )


def _map(columns: Mapping[str, FloatArray], width: float, height: float) -> Shape:
    """Error over the plane as a small picture, one dot a place; its first row is the largest y."""
    from matplotlib.image import imsave

    x, y = np.unique(columns["x_mm"]), np.unique(columns["y_mm"])
    picture = fractions(columns["error_mm"], logarithmic=True).reshape(len(x), len(y)).T[::-1]
    buffer = io.BytesIO()
    imsave(buffer, picture, cmap=ORDERED, vmin=0.0, vmax=1.0, metadata={"Software": ""})
    content = base64.b64encode(buffer.getvalue()).decode("ascii")
    size = {"width": f"{width:.2f}", "height": f"{height:.2f}", "preserveAspectRatio": "none"}
    return Shape("image", {"href": f"data:image/png;base64,{content}", **size})
