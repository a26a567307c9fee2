"""Plots that compare the parameters of two sensors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bayestouch.errors import InputError, few, nearest
from bayestouch.output.pictures import BLUE, RED, element_ticks
from bayestouch.results.plots import new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# half width of the central 90 % of a normal distribution, in standard deviations
_NINETY = 1.645


def plot_compared_parameter(rows: Sequence[dict[str, Any]], name: str, axes: Axes | None = None) -> Axes:
    """Plot one parameter from the rows of a comparison; see `bayestouch.Comparison.plot_parameter`."""
    by_element = by_parameter(rows)
    if name not in by_element:
        known = few(list(by_element), 20)
        raise InputError(f"{name}: no such parameter; expected one of {known}{nearest(name, by_element)}")
    axes = new_axes(axes)
    draw_parameter(axes, by_element[name])
    element_ticks(axes, last_element(by_element[name]))
    axes.set_xlabel("element")
    axes.legend(frameon=False, fontsize="small")
    return axes


def by_parameter(rows: Sequence[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Rows of the parameters that have a value for each element, by name."""
    out: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        if row["element"] is not None:
            out.setdefault(row["parameter"], []).append(row)
    return out


def last_element(rows: Sequence[dict[str, Any]]) -> int:
    """Number of the last element in the rows of a parameter, counted from 1."""
    return max(_number(row) for row in rows)


def _number(row: dict[str, Any]) -> int:
    return int(row["element"].removeprefix("e"))


def draw_parameter(axes: Axes, rows: Sequence[dict[str, Any]]) -> None:
    """Plot mean and 90 % interval of both sensors by element, minus the mean of both."""
    middle = np.array([(row["first_mean"] + row["second_mean"]) / 2 for row in rows])
    at = np.array([_number(row) for row in rows]) - 1
    for side, colour, marker, shift in (("first", BLUE, "o", -0.12), ("second", RED, "s", 0.12)):
        mean = np.array([row[f"{side}_mean"] for row in rows])
        ends = _NINETY * np.array([row[f"{side}_sd"] for row in rows])
        axes.errorbar(at + shift, mean - middle, ends, fmt=marker, ms=4, color=colour, label=side)
    unit = f"\n({rows[0]['unit']})" if rows[0]["unit"] else ""
    axes.set_ylabel(f"{rows[0]['symbol']} − mean{unit}")
    axes.grid(axis="y")
