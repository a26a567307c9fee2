"""Common parts of the interactive figures: style, touches, and text under the pointer."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.output.pictures import BLUE, RED

_TOOLS = "pan,box_zoom,wheel_zoom,reset,save"
_HEIGHT = 380


def as_numbers(values: list[Any]) -> Any:
    """Values as an array, with NaN for None."""
    return np.array(values, dtype=float)


def new_figure(x: str, y: str, tips: list[tuple[str, str]], **options: Any) -> Any:
    """Empty plot with labels, as wide as the page; `tips` are shown for everything under the pointer."""
    from bokeh.models import HoverTool
    from bokeh.plotting import figure

    plot = figure(
        height=_HEIGHT, sizing_mode="stretch_width", tools=_TOOLS, toolbar_location="above", x_axis_label=x,
        y_axis_label=y, active_scroll=None, **options,
    )  # fmt: skip
    plot.toolbar.logo = None
    plot.axis.axis_label_text_font_style = "normal"
    plot.axis.axis_label_text_color = plot.axis.major_label_text_color = "#222222"
    if tips:
        plot.add_tools(HoverTool(tooltips=tips))
    return plot


def coloured(values: Any, low: float, high: float, logarithmic: bool = False) -> Any:
    """Colour scale of a column from `low` to `high`."""
    from bokeh.transform import linear_cmap, log_cmap

    return (log_cmap if logarithmic else linear_cmap)(values, "Cividis256", low, high)


def colour_bar(plot: Any, mapper: Any, title: str) -> None:
    """Add a colour bar on the right."""
    from bokeh.models import ColorBar

    plot.add_layout(ColorBar(color_mapper=mapper["transform"], title=title, width=12), "right")


def touch_dots(plot: Any, x: str, y: str, source: Any, colour: Any = BLUE) -> Any:
    """Dots, one for each touch; the selected one is highlighted."""
    return plot.scatter(
        x, y, source=source, size=7, fill_color=colour, line_color=None, fill_alpha=0.8, nonselection_fill_alpha=0.7,
        selection_fill_color=RED, selection_line_color="#000000", selection_fill_alpha=1.0,
    )  # fmt: skip


def touch_to_choose(plot: Any, dots: Any, tips: list[tuple[str, str]]) -> None:
    """Let a tap select a touch, and show `tips` for the touch under the pointer."""
    from bokeh.models import HoverTool, TapTool

    plot.add_tools(TapTool(renderers=[dots]), HoverTool(renderers=[dots], tooltips=tips))


def lowest(source: Any, name: str) -> float:
    """Smallest value of a column."""
    return float(np.nanmin(source.data[name]))


def highest(source: Any, name: str) -> float:
    """Largest value of a column."""
    return float(np.nanmax(source.data[name]))
