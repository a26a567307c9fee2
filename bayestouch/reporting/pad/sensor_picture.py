"""Figure of the pad with the expected error at every place in colour."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.output.pictures import GREY, ORDERED, Picture, canvas, drawing, legend_below, rendered
from bayestouch.output.text import fixed, number
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.phrases import with_load
from bayestouch.reporting.places import PREDICTED


def sensor_picture(evidence: Evidence, numbers: dict[str, Any]) -> Picture:
    """Figure of the expected location error along a line, or over a plane."""
    places = numbers["places"]
    columns = {name: np.array(values, dtype=float) for name, values in places["by_location"].items()}
    elements = np.asarray(places["elements_mm"], dtype=float)
    best, worst = places["best"], places["worst"]
    with drawing():
        if "y_mm" in columns:
            content = _plane(columns, elements)
        else:
            figure, axes = canvas(3.8)
            ax = axes[0, 0]
            for name, style, label in (
                ("error_mm", "-", "error"),
                ("noise_mm", "--", "part that averaging lowers"),
                ("shared_mm", ":", "part that stays"),
            ):
                ax.plot(columns["x_mm"], columns[name], style, label=label)
            ax.plot(elements[:, 0], np.zeros(len(elements)), "^", color=GREY, ms=6, clip_on=False, label="element")
            ax.set(xlabel="location x (mm)", ylabel="rms error to expect (mm)", ylim=(0, None))
            legend_below(ax, 4)
            content = rendered(figure)
    return Picture(
        "sensor",
        "places",
        "Where the pad reads well",
        PREDICTED
        + "Standard deviation of the location with noise, model error and what the calibration leaves open, for "
        f"touches {with_load(places)}; elements as triangles.",
        f"The pad with the error of the location to expect: within {places['within']} from "
        f"{number(best['error_mm'], 2)} mm at x = {fixed(best['x_mm'], 1)} mm to "
        f"{number(worst['error_mm'], 2)} mm at x = {fixed(worst['x_mm'], 1)} mm.",
        content,
    )


def _plane(columns: dict[str, Any], elements: Any) -> bytes:
    from matplotlib.colors import LogNorm

    x, y = np.unique(columns["x_mm"]), np.unique(columns["y_mm"])
    error = columns["error_mm"].reshape(len(x), len(y)).T
    figure, axes = canvas(float(np.clip(4.6 * np.ptp(y) / np.ptp(x), 3.0, 6.5)) + 0.6)
    ax = axes[0, 0]
    # Outside the array the error increases by orders of magnitude.
    mesh = ax.pcolormesh(x, y, error, cmap=ORDERED, norm=LogNorm(), rasterized=True)
    figure.colorbar(mesh, ax=ax, label="rms error to expect (mm)")
    ax.plot(*elements.T, "^", ms=8, mfc="none", mec="white", mew=1.6)
    ax.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
    return rendered(figure)
