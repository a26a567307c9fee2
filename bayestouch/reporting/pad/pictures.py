"""Figures of a report on a pad: location errors over the pad."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.output.pictures import (
    BLUE,
    ORDERED,
    RED,
    Picture,
    canvas,
    drawing,
    legend_below,
    mark_elements,
    rendered,
)
from bayestouch.output.text import number
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.pad.locations import (
    axes_of,
    element_places,
    inside_array,
    location_errors,
    reference_locations,
    several_modes,
)

# With more arrows than this, they cover each other.
_ARROWS = 450


def estimate_pictures(evidence: Evidence, numbers: dict[str, Any]) -> Iterator[Picture]:
    """Figure of the location errors; none if the touches have no reference values."""
    error = location_errors(evidence)
    if not np.isfinite(error).all(axis=1).any():
        return
    yield _line(evidence, error[:, 0]) if error.shape[1] == 1 else _plane(evidence, error)


def example_touches(evidence: Evidence) -> dict[str, int]:
    """Numbers of a touch with median uncertainty inside the array, and of the most uncertain touch."""
    posteriors = evidence.posteriors
    spread = np.sqrt(sum(posteriors.sd(axis) ** 2 for axis in axes_of(posteriors)))
    inside = inside_array(evidence)
    inside = inside if inside.any() else np.ones(len(spread), dtype=bool)
    typical = np.where(inside, np.abs(spread - np.median(spread[inside])), np.inf).argmin()
    return {"typical": int(typical), "hardest": int(spread.argmax())}


def _line(evidence: Evidence, error: FloatArray) -> Picture:
    posteriors = evidence.posteriors
    x = reference_locations(evidence)[:, 0]
    order = np.argsort(x)
    order = order[np.isfinite(error[order])]
    x, error = x[order], error[order]
    low, high = posteriors.interval("x")
    middle = posteriors.mean("x")[order]
    # With two modes, the mean can be outside the central interval.
    below, above = np.maximum(middle - low[order], 0), np.maximum(high[order] - middle, 0)
    with drawing():
        figure, axes = canvas(4.2)
        ax = axes[0, 0]
        ax.axhline(0, color=RED, ls=":", lw=1.8, label="no error")
        ax.errorbar(
            x,
            error,
            [below, above],
            fmt="o",
            ms=3.5,
            elinewidth=0.8,
            color=BLUE,
            label="posterior mean and 90 % interval",
        )
        ax.set(xlabel="reference location x (mm)", ylabel="estimate − reference (mm)")
        ax.grid(axis="y")
        margin = 0.04 * max(float(np.ptp(x)), 1e-9)
        ax.set_xlim(x.min() - margin, x.max() + margin)
        mark_elements(ax, element_places(evidence)[:, 0], *ax.get_xlim())
        legend_below(ax, 3)
        content = rendered(figure)
    return Picture(
        "location_bias",
        "estimates",
        "Error of the location along the pad",
        "The form of the paper's Figure 12, for location: an error that neighbouring touches share is bias. Triangles "
        "mark elements.",
        f"Error of the location against the reference along x: rms {number(float(np.sqrt(np.mean(error**2))), 2)} mm, "
        f"largest {number(float(np.abs(error).max()), 2)} mm.",
        content,
    )


def _plane(evidence: Evidence, error: FloatArray) -> Picture:
    """Figure with arrows from reference to estimate, and with the size of the error in colour."""
    from bayestouch.reporting.differences import error_summary

    reference, places = reference_locations(evidence), element_places(evidence)
    known = np.isfinite(error).all(axis=1)
    reference, error = reference[known], error[known]
    size = np.sqrt((error**2).sum(axis=1))
    inside, several = inside_array(evidence)[known], several_modes(evidence.posteriors)[known]
    step = max(1, -(-len(size) // _ARROWS))
    span = np.ptp(np.vstack([reference, places]), axis=0)
    with drawing():
        width = 7.5 / 2
        figure, axes = canvas(float(np.clip(width * span[1] / span[0], 2.6, 8.0)) + 0.9, 1, 2, sharex=True, sharey=True)
        left, right = axes[0]
        top = float(np.quantile(size, 0.98))
        dots = left.scatter(
            *reference.T, c=size, s=_dot(len(size)), cmap=ORDERED, vmin=0, vmax=top, marker="s", rasterized=True
        )
        left.set_title("size of the error")
        figure.colorbar(dots, ax=left, label="error (mm)", extend="max", location="bottom", shrink=0.9)
        right.quiver(
            *reference[::step].T, *error[::step].T, angles="xy", scale_units="xy", scale=1, width=0.004, color=BLUE
        )
        right.scatter(
            *reference[several].T,
            s=9,
            facecolors="none",
            edgecolors=RED,
            linewidths=0.7,
            label="posterior with several modes",
        )
        right.set_title("from reference to estimate")
        for ax, edge in ((left, "white"), (right, "black")):
            ax.plot(*places.T, "^", ms=7, mfc="none", mec=edge, mew=1.4, label="element")
            ax.set_aspect("equal")
            ax.set_xlabel("x (mm)")
        left.set_ylabel("y (mm)")
        right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=1)
        content = rendered(figure, tight=True)
    summary = error_summary(size[inside] if inside.any() else size)
    return Picture(
        "location_bias",
        "estimates",
        "Error of the location over the pad",
        "Each touch at its reference: left the distance of the estimate (posterior mean), right an arrow to it, to "
        "scale"
        + (f", one touch in {step}" if step > 1 else "")
        + ". Arrows that point the same way side by side are bias; single long ones are touches read at another place "
        "where the readings are nearly the same.",
        f"Map of the location error over the pad; inside the array the median is {number(summary['median_abs'], 2)} mm "
        f"and the rms {number(summary['rms'], 2)} mm; {int(several.sum())} of {len(several)} posteriors "
        "have several modes.",
        content,
    )


def _dot(n: int) -> float:
    """Area of a marker for which n of them fill the panel without overlap."""
    return float(np.clip(30_000 / max(n, 1), 4, 60))
