"""The sensor to point into: the error to expect at every place, and the touches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bayestouch.output.pictures import BLUE, GREY, ORANGE
from bayestouch.reporting.live_common import as_numbers, colour_bar, coloured, new_figure, touch_dots, touch_hover


def sensor_figure(numbers: Mapping[str, Any], source: Any) -> Any:
    """The sensor with the error to expect at every place, and the touches on it."""
    places = numbers["places"]
    if places["body"] == "finger":
        return _finger(numbers, source)
    return _plane(places, source) if "y_mm" in places["by_location"] else _line(places, source)


def _finger(numbers: Mapping[str, Any], source: Any) -> Any:
    from bokeh.models import ColumnDataSource, HoverTool, TapTool

    places = numbers["places"]
    columns = {name: as_numbers(values) for name, values in places["by_location"].items()}
    radii = {row["quantity"]: row["value"] for row in numbers["data"]["sensor"]}
    core, outer = radii["core radius r_a"], radii["outer radius r_b"]
    angle = np.radians(columns["angle_deg"])
    half = float(np.median(np.diff(angle))) / 2
    plot = new_figure("mm", "mm", [], match_aspect=True)
    plot.xgrid.visible = plot.ygrid.visible = False
    # Of the finger as much as elements reach around, and a little more.
    reach = min(max(float(np.abs(angle).max()) + 0.4, np.pi / 2), np.pi)
    for inner, radius, colour in ((core, outer, "#e8e8e8"), (0.0, core, "#c9ccd1")):
        plot.patch(*_sector(inner, radius, -reach, reach), fill_color=colour, line_color=GREY)
    shapes = [_sector(1.02 * outer, 1.14 * outer, a - half, a + half, 4) for a in angle]
    ring = ColumnDataSource({name: values.tolist() for name, values in columns.items()})
    ring.data["xs"], ring.data["ys"] = [x for x, _ in shapes], [y for _, y in shapes]
    mapper = coloured("R_error_mm", float(np.nanmax(columns["R_error_mm"])))
    wedges = plot.patches("xs", "ys", fill_color=mapper, line_color=None, source=ring)
    plot.add_tools(
        HoverTool(
            renderers=[wedges],
            tooltips=[
                ("location θ", "@angle_deg{0.0}°"),
                ("error of R to expect", "@R_error_mm{0.000} mm"),
                ("part of noise", "@R_noise_mm{0.000} mm"),
                ("part shared there", "@R_shared_mm{0.000} mm"),
                ("error of θ_c", "@theta_c_error_deg{0.000}°"),
                ("told from an edge", "r_c ≥ @told_from_edge_r_c_mm{0.00} mm"),
            ],
        )
    )
    colour_bar(plot, mapper, "rms error of R (mm)")
    turned = np.radians(as_numbers(places["elements_deg"]))
    sensing = radii["sensing radius r_s, design"]
    plot.scatter(sensing * np.sin(turned), sensing * np.cos(turned), marker="triangle", size=8, color=BLUE)
    at = np.radians(as_numbers(numbers["touches"]["parameters"]["theta_c"]["reference"]))
    if np.isfinite(at).any():
        source.data["drawn_x"], source.data["drawn_y"] = (
            (1.22 * outer * np.sin(at)).tolist(),
            (1.22 * outer * np.cos(at)).tolist(),
        )
        dots = touch_dots(plot, "drawn_x", "drawn_y", source)
        plot.add_tools(TapTool(renderers=[dots]), touch_hover(dots, "finger"))
    return plot


def _sector(inner: float, outer: float, start: float, end: float, steps: int = 90) -> tuple[list[float], list[float]]:
    """Outline (mm) of a piece of a ring, from one angle (rad) to another; angles turn from y towards x."""
    turn = np.linspace(start, end, steps)
    x = np.concatenate([outer * np.sin(turn), inner * np.sin(turn[::-1])])
    y = np.concatenate([outer * np.cos(turn), inner * np.cos(turn[::-1])])
    return x.round(4).tolist(), y.round(4).tolist()


def _plane(places: Mapping[str, Any], source: Any) -> Any:
    from bokeh.models import HoverTool, TapTool

    columns = {name: as_numbers(values) for name, values in places["by_location"].items()}
    x, y = np.unique(columns["x_mm"]), np.unique(columns["y_mm"])
    plot = new_figure("x (mm)", "y (mm)", [], match_aspect=True, max_width=560)
    colour = coloured("error_mm", float(columns["error_mm"].max()), float(columns["error_mm"].min()))
    cells = plot.rect(
        "x_mm", "y_mm", float(np.diff(x).min()) * 1.02, float(np.diff(y).min()) * 1.02, fill_color=colour,
        line_color=None, source={name: values.tolist() for name, values in columns.items()},
    )  # fmt: skip
    plot.add_tools(
        HoverTool(
            renderers=[cells],
            tooltips=[("place", "@x_mm{0.0}, @y_mm{0.0} mm"), ("error to expect", "@error_mm{0.000} mm"),
                      ("part of noise", "@noise_mm{0.000} mm"), ("part shared there", "@shared_mm{0.000} mm")],
        )
    )  # fmt: skip
    colour_bar(plot, colour, "rms error (mm)")
    elements = np.array(places["elements_mm"], dtype=float)
    plot.scatter(
        elements[:, 0], elements[:, 1], marker="triangle", size=12, fill_color=None, line_color="#ffffff", line_width=2
    )
    dots = touch_dots(plot, "x_reference", "y_reference", source, "#ffffff")
    plot.add_tools(TapTool(renderers=[dots]), touch_hover(dots, "plane"))
    return plot


def _line(places: Mapping[str, Any], source: Any) -> Any:
    columns = {name: values for name, values in places["by_location"].items()}
    plot = new_figure(
        "location x (mm)", "rms error to expect (mm)", [("x", "@x_mm{0.0} mm"), ("error", "@error_mm{0.000} mm")]
    )
    for name, colour, dash, label in (
        ("error_mm", BLUE, "solid", "error"), ("noise_mm", ORANGE, "dashed", "part of noise"),
        ("shared_mm", GREY, "dotted", "part shared there"),
    ):  # fmt: skip
        plot.line("x_mm", name, source=columns, color=colour, line_dash=dash, line_width=2, legend_label=label)
    return plot
