"""Interactive figures of a finger: expected error at every place, and estimates of its touches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bayestouch.output.pictures import BLUE, GREY
from bayestouch.reporting.live_common import (
    as_numbers,
    colour_bar,
    coloured,
    highest,
    lowest,
    new_figure,
    touch_dots,
    touch_to_choose,
)

#: Text for the touch under the pointer.
TIPS = [
    ("touch", "@touch, @indenter"),
    ("location θ", "@theta_c_reference{0.0}°, read @theta_c_mean{0.00}° ± @theta_c_sd{0.00}"),
    ("R", "@R_reference{0.00} mm, read @R_mean{0.00} ± @R_sd{0.00} mm"),
]


def sensor_figure(numbers: Mapping[str, Any], source: Any) -> Any:
    """Interactive figure of the finger with the expected error of R at every place and the touches."""
    from bokeh.models import ColumnDataSource, HoverTool

    places = numbers["places"]
    columns = {name: as_numbers(values) for name, values in places["by_location"].items()}
    radii = {row["quantity"]: row["value"] for row in numbers["data"]["sensor"]}
    core, outer = radii["core radius r_a"], radii["outer radius r_b"]
    angle = np.radians(columns["angle_deg"])
    half = float(np.median(np.diff(angle))) / 2
    plot = new_figure("mm", "mm", [], match_aspect=True)
    plot.xgrid.visible = plot.ygrid.visible = False
    # Show only the part of the finger that has elements, and a little more.
    reach = min(max(float(np.abs(angle).max()) + 0.4, np.pi / 2), np.pi)
    for inner, radius, colour in ((core, outer, "#e8e8e8"), (0.0, core, "#c9ccd1")):
        plot.patch(*_sector(inner, radius, -reach, reach), fill_color=colour, line_color=GREY)
    shapes = [_sector(1.02 * outer, 1.14 * outer, a - half, a + half, 4) for a in angle]
    ring = ColumnDataSource({name: values.tolist() for name, values in columns.items()})
    ring.data["xs"], ring.data["ys"] = [x for x, _ in shapes], [y for _, y in shapes]
    error = columns["R_error_mm"]
    # from the best place to the worst, as in the drawing of the first screen
    mapper = coloured("R_error_mm", float(np.nanmin(error)), float(np.nanmax(error)))
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
                ("distinguished from an edge", "r_c ≥ @told_from_edge_r_c_mm{0.00} mm"),
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
        touch_to_choose(plot, dots, TIPS)
    return plot


def _sector(inner: float, outer: float, start: float, end: float, steps: int = 90) -> tuple[list[float], list[float]]:
    """Outline (mm) of a ring segment between two angles (rad); angles are measured from y towards x."""
    turn = np.linspace(start, end, steps)
    x = np.concatenate([outer * np.sin(turn), inner * np.sin(turn[::-1])])
    y = np.concatenate([outer * np.cos(turn), inner * np.cos(turn[::-1])])
    return x.round(4).tolist(), y.round(4).tolist()


def estimate_figure(numbers: Mapping[str, Any], source: Any) -> Any:
    """Interactive figure of R of every touch over its location; None if no touch has a reference of both."""
    from bokeh.palettes import Cividis256
    from bokeh.transform import factor_cmap

    touches = numbers["touches"]
    if not np.isfinite(np.add(source.data["theta_c_reference"], source.data["R_reference"])).any():
        return None
    plot = new_figure("reference location θ (degree)", "posterior mean of R (mm)", [])
    radius = dict(zip(touches["indenter"], touches["parameters"]["R"]["reference"], strict=True))
    tips = sorted((tip for tip in radius if radius[tip] is not None), key=lambda tip: radius[tip])
    palette = [Cividis256[int(step)] for step in np.linspace(0, 215, len(tips))]
    x = "theta_c_reference"
    dots = touch_dots(plot, x, "R_mean", source, factor_cmap("indenter", palette, tips, nan_color=GREY))
    for reference in sorted({value for value in touches["parameters"]["R"]["reference"] if value is not None}):
        plot.line([lowest(source, x), highest(source, x)], [reference] * 2, line_dash="dotted", color=GREY)
    touch_to_choose(plot, dots, TIPS)
    return plot
