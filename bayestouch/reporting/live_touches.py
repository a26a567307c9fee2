"""Interactive figures of touches: estimates, draws, residuals. They share one table, and so the selected touch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bayestouch.output.pictures import BLUE, RED
from bayestouch.reporting.live_common import as_numbers, new_figure


def touch_source(touches: Mapping[str, Any]) -> Any:
    """Data source with one row a touch: reference, estimate and error."""
    from bokeh.models import ColumnDataSource

    parameters = touches["parameters"]
    data: dict[str, Any] = {"touch": touches["touch"], "indenter": touches["indenter"]}
    for name, values in parameters.items():
        data |= {f"{name}_{key}": as_numbers(values[key]) for key in ("reference", "mean", "sd", "low", "high")}
    data["place"] = np.arange(len(touches["touch"]), dtype=float)
    if "y" in parameters:
        data["error"] = np.hypot(*(data[f"{a}_mean"] - data[f"{a}_reference"] for a in ("x", "y")))
    return ColumnDataSource({key: list(map(_plain, value)) for key, value in data.items()}, name="touches")


def _plain(value: Any) -> Any:
    if isinstance(value, str | int):
        return value
    return float(value) if np.isfinite(value) else float("nan")


def posterior_figure(touches: Mapping[str, Any]) -> Any:
    """Interactive figure of the draws of the selected touch, initially the first; `live.js` updates it."""
    from bokeh.models import ColumnDataSource

    labels = {name: f"{each['symbol']} ({each['unit']})" for name, each in touches["parameters"].items()}
    first, second = touches["shown"]
    plot = new_figure(labels[first], labels[second], [("draw", "$x{0.000}, $y{0.000}")])
    draws = ColumnDataSource({"x": touches["draws"][first][0], "y": touches["draws"][second][0]}, name="draws")
    plot.scatter("x", "y", source=draws, size=5, color=BLUE, alpha=0.5, legend_label="draws of the posterior")
    reference = ColumnDataSource({"x": [], "y": []}, name="reference")
    plot.scatter("x", "y", source=reference, marker="x", size=14, line_width=3, color=RED, legend_label="reference")
    plot.legend.location = "top_left"
    plot.legend.background_fill_alpha = 0.7
    return plot


def residual_figure(touches: Mapping[str, Any]) -> Any:
    """Interactive figure of the residuals of the selected touch by element."""
    from bokeh.models import ColumnDataSource, Span

    values = [0.0 if value is None else value for value in touches["residuals"][0]]
    elements = [f"e{e + 1:02d}" for e in range(len(values))]
    plot = new_figure("element", "residual / its sd", [("@element", "@z{0.00} sd")], x_range=elements)
    plot.vbar(
        "element",
        top="z",
        width=0.7,
        color=BLUE,
        source=ColumnDataSource({"element": elements, "z": values}, name="residuals"),
    )
    for level in (-2, 2):
        plot.add_layout(Span(location=level, dimension="width", line_color=RED, line_dash="dotted", line_width=2))
    plot.xaxis.major_label_orientation = 0.9
    return plot
