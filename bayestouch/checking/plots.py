"""Plots of a data set for the check."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

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
    tips = known_indenters(np.concatenate([m.indenter_radius_mm for m, _ in means]))
    colours = dict(zip(tips, ordered_colours(len(tips)), strict=False))
    for table, filled in means:
        x, y = _places(table)
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
    plane = means[0][0].y_mm is not None
    load = f"load ({dataset.sensor.body.load_unit})" if np.isfinite(means[0][0].load).any() else "largest reading"
    axes.set(xlabel=_location_label(means[0][0]), ylabel=LOCATION_LABELS["y"] if plane else load, title="touches")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize="x-small", frameon=False)
    return axes


def plot_readings(dataset: DataSet, axes: Axes | None = None) -> Axes:
    """Plot the mean readings of every element over location."""
    axes = new_axes(axes)
    table = (dataset.calibration or dataset.touches).baseline_corrected().averaged()
    x, _ = _places(table)
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


def _places(table: TouchMeans) -> tuple[np.ndarray, np.ndarray]:
    """Plot coordinates of the touches: location and load, or x and y."""
    first = table.angle_deg if table.angle_deg is not None else table.x_mm
    x = np.arange(table.n_touches, dtype=float) if first is None else first
    if table.y_mm is not None:
        return x, table.y_mm
    return x, table.load if np.isfinite(table.load).any() else np.nanmax(np.abs(table.readings), axis=1)


def _location_label(table: TouchMeans) -> str:
    if table.angle_deg is not None:
        return LOCATION_LABELS["theta_c"]
    return "touch, in order" if table.x_mm is None else LOCATION_LABELS["x"]
