"""Figure of the estimated radii of held-out touches, before and after."""

from __future__ import annotations

import numpy as np

from bayestouch.model.held_out import HeldOut
from bayestouch.model.touch_errors import TouchReading
from bayestouch.output.pictures import BLUE, GREY, RED, Picture, canvas, drawing, rendered
from bayestouch.output.text import in_form


def touch_picture(before: TouchReading, after: TouchReading, held_before: HeldOut, held_after: HeldOut) -> Picture:
    """Figure of estimated R over true R, with the central 90 % interval of each touch."""
    panels = (("before", before, held_before, RED), ("after", after, held_after, BLUE))
    with drawing():
        figure, axes = canvas(3.7, 1, 2, sharex=True, sharey=True)
        for axis, (label, read, held, colour) in zip(axes[0], panels, strict=True):
            truth = held.stated["R"]
            # Spread touches of the same tip horizontally.
            width = 0.02 * float(np.ptp(truth))
            shift = width * (np.argsort(np.argsort(held.stated["theta_c"])) / max(len(truth) - 1, 1) - 0.5)
            axis.vlines(truth + shift, read.low_mm, read.high_mm, color=colour, lw=0.6, alpha=0.5)
            axis.plot(truth + shift, read.R_mm, ".", color=colour, ms=3)
            axis.axline((0, 0), slope=1, color=GREY, lw=1)
            errors = read.against_stated
            axis.set(
                xlabel="R of the probe (mm)",
                title=f"{label}: bias {in_form(errors['R_bias_mm'], '+z.2f')} mm, "
                f"rms {in_form(errors['R_rms_mm'], '.2f')} mm",
            )
        axes[0][0].set_ylabel("R as read (mm)")
        content = rendered(figure, "png")
    return Picture(
        "radii",
        "touches",
        "Radii of held-out touches",
        "Posterior mean of R and its central 90 % for each held-out touch, against the R of the probe as stated.",
        "Rms error of R {} mm before and {} mm after.".format(
            *(in_form(read.against_stated["R_rms_mm"], ".2f") for read in (before, after))
        ),
        content,
        "png",
    )
