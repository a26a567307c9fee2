"""Plots of a data set for the check."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.checking.tables import indenter_name, known_indenters
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.output.pictures import PALETTE, ordered_colours
from bayestouch.results.plots import LOCATION_LABELS, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_touches(dataset: DataSet, axes: Axes | None = None) -> Axes:
    """Plot load over location, or the locations on a plane pad: calibration hollow, touches to be read filled."""
    axes = new_axes(axes)
    tables = [(dataset.touches, True), (dataset.calibration, False)]
    means = [(table.averaged(), filled) for table, filled in tables if table is not None]
    # Both tables are drawn over the same quantities. A table without locations is left out beside one with them; but
    # every touch has a largest reading, which is drawn if one of the tables has no load.
    means = [each for each in means if _has_location(each[0])] or means
    plane = means[0][0].y_mm is not None
    loaded = all(np.isfinite(table.load).any() for table, _ in means)
    tips = known_indenters(np.concatenate([m.indenter_radius_mm for m, _ in means]))
    colours = dict(zip(tips, ordered_colours(len(tips)), strict=False))
    for table, filled in means:
        x, y = _places(table, loaded)
        for tip in (*tips, np.nan):
            these = np.isnan(table.indenter_radius_mm) if np.isnan(tip) else table.indenter_radius_mm == tip
            if not these.any():
                continue
            colour = colours.get(tip, "#666666")
            face = colour if filled else "none"
            use = "to be read" if filled else "to calibrate with"
            axes.scatter(
                x[these], y[these], s=14, facecolors=face, edgecolors=colour, label=f"{indenter_name(tip)}, {use}"
            )
    load = f"load ({dataset.sensor.body.load_unit})" if loaded else "largest reading"
    axes.set(xlabel=_location_label(means[0][0]), ylabel=LOCATION_LABELS["y"] if plane else load, title="touches")
    if axes.collections:  # none without any touch in contact
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize="x-small", frameon=False)
    return axes


def plot_readings(dataset: DataSet, axes: Axes | None = None) -> Axes:
    """Plot the mean readings of every element over location."""
    axes = new_axes(axes)
    table = (dataset.calibration or dataset.touches).baseline_corrected().averaged()
    x, _ = _places(table, loaded=False)
    order = np.argsort(x)
    for e in range(table.n_elements):
        colour, marker = PALETTE[e % len(PALETTE)], "os^v"[e // len(PALETTE) % 4]
        axes.plot(x[order], table.readings[order, e], marker, ms=2, color=colour, label=f"e{e + 1:02d}")
    unit = dataset.sensor.reading_unit
    axes.set(xlabel=_location_label(table), ylabel=f"mean reading{f' ({unit})' if unit else ''}")
    which = "to be read" if dataset.calibration is None else "to calibrate with"
    axes.set_title(f"readings of touches {which}, by element")
    axes.legend(
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
        fontsize="x-small",
        frameon=False,
        ncols=1 + table.n_elements // 16,
    )
    return axes


def _has_location(table: TouchMeans) -> bool:
    return table.angle_deg is not None or table.x_mm is not None


def _places(table: TouchMeans, loaded: bool) -> tuple[FloatArray, FloatArray]:
    """Plot coordinates of the touches: location and load (or largest reading), or x and y."""
    first = table.angle_deg if table.angle_deg is not None else table.x_mm
    x = np.arange(table.n_touches, dtype=float) if first is None else first
    if table.y_mm is not None:
        return x, table.y_mm
    # fmax, unlike nanmax, gives no warning for a touch without readings
    return x, table.load if loaded else np.fmax.reduce(np.abs(table.readings), axis=1)


def _location_label(table: TouchMeans) -> str:
    if table.angle_deg is not None:
        return LOCATION_LABELS["theta_c"]
    return "touch, in order" if table.x_mm is None else LOCATION_LABELS["x"]
