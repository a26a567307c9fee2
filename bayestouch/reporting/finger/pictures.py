"""Figures of a report on a finger: estimates against location and radius."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.checking.tables import indenter_name, known_indenters
from bayestouch.contact import CONTACT_MODELS, indenter_radius
from bayestouch.data.arrays import nearest_turn
from bayestouch.data.grouping import index_among
from bayestouch.data.sensor import finger_of
from bayestouch.output.pictures import (
    BLUE,
    GREY,
    PALETTE,
    RED,
    Picture,
    canvas,
    drawing,
    legend_below,
    mark_elements,
    ordered_colours,
    rendered,
)
from bayestouch.output.text import number
from bayestouch.reporting.differences import reference_composite_radius
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.finger.point_fits import fit_points, model_finger

if TYPE_CHECKING:
    from matplotlib.axes import Axes


#: Radius of the tip in the paper's Figure 12, mm.
FIGURE_12_TIP = 12.3


def estimate_pictures(evidence: Evidence, numbers: dict[str, Any]) -> Iterator[Picture]:
    """Figures of the estimates; none if the touches have no reference values."""
    rows = evidence.posteriors.rows
    if np.isfinite(rows.location["theta_c"]).any():
        located = rows.radius_mm[np.isfinite(rows.location["theta_c"])]
        round_tips = [r for r in known_indenters(located) if 0 < r < np.inf]
        if round_tips:
            yield _by_location(evidence, min(round_tips, key=lambda r: abs(r - FIGURE_12_TIP)))
        if len(known_indenters(located)):
            yield _all_tips(evidence)
    table = numbers["estimates"]["contact_models"]
    if len(table) > 1:
        yield _radius_by_contact(evidence, table)


def example_touches(evidence: Evidence) -> dict[str, int]:
    """Number of the touch nearest the middle with a tip similar to that of Figure 12."""
    posteriors = evidence.posteriors
    radius = posteriors.rows.radius_mm
    tip = np.where((radius > 0) & np.isfinite(radius), np.abs(radius - FIGURE_12_TIP), np.inf)
    near = tip == tip.min()
    angle = posteriors.mean("theta_c")
    return {"typical": int(np.where(near, np.abs(angle - np.median(angle)), np.inf).argmin())}


def _by_location(evidence: Evidence, tip: float) -> Picture:
    """Figure of r_c of one tip against location, in the form of Figure 12."""
    posteriors = evidence.posteriors
    outer = float(finger_of(evidence.sensor).outer_radius_mm)
    known = np.isfinite(posteriors.rows.location["theta_c"])
    these = np.flatnonzero((posteriors.rows.radius_mm == tip) & known)
    angle = posteriors.rows.location["theta_c"][these]
    order = np.argsort(angle)
    these, angle = these[order], angle[order]
    low, middle, high = np.quantile(posteriors.posterior["R"][..., these], [0.05, 0.5, 0.95], axis=(0, 1))
    low, middle, high = (indenter_radius(values, outer) for values in (low, middle, high))
    samples = evidence.means(each_sample=True)
    single = fit_points(samples, evidence.calibration, model_finger(evidence.calibration, _contact(evidence)))
    dots = (samples.indenter_radius_mm == tip) & (samples.angle_deg is not None)
    repeated = samples.n_touches > len(posteriors.rows.touch)
    # The table may count angles from 0 to 360 degree; each dot is drawn in the turn of its touch.
    of_touch = posteriors.rows.location["theta_c"][index_among(posteriors.rows.touch, evidence.touch_of_samples)]
    # An interval that reaches the flat has no upper limit in r_c; it is cut off at four times the tip.
    top = 1.08 * float(min(high.max(), 4 * tip))
    low, middle, high = (np.minimum(values, 10 * top) for values in (low, middle, high))
    with drawing():
        figure, axes = canvas(4.3)
        ax = axes[0, 0]
        if repeated and samples.angle_deg is not None:
            jitter = 0.12 * np.median(np.diff(np.unique(angle))) if len(np.unique(angle)) > 1 else 0.0
            ax.plot(
                nearest_turn(samples.angle_deg, of_touch)[dots] + jitter,
                single.r_c[dots],
                ".",
                ms=3,
                color=GREY,
                alpha=0.5,
                label="fit to one sample",
            )
        ax.errorbar(
            angle,
            middle,
            [middle - low, high - middle],
            fmt="o-",
            ms=3.5,
            lw=1,
            elinewidth=1,
            color=BLUE,
            label="posterior: median and 90 % interval",
        )
        ax.axhline(tip, color=RED, ls=":", lw=1.8, label="actual radius")
        ax.set(xlabel="reference location θ (degree)", ylabel="estimate of r_c (mm)", ylim=(0, top))
        ax.grid(axis="y")
        margin = 0.04 * max(float(np.ptp(angle)), 1.0)
        ax.set_xlim(angle.min() - margin, angle.max() + margin)
        mark_elements(ax, np.asarray(evidence.calibration.mode["theta_s"]), *ax.get_xlim())
        legend_below(ax, 2)
        content = rendered(figure)
    inside = float(100 * np.mean((low <= tip) & (tip <= high)))
    return Picture(
        "estimate_by_location",
        "estimates",
        f"Estimate of r_c against location, tip of {number(tip)} mm",
        "The form of the paper's Figure 12. Dots are posterior medians of touches averaged over their samples, bars "
        "90 % intervals; grey, where there are repeats, least-squares fits to single samples. An error that stays with "
        "the location is bias, scatter of the grey dots is noise. Triangles mark elements.",
        f"Estimated indenter radius against contact angle for a tip of {number(tip)} mm: medians run from "
        f"{number(float(middle.min()))} to {number(float(middle.max()))} mm; {inside:.0f} % of the intervals hold the "
        "actual radius.",
        content,
    )


def _contact(evidence: Evidence) -> str:
    return str(evidence.calibration.settings["contact"])


def _all_tips(evidence: Evidence) -> Picture:
    """Figure of R of every tip against location, in the form of Figure 13."""
    posteriors = evidence.posteriors
    outer = float(finger_of(evidence.sensor).outer_radius_mm)
    radius, angle = posteriors.rows.radius_mm, posteriors.rows.location["theta_c"]
    mean = posteriors.mean("R")
    tips = known_indenters(radius)
    with drawing():
        figure, axes = canvas(4.6)
        ax = axes[0, 0]
        for tip, colour in zip(tips, ordered_colours(len(tips)), strict=True):
            these = np.flatnonzero((radius == tip) & np.isfinite(angle))
            these = these[np.argsort(angle[these])]
            ax.plot(angle[these], mean[these], "-o", ms=2.5, lw=1, color=colour)
            actual = float(reference_composite_radius(tip, outer))
            ax.axhline(actual, color=colour, ls=":", lw=1.1)
        low, high = float(np.nanmin(angle)), float(np.nanmax(angle))
        margin = 0.03 * max(high - low, 1.0)
        ax.set(
            xlabel="reference location θ (degree)",
            ylabel="posterior mean of R (mm)",
            xlim=(low - margin, high + margin),
        )
        ax.set_ylim(-0.04 * outer, 1.04 * outer)
        _direct_labels(ax, [float(reference_composite_radius(t, outer)) for t in tips], tips, outer)
        mark_elements(ax, np.asarray(evidence.calibration.mode["theta_s"]), *ax.get_xlim())
        content = rendered(figure)
    names = ", ".join(indenter_name(float(tip)) for tip in tips)
    return Picture(
        "all_tips",
        "estimates",
        "Composite radius R of every tip against location",
        "The form of the paper's Figure 13, in R = 1/(1/r_b + 1/r_c), where edge (0) and flat (r_b) are ends and "
        "errors of all tips have about the same size. Dotted: actual R of each tip, named on the right. Bumps that all "
        "lines share are a bias of the location. A posterior mean cannot lie on an end itself.",
        f"Posterior mean of R against contact angle, one line for each of {names}, beside the actual values.",
        content,
    )


def _direct_labels(ax: Axes, places: list[float], tips: FloatArray, outer: float) -> None:
    """Write the names of the tips next to the right axis, moved apart if they would overlap."""
    gap = 0.055 * outer
    at = np.array(places)
    for _ in range(200):
        near = np.diff(at) < gap
        if not near.any():
            break
        push = np.where(near, (gap - np.diff(at)) / 2 + 1e-6, 0.0)
        at[:-1] -= push
        at[1:] += push
    for tip, place, colour in zip(tips, at, ordered_colours(len(tips)), strict=True):
        ax.annotate(
            indenter_name(float(tip)),
            (1.01, place),
            xycoords=("axes fraction", "data"),
            va="center",
            fontsize=8.5,
            color=colour,
            annotation_clip=False,
        )


def _radius_by_contact(evidence: Evidence, table: list[dict[str, Any]]) -> Picture:
    """Figure of R by contact model over the true R: Table 3 as a figure."""
    actual = np.array([row["R_mm"] for row in table], dtype=float)
    with drawing():
        figure, axes = canvas(4.6)
        ax = axes[0, 0]
        end = float(finger_of(evidence.sensor).outer_radius_mm)
        ax.plot([0, end], [0, end], ":", color=RED, lw=1.8, label="actual")
        for contact, colour, marker in zip(CONTACT_MODELS, PALETTE[2:], "sD^", strict=False):
            estimate = [row["fits"][contact]["model"]["R_mm"] for row in table]
            ax.plot(
                actual,
                estimate,
                marker=marker,
                ms=5,
                lw=1,
                color=colour,
                label=f"fits, {contact.replace('hertz', 'Hertz')} contact",
            )
        posterior = [row["posterior"]["R_mm"] for row in table]
        ax.plot(actual, posterior, "o-", ms=5, lw=1, color=BLUE, label=f"posterior, {_contact(evidence)} contact")
        ax.set(
            xlabel="actual composite radius R (mm)", ylabel="mean estimate of R (mm)", xlim=(-0.03 * end, 1.03 * end)
        )
        ax.set_ylim(-0.03 * end, 1.06 * end)
        ax.grid()
        above = ax.secondary_xaxis("top")
        above.set_xticks(actual, [_short(row["r_c_mm"], row["indenter"]) for row in table])
        above.tick_params(labelsize=8, rotation=45 if len(table) > 7 else 0)
        above.set_xlabel("tip radius r_c (mm)")
        ax.legend(loc="upper left")
        content = rendered(figure)
    hertz = [row["fits"]["hertz"]["model"]["R_mm"] for row in table]
    return Picture(
        "radius_by_contact_model",
        "estimates",
        "Mean radius estimate by contact model",
        "Table 3 as a figure. A model that is right lies on the dotted line; a contact that is computed too wide "
        "(Hertz on a thin layer) makes the radius come out too small.",
        f"Mean estimate of R against actual R by contact model; at R = {number(float(actual[-1]))} mm Hertz gives "
        f"{number(float(hertz[-1]))} mm and the posterior {number(float(posterior[-1]))} mm.",
        content,
    )


def _short(radius: object, name: object) -> str:
    if radius is None:
        return "flat"
    return "edge" if radius == 0 else str(name).removesuffix(" mm")
