"""Figures of residuals before and after: along every quantity, and between pairs of elements."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.diagnosis.where import View, views
from bayestouch.model.held_out import HeldOut
from bayestouch.output.pictures import (
    BLUE,
    DIVERGING,
    GREY,
    RED,
    Picture,
    canvas,
    drawing,
    element_ticks,
    rendered,
)

COLUMNS = 2


def view_picture(before: HeldOut, after: HeldOut) -> Picture:
    """Figure of the residuals' mean square relative to the noise, along each quantity, before and after."""
    pairs = list(zip(views(before), views(after), strict=True))
    rows = -(-len(pairs) // COLUMNS)
    with drawing():
        figure, axes = canvas(2.1 * rows, rows, COLUMNS)
        for axis, (one, two) in zip(axes.ravel(), pairs, strict=False):
            for view, colour, label in ((one, RED, "before"), (two, BLUE, "after")):
                axis.errorbar(_middle(view), view.square, view.error, fmt="o-", ms=3.5, color=colour, label=label)
            axis.axhline(1, color=GREY, ls=":")
            axis.set(ylim=(0, None), xlabel=f"{one.name} ({one.unit})" if one.unit else one.name)
            if one.ends is None:
                element_ticks(axis, len(one.square))
        for axis in axes.ravel()[len(pairs) :]:
            axis.set_axis_off()
        for axis in axes[:, 0]:
            axis.set_ylabel("mean square / noise")
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
        content = rendered(figure, "png")
    return Picture(
        "views",
        "residual",
        "Where the residual lives",
        "Mean square of held-out residuals over that of the noise, with the standard error that noise alone would "
        "give. 1 (dotted) is a model without error.",
        f"Mean square residual over noise by {', '.join(one.name for one, _ in pairs)}: on the whole "
        f"{before.lack_of_fit:.2f} before and {after.lack_of_fit:.2f} after.",
        content,
        "png",
    )


def _middle(view: View) -> FloatArray:
    if view.ends is None:
        return np.arange(len(view.square), dtype=float)
    return np.asarray(0.5 * (view.ends[1:] + view.ends[:-1]))


def pair_picture(before: HeldOut, after: HeldOut) -> Picture:
    """Figure of the correlation between residuals of pairs of elements, before and after."""
    m = before.residual.shape[1]
    tables = [_correlation(each.whitened) for each in (before, after)]
    expected = 1 / np.sqrt(len(before.whitened))
    with drawing():
        figure, axes = canvas(3.9, 1, 2, sharey=True)
        for axis, table, label in zip(axes[0], tables, ("before", "after"), strict=True):
            mesh = axis.imshow(table, cmap=DIVERGING, vmin=-0.5, vmax=0.5)
            axis.set_title(label)
            element_ticks(axis, m)
        element_ticks(axes[0][0], m, "y")
        figure.colorbar(mesh, ax=list(axes[0]), label="correlation", shrink=0.8, extend="both")
        content = rendered(figure, "png")
    worst = [float(np.nanmax(np.abs(table))) for table in tables]
    return Picture(
        "pairs",
        "residual",
        "Residuals of pairs of elements",
        f"Correlation between the residuals of two elements over held-out touches. Independent noise scatters by "
        f"{expected:.2f} about zero; the load's error, which all elements share, is taken out.",
        f"Correlations of up to {worst[0]:.2f} before and {worst[1]:.2f} after.",
        content,
        "png",
    )


def _correlation(whitened: FloatArray) -> FloatArray:
    size = np.sqrt((whitened**2).mean(axis=0))
    with np.errstate(invalid="ignore", divide="ignore"):
        table = whitened.T @ whitened / len(whitened) / np.outer(size, size)
    return np.where(np.eye(len(table), dtype=bool), np.nan, table)
