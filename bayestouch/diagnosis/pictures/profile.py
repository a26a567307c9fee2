"""Figure of the curvature of a finger's surface around it, where a diagnosis found that it is out of round."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.diagnosis.traced import Traced
from bayestouch.effects.surface import SurfaceProfile
from bayestouch.output.pictures import BLUE, GREY, Picture, canvas, drawing, rendered

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Distance between places that are drawn, degree; limits of the band.
STEP_DEG, BAND = 1.0, (0.05, 0.5, 0.95)


def profile_pictures(traced: Traced) -> Iterator[Picture]:
    """Figure of the profile, if it was found."""
    calibration = traced.explained.calibration
    for each in traced.added:
        if not isinstance(each.effect, SurfaceProfile):
            continue
        names = [parameter.name for parameter in each.effect.public_parameters()]
        draws = np.stack([np.asarray(calibration.posterior[name]).ravel() for name in names], axis=1)
        touched = traced.data.table.angle_deg
        assert touched is not None
        place, low, middle, high = profile_band(each.effect, draws)
        with drawing():
            figure, axes = canvas(3.2, 1, 1)
            draw_profile(axes[0, 0], place, (low, middle, high))
            axes[0, 0].plot(touched, np.full(len(touched), axes[0, 0].get_ylim()[0]), "|", color=GREY)
            content = rendered(figure, "png")
        sure = (low > 0) | (high < 0)
        size = float(np.sqrt(np.mean(middle[sure] ** 2))) if sure.any() else 0.0
        yield Picture(
            "surface-profile",
            "effects",
            "Curvature of the surface around the finger",
            "Curvature of the surface less that of a circle of radius r_b, with the band that holds 90 % of the "
            "posterior; ticks below are places that were touched. A touch of composite radius R that is read without "
            "it is read wrong by -R² times this. Where only edges touched, or nothing did, the band is the prior's. "
            f"The band leaves out zero on {100 * sure.mean():.0f} % of the range; the rms there is {size:.3g} /mm.",
            f"Curvature against the angle, between {middle.min():.3g} and {middle.max():.3g} /mm, with a band.",
            content,
            "png",
        )


def profile_band(effect: SurfaceProfile, draws: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Places (degree), and 5 %, median and 95 % of the departure (1/mm) there, from draws (n, k) of the values."""
    first, last = effect.knots_deg[0], effect.knots_deg[-1]
    place = np.linspace(first, last, round((last - first) / STEP_DEG) + 1)
    low, middle, high = np.quantile(draws @ effect.departures(place).T, BAND, axis=0)
    return place, low, middle, high


def draw_profile(axes: Axes, place: FloatArray, band: tuple[FloatArray, FloatArray, FloatArray]) -> None:
    """Draw the median and its band."""
    low, middle, high = band
    axes.axhline(0, color=GREY, ls=":", lw=1)
    axes.fill_between(place, low, high, color=BLUE, alpha=0.25, lw=0, label="90 %")
    axes.plot(place, middle, color=BLUE, label="median")
    axes.set(xlabel="place touched (degree)", ylabel="curvature - 1/r_b (1/mm)")
    axes.legend(loc="upper right", ncols=2)
