"""Maps of residuals by element and the quantity that shows most structure."""

from __future__ import annotations

from textwrap import fill
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.model.quantities import Quantity
from bayestouch.output.pictures import DIVERGING, element_ticks

BINS = 24
# number of letters of a label below a panel with a third of the page width
LETTERS = 28


def binned(quantity: Quantity, residual: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bin limits (b + 1,), mean residual of each element in each bin (m, b), number of readings in each (m, b)."""
    values = quantity.values
    finite = values[np.isfinite(values)]
    ends = np.linspace(finite.min(), finite.max(), BINS + 1)
    distinct = np.unique(finite)
    if len(distinct) <= BINS:
        middle = 0.5 * (distinct[1:] + distinct[:-1])
        ends = np.concatenate(
            [[1.5 * distinct[0] - 0.5 * distinct[1]], middle, [1.5 * distinct[-1] - 0.5 * distinct[-2]]]
        )
    m, b = residual.shape[1], len(ends) - 1
    present = np.isfinite(residual) & np.isfinite(values)
    place = np.clip(np.searchsorted(ends, values, side="right") - 1, 0, b - 1)
    flat = (np.arange(m) * b + place)[present]
    count = np.bincount(flat, minlength=m * b).reshape(m, b).astype(np.float64)
    total = np.bincount(flat, weights=residual[present], minlength=m * b).reshape(m, b)
    return ends, np.where(count > 0, total / np.maximum(count, 1), np.nan), count


def shown_by(quantity: Quantity, residual: FloatArray) -> float:
    """Share of the residual's sum of squares in the means of the bins, in excess of what noise would give."""
    _, mean, count = binned(quantity, residual)
    total = float(np.nansum(residual**2))
    n, bins = int(np.isfinite(residual).sum()), int((count > 0).sum())
    held = float(np.nansum(count * mean**2))
    return (held / total - bins / n) / (1 - bins / n) if total > 0 and n > bins else -np.inf


def most_telling(quantities: tuple[Quantity, ...], residual: FloatArray) -> Quantity:
    """Quantity against which a residual (t, m) shows most structure."""
    return max(quantities, key=lambda each: shown_by(each, residual))


def draw_map(axes: Any, quantity: Quantity, residual: FloatArray, limit: float) -> Any:
    """Draw a map of the mean residual, in percent of the peak, from minus to plus `limit`."""
    ends, mean, _ = binned(quantity, residual)
    m = residual.shape[1]
    axes.set_facecolor("#eeeeee")
    mesh = axes.pcolormesh(
        ends, np.arange(m + 1) - 0.5, 100 * mean, cmap=DIVERGING, vmin=-limit, vmax=limit, rasterized=True
    )
    unit = "touches" if quantity.unit == "touch" else quantity.unit
    label = f"{quantity.name} ({unit})" if unit else quantity.name
    if len(label) > LETTERS:  # three panels are side by side
        label = fill(quantity.name, LETTERS) + (f"\n({unit})" if unit else "")
    axes.set_xlabel(label)
    axes.locator_params("x", nbins=4)
    element_ticks(axes, m, "y")
    return mesh
