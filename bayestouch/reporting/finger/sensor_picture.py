"""Figure of the finger with the expected error at every place in colour."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.data.sensor import Finger, finger_of
from bayestouch.output.pictures import BLUE, GREY, ORANGE, ORDERED, Picture, canvas, drawing, legend_below, rendered
from bayestouch.output.text import fixed, number
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.phrases import with_load
from bayestouch.reporting.places import PREDICTED


def sensor_picture(evidence: Evidence, numbers: dict[str, Any]) -> Picture:
    """Figure of the section of the finger with the expected error of R, and of the same error over location."""
    places = numbers["places"]
    columns = {name: np.array(values, dtype=float) for name, values in places["by_location"].items()}
    angle, error = columns["angle_deg"], columns["R_error_mm"]
    elements = np.asarray(evidence.calibration.mode["theta_s"])
    with drawing():
        figure, axes = canvas(4.6, 1, 2, width_ratios=[1, 1.35])
        left, right = axes[0]
        _cross_section(left, finger_of(evidence.sensor), elements, angle, error, figure)
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
        PREDICTED
        + "Left: the finger in section, rubber on its core, with the error of R in colour around the surface and "
        f"the elements as triangles. Right: the same with its parts, for touches of {places['samples']} samples "
        f"{with_load(places)}, rms over the tips.",
        "Section of the finger with the error to expect of R around its surface: from "
        f"{number(best['R_error_mm'], 2)} mm at {fixed(best['angle_deg'], 0)}° to "
        f"{number(worst['R_error_mm'], 2)} mm at {fixed(worst['angle_deg'], 0)}°.",
        content,
    )


def _cross_section(axes: Any, finger: Finger, elements: Any, angle: Any, error: Any, figure: Any) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Wedge

    outer, core = finger.outer_radius_mm, finger.core_radius_mm
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
    axes.plot(finger.sensing_radius_mm * np.sin(at), finger.sensing_radius_mm * np.cos(at), "^", color=BLUE, ms=4)
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
