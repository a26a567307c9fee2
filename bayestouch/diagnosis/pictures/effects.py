"""Figures of each effect: residual before, change of the prediction by the effect, residual after."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayestouch.diagnosis.pictures.maps import binned, draw_map, most_telling
from bayestouch.diagnosis.pictures.scatter import scatter_picture
from bayestouch.diagnosis.traced import Traced
from bayestouch.model.held_out import HeldOut
from bayestouch.output.pictures import Picture, canvas, drawing, rendered
from bayestouch.output.text import in_form

# If an effect within touches lowers the mean square of touch means by this factor, its figure shows touch means.
IN_MEANS = 1.1


def effect_pictures(traced: Traced) -> Iterator[Picture]:
    """Figures of each effect that was added, then of the correction."""
    steps = traced.steps
    for number, each in enumerate(traced.rounds[:-1] if steps else (), start=1):
        assert each.added is not None
        name, summary = each.added.effect.name, each.added.effect.summary
        if name not in {kept.effect.name for kept in traced.added}:
            summary += " (taken out again later)"
        before, after = steps[number - 1], steps[number]
        in_means = before.lack_of_fit > IN_MEANS * after.lack_of_fit
        if each.added.noise is not None or (each.added.effect.needs_samples and not in_means):
            yield scatter_picture(number, each, traced.rounds[number])
            continue
        yield three_maps(
            f"effect-{number}-{name}",
            f"{name}: {summary}",
            f"what {name} does\n(prediction with − without)",
            before,
            after,
        )
    corrected = None if traced.corrected is None else traced.corrected.held_out
    if corrected is not None and traced.uncorrected.held_out is not None:
        yield three_maps(
            "correction",
            "Correction without a cause, by element and location",
            "what the correction does\n(prediction with − without)",
            traced.uncorrected.held_out,
            corrected,
        )
    if len(steps) == 1 and traced.corrected is None:
        yield one_map(steps[0])


def three_maps(file: str, title: str, middle: str, before: HeldOut, after: HeldOut) -> Picture:
    """Figure of residual before, change of the prediction and residual after, with the same axes and colours."""
    change = before.residual - after.residual
    quantity = most_telling(before.quantities, change)
    panels = (
        ("residual before\n(reading − prediction)", before.residual),
        (middle, change),
        ("residual after\n(reading − prediction)", after.residual),
    )
    limit = 100 * float(np.nanmax([np.nanquantile(np.abs(binned(quantity, values)[1]), 0.98) for _, values in panels]))
    with drawing():
        figure, axes = canvas(3.6, 1, 3, sharey=True)
        for axis, (label, values) in zip(axes[0], panels, strict=True):
            mesh = draw_map(axis, quantity, values, limit)
            axis.set_title(label)
        axes[0][0].set_ylabel("element")
        figure.colorbar(mesh, ax=list(axes[0]), label="% of the peak reading", shrink=0.9, extend="both")
        content = rendered(figure, "png")
    one, two = (in_form(100 * float(np.sqrt(np.nanmean(each.residual**2))), ".2f") for each in (before, after))
    return Picture(
        file,
        "effects",
        title,
        f"Mean over held-out touches, against {quantity.name}, where it shows most. Left: the error of the model "
        f"without it. Middle: what adding it changes. Right: what is left. Rms of all residuals {one} % of the "
        f"peak before, {two} % after.",
        f"Three maps of residuals by element and {quantity.name}; rms {one} % before, {two} % after.",
        content,
        "png",
    )


def one_map(held: HeldOut) -> Picture:
    """Figure of the residual of a model to which nothing was added."""
    quantity = most_telling(held.quantities, held.residual)
    limit = 100 * float(np.nanmax(np.abs(binned(quantity, held.residual)[1])))
    with drawing():
        figure, axes = canvas(3.6, 1, 1)
        mesh = draw_map(axes[0, 0], quantity, held.residual, limit)
        axes[0, 0].set(ylabel="element", title="residual (reading − prediction)")
        figure.colorbar(mesh, ax=axes[0, 0], label="% of the peak reading", shrink=0.9)
        content = rendered(figure, "png")
    rms = in_form(100 * float(np.sqrt(np.nanmean(held.residual**2))), ".2f")
    return Picture(
        "residual",
        "effects",
        "Residual",
        f"Mean over held-out touches, against {quantity.name}. Nothing was added to the model: patches of one colour "
        f"would be structure, single cells are noise. Rms of all residuals {rms} % of the peak.",
        f"Map of residuals by element and {quantity.name}; rms {rms} %.",
        content,
        "png",
    )
