"""Interactive figures of a pad: expected error at every place, and estimates of its touches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bayestouch.output.pictures import BLUE, GREY, ORANGE
from bayestouch.reporting.live_common import as_numbers, colour_bar, coloured, new_figure, touch_dots, touch_to_choose

#: Text for the touch under the pointer.
TIPS_LINE = [("touch", "@touch"), ("x", "@x_reference{0.00} mm, read @x_mean{0.00} ± @x_sd{0.00} mm")]
TIPS_PLANE = [
    *TIPS_LINE,
    ("y", "@y_reference{0.00} mm, read @y_mean{0.00} ± @y_sd{0.00} mm"),
    ("error", "@error{0.00} mm"),
]


def sensor_figure(numbers: Mapping[str, Any], source: Any) -> Any:
    """Interactive figure of the expected location error: over a plane with the touches, or along a line."""
    places = numbers["places"]
    return _plane(places, source) if "y_mm" in places["by_location"] else _line(places)


def _plane(places: Mapping[str, Any], source: Any) -> Any:
    from bokeh.models import HoverTool

    columns = {name: as_numbers(values) for name, values in places["by_location"].items()}
    x, y = np.unique(columns["x_mm"]), np.unique(columns["y_mm"])
    plot = new_figure("x (mm)", "y (mm)", [], match_aspect=True, max_width=560)
    colour = coloured("error_mm", float(columns["error_mm"].min()), float(columns["error_mm"].max()), logarithmic=True)
    cells = plot.rect(
        "x_mm", "y_mm", float(np.diff(x).min()) * 1.02, float(np.diff(y).min()) * 1.02, fill_color=colour,
        line_color=None, source={name: values.tolist() for name, values in columns.items()},
    )  # fmt: skip
    plot.add_tools(
        HoverTool(
            renderers=[cells],
            tooltips=[("place", "@x_mm{0.0}, @y_mm{0.0} mm"), ("error to expect", "@error_mm{0.000} mm"),
                      ("part that averaging lowers", "@noise_mm{0.000} mm"),
                      ("part that stays", "@shared_mm{0.000} mm")],
        )
    )  # fmt: skip
    colour_bar(plot, colour, "rms error (mm)")
    elements = np.array(places["elements_mm"], dtype=float)
    plot.scatter(
        elements[:, 0], elements[:, 1], marker="triangle", size=12, fill_color=None, line_color="#ffffff", line_width=2
    )
    dots = touch_dots(plot, "x_reference", "y_reference", source, "#ffffff")
    touch_to_choose(plot, dots, TIPS_PLANE)
    return plot


def _line(places: Mapping[str, Any]) -> Any:
    columns = {name: values for name, values in places["by_location"].items()}
    plot = new_figure(
        "location x (mm)", "rms error to expect (mm)", [("x", "@x_mm{0.0} mm"), ("error", "@error_mm{0.000} mm")]
    )
    for name, colour, dash, label in (
        ("error_mm", BLUE, "solid", "error"), ("noise_mm", ORANGE, "dashed", "part that averaging lowers"),
        ("shared_mm", GREY, "dotted", "part that stays"),
    ):  # fmt: skip
        plot.line("x_mm", name, source=columns, color=colour, line_dash=dash, line_width=2, legend_label=label)
    plot.legend.orientation = "horizontal"
    plot.add_layout(plot.legend[0], "above")  # inside, it would hide the errors near an end of the pad
    return plot


def estimate_figure(numbers: Mapping[str, Any], source: Any) -> Any:
    """Interactive figure of the error of every touch over the plane, or of estimated over reference location.

    None if no touch has a reference location.
    """
    if "y" in numbers["touches"]["parameters"]:
        errors = [value for value in source.data["error"] if np.isfinite(value)]
        if not errors:
            return None
        plot = new_figure("x (mm)", "y (mm)", [], match_aspect=True, max_width=560)
        colour = coloured("error", 0.0, float(np.quantile(errors, 0.98)))
        dots = touch_dots(plot, "x_reference", "y_reference", source, colour)
        colour_bar(plot, colour, "error of the touch (mm)")
        touch_to_choose(plot, dots, TIPS_PLANE)
        return plot
    if not np.isfinite(source.data["x_reference"]).any():
        return None
    plot = new_figure("reference location x (mm)", "location x, as read (mm)", [])
    dots = touch_dots(plot, "x_reference", "x_mean", source)
    touch_to_choose(plot, dots, TIPS_LINE)
    return plot
