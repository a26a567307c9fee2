"""Table and plots of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from bayestouch.diagnosis.pictures.search import draw_round
from bayestouch.diagnosis.traced import Traced
from bayestouch.errors import InputError
from bayestouch.output.pictures import BLUE, RED, element_ticks
from bayestouch.results.plots import new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

_OF_EFFECT = ("elpd_gain", "elpd_gain_se", "explained_fraction")


def effect_table(numbers: Mapping[str, Any]) -> DataFrame:
    """Table of the effects that were found; see `bayestouch.Diagnosis.to_dataframe`."""
    import pandas as pd

    rows = [
        {"effect": effect["name"], "stage": effect["stage"], "parameter": name, **value}
        | {each: effect[each] for each in _OF_EFFECT}
        for effect in numbers["effects"]
        for name, value in effect["parameters"].items()
    ]
    return pd.DataFrame(rows, columns=["effect", "stage", "parameter", "mean", "sd", "unit", *_OF_EFFECT])


def plot_errors(traced: Traced, axes: Axes | None = None) -> Axes:
    """Plot the rms residual by element, before and after; see `bayestouch.Diagnosis.plot_errors`."""
    before, after = traced.before.held_out, traced.after.held_out
    if before is None or after is None:
        raise InputError("no touches were held out: errors are not known")
    axes = new_axes(axes)
    for held, colour, label, shift in ((before, RED, "before", -0.2), (after, BLUE, "after", 0.2)):
        residual = held.residual if held.samples is None else held.samples
        count = np.isfinite(residual).sum(axis=0)
        with np.errstate(invalid="ignore"):
            size = 100 * np.sqrt(np.nansum(residual**2, axis=0) / count)
        axes.bar(np.arange(len(size)) + shift, size, 0.4, color=colour, label=label)
    element_ticks(axes, len(size))
    axes.set(xlabel="element", ylabel="rms residual of held-out touches\n(% of the element's peak)")
    axes.legend(frameon=False, fontsize="small")
    return axes


def plot_candidates(traced: Traced, number: int = 1, axes: Axes | None = None) -> Axes:
    """Plot the candidates of a round; see `bayestouch.Diagnosis.plot_candidates`."""
    if not 1 <= number <= len(traced.rounds):
        raise InputError(f"round: expected 1 to {len(traced.rounds)}, got {number}")
    each = traced.rounds[number - 1]
    axes = new_axes(axes, height=1.2 + 0.2 * len(each.tried))
    draw_round(axes, number, each, [tried.effect.name for tried in each.tried])
    axes.invert_yaxis()
    return axes
