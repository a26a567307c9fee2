"""One picture of the loop on a measured pad: what was missing, what explains it, what is left, what it is worth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from _published import figure, save
from _worth import Worth

from bayestouch.diagnosis.traced import Traced
from bayestouch.diagnosis.where import views
from bayestouch.model.held_out import HeldOut
from bayestouch.output.pictures import BLUE, GREY, ORANGE

FloatArray = np.ndarray


def along(held: HeldOut, name: str | None) -> tuple[FloatArray, FloatArray]:
    """Quantity and residual (% of the peak) of each held-out reading; without a name, time since first contact."""
    if name is None:
        samples = held.errors
        return np.broadcast_to(held.observed.held_s[:, None], samples.shape), 100 * samples
    values = next(each.values for each in held.quantities if each.name == name)
    return np.broadcast_to(values, held.residual.shape), 100 * held.residual


def chosen_quantity(held: HeldOut) -> tuple[str | None, str]:
    """Quantity over which the residuals are spread most unevenly, and its label; None: time since first contact."""
    if held.samples is not None and len(held.samples) > len(held.residual):
        return None, f"time since first contact ({held.observed.unit})"
    best = max((each for each in views(held) if each.ends is not None), key=lambda each: each.contrast)
    return best.name, f"{best.name} ({best.unit})" if best.unit else best.name


def loop_picture(name: str, traced: Traced, steps: Sequence[tuple[str, float]], worth: Sequence[Worth]) -> Any:
    """Draw one data set.

    Parameters
    ----------
    name : str
        Name of the data set.
    traced : Traced
        Its diagnosis.
    steps : sequence of (str, float)
        Prediction error on held-out touches, % of the peak: kernel alone, with a map, with each effect, with the
        correction.
    worth : sequence of Worth
        Errors of the held-out touches read in each way; the last is after the diagnosis, the one before it before.
    """
    before, after = traced.before.held_out, traced.after.held_out
    assert before is not None and after is not None
    effects = [each.added.effect.name for each in traced.rounds if each.added is not None]
    corrected = traced.corrected is not None
    loads = np.isfinite(worth[-1].load_rms_N)
    picture, axes = figure(5 if loads else 4, 1, figsize=(17.0 if loads else 14.5, 3.6))
    quantity, label = chosen_quantity(before)
    named = [*effects, *(["a correction"] if corrected and effects else [])]
    found = ",\n".join(named) or ("no known effect; a correction" if corrected else "nothing")
    limit = 1.05 * float(np.nanquantile(np.abs(along(before, quantity)[1]), 0.999))
    for axis, held, colour, title in (
        (axes[0], before, ORANGE, "1. Missing: residual of the\nkernel with a map"),
        (axes[1], after, BLUE, f"2. Explained by\n{found.replace('_', ' ')}"),
    ):
        axis.plot(*(each.ravel() for each in along(held, quantity)), ".", ms=3, color=colour, alpha=0.5)
        axis.axhline(0, color=GREY, lw=0.8)
        axis.set(xlabel=fill(label, 24), ylim=(-limit, limit), title=title)
    axes[0].set_ylabel("residual, held out (% of the peak)")
    colours = [GREY, ORANGE, *[BLUE] * (len(steps) - 2)]
    names = ["kernel alone", "with a map", *(f"+ {each.replace('_', ' ')}" for each, _ in steps[2:])]
    bars(axes[2], names, [value for _, value in steps], colours, "3. Left: rms residual,\nheld out (% of the peak)")
    regressions = {each.way: each for each in worth[1:-2]}
    ways = ["before", *regressions, "after"]
    shown = [worth[-2], *regressions.values(), worth[-1]]
    colours = [ORANGE, *[GREY] * len(regressions), BLUE]
    bars(axes[3], ways, [each.rms_mm for each in shown], colours, "4. Worth: rms error of the\nlocation (mm)")
    if loads:
        bars(axes[4], ways, [each.load_rms_N for each in shown], colours, "rms error of the load,\nby the elements (N)")
    picture.suptitle(name)
    return picture


def bars(axis: Any, names: Sequence[str], values: Sequence[float], colours: Sequence[str], title: str) -> None:
    """Horizontal bars with their numbers."""
    place = np.arange(len(names))
    axis.barh(place, values, color=colours, height=0.65)
    for y, value in zip(place, values, strict=True):
        axis.annotate(f"{value:.2f}", (value, y), xytext=(3, 0), textcoords="offset points", va="center", fontsize=9)
    axis.set_yticks(place, names)
    axis.invert_yaxis()
    axis.set(title=title, xlim=(0, 1.25 * max(values)), xticks=[])
    axis.spines["bottom"].set_visible(False)


def save_loop(
    name: str, traced: Traced, steps: Sequence[tuple[str, float]], worth: Sequence[Worth], folder: Path
) -> None:
    """Draw one data set and save the picture as ``loop_NAME``."""
    save(loop_picture(name, traced, steps, worth), folder, f"loop_{file_name(name)}")


def file_name(name: str) -> str:
    """Name of a data set as that of a file."""
    return name.replace(", ", "_").replace(" ", "_")
