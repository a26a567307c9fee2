"""The sensor drawn, with the error to expect at every place in colour: its sweet spots."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from bayestouch.data.sensor import Finger
from bayestouch.output.pictures import BLUE, GREY, ORANGE, ORDERED, Picture, canvas, drawing, legend_below, rendered
from bayestouch.output.text import fixed, number
from bayestouch.reporting.evidence import Evidence

_READ = "Predicted from the calibration alone, before any touch is read: small values are sweet spots. "


def sensor_pictures(evidence: Evidence, numbers: dict[str, Any]) -> Iterator[Picture]:
    """One drawing of the finger or pad."""
    places = numbers["places"]
    if evidence.is_finger:
        yield _finger(evidence, places)
    else:
        yield _pad(places)


def _finger(evidence: Evidence, places: dict[str, Any]) -> Picture:
    body = evidence.sensor.body
    assert isinstance(body, Finger)
    columns = {name: np.array(values, dtype=float) for name, values in places["by_location"].items()}
    angle, error = columns["angle_deg"], columns["R_error_mm"]
    elements = np.asarray(evidence.calibration.mode["theta_s"])
    with drawing():
        figure, axes = canvas(4.6, 1, 2, width_ratios=[1, 1.35])
        left, right = axes[0]
        _cross_section(left, body, elements, angle, error, figure)
        right.plot(angle, error, color=BLUE, label="error of R")
        right.plot(angle, columns["R_noise_mm"], "--", color=ORANGE, label="part of noise")
        right.plot(angle, columns["R_shared_mm"], ":", lw=2, color=GREY, label="part shared by all touches there")
        right.plot(elements, np.zeros(len(elements)), "^", color=GREY, ms=5, clip_on=False, label="element")
        right.set(xlabel="location θ (degree)", ylabel="rms error to expect of R (mm)", ylim=(0, None))
        right.grid(axis="y")
        legend_below(right, 2)
        content = rendered(figure)
    best, worst = places["best"], places["worst"]
    return Picture(
        "sensor",
        "places",
        "Where the finger reads well",
        _READ + "Left: the finger in section, rubber on its core, with the error of R in colour around the surface and "
        f"the elements as triangles. Right: the same with its parts, for touches of {places['samples']} samples, rms "
        "over the tips.",
        "Section of the finger with the error to expect of R around its surface: from "
        f"{number(best['R_error_mm'], 2)} mm at {fixed(best['angle_deg'], 0)}° to "
        f"{number(worst['R_error_mm'], 2)} mm at {fixed(worst['angle_deg'], 0)}°.",
        content,
    )


def _cross_section(axes: Any, body: Finger, elements: Any, angle: Any, error: Any, figure: Any) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Wedge

    outer, core = body.outer_radius_mm, body.core_radius_mm
    axes.add_patch(Wedge((0, 0), outer, 0, 360, width=outer - core, facecolor="#e8e8e8", edgecolor=GREY, lw=0.8))
    axes.add_patch(Wedge((0, 0), core, 0, 360, facecolor="#c9ccd1", edgecolor=GREY, lw=0.8))
    axes.text(0, 0, "core", ha="center", va="center", fontsize=9)
    along = np.radians(angle)
    surface = 1.06 * outer * np.stack([np.sin(along), np.cos(along)], axis=1)
    segments = np.stack([surface[:-1], surface[1:]], axis=1)
    lines = LineCollection(list(segments), cmap=ORDERED, lw=7)
    lines.set_array((error[1:] + error[:-1]) / 2)
    axes.add_collection(lines)
    figure.colorbar(lines, ax=axes, label="rms error to expect of R (mm)", location="bottom", shrink=0.9)
    at = np.radians(elements)
    axes.plot(body.sensing_radius_mm * np.sin(at), body.sensing_radius_mm * np.cos(at), "^", color=BLUE, ms=4)
    for degrees in (-90, -45, 0, 45, 90):
        turn = np.radians(degrees)
        axes.text(
            1.24 * outer * np.sin(turn),
            1.24 * outer * np.cos(turn),
            f"{degrees}°",
            ha="center",
            va="center",
            fontsize=8,
        )
    axes.set(xlim=(-1.4 * outer, 1.4 * outer), ylim=(-1.15 * outer, 1.4 * outer), aspect="equal")
    axes.axis("off")


def _pad(places: dict[str, Any]) -> Picture:
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
                ("noise_mm", "--", "part of noise"),
                ("shared_mm", ":", "part shared by all touches there"),
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
        _READ
        + "Standard deviation of the location with noise and what the calibration leaves open; elements as triangles.",
        "The pad with the error of the location to expect: within the array from "
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
    # Beyond the array the error runs off by factors.
    mesh = ax.pcolormesh(x, y, error, cmap=ORDERED, norm=LogNorm(), rasterized=True)
    figure.colorbar(mesh, ax=ax, label="rms error to expect (mm)")
    ax.plot(*elements.T, "^", ms=8, mfc="none", mec="white", mew=1.6)
    ax.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
    return rendered(figure)
