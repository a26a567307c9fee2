"""Sentence that says where the remaining residual is large."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.errors import few
from bayestouch.model.held_out import HeldOut

# Number of bins of a view, and smallest excess of a bin's mean square (standard errors) to be named.
BINS, STANDS_OUT = 12, 4.0
# Largest number of views that are named.
NAMED = 3


@dataclass(frozen=True, eq=False)
class View:
    """Mean square of the whitened residuals as a function of one quantity; b bins.

    Attributes
    ----------
    name, unit : str
        Name and unit of the quantity.
    ends : (b + 1,) array or None
        Limits of the bins; None if each bin is an element.
    square, error : (b,) arrays
        Mean square of each bin, and its standard error if nothing is missing; NaN without readings.
    """

    name: str
    unit: str
    ends: FloatArray | None
    square: FloatArray
    error: FloatArray

    @property
    def contrast(self) -> float:
        """Score of how unevenly the excess is spread: chi-square of the bins about their common mean, standardised."""
        some = np.isfinite(self.square)
        if some.sum() < 2:
            return 0.0
        weight = 1 / self.error[some] ** 2
        common = float((weight * self.square[some]).sum() / weight.sum())
        chi_square = float((weight * (self.square[some] - common) ** 2).sum())
        freedom = int(some.sum()) - 1
        return float((chi_square - freedom) / np.sqrt(2 * freedom))

    def outstanding(self) -> list[str]:
        """Names of the bins with a mean square far above the overall one; neighbouring bins are joined."""
        high = np.nan_to_num(self.square, nan=0.0) > np.nanmean(self.square) + STANDS_OUT * np.nan_to_num(self.error)
        if self.ends is None:
            return [f"e{i + 1:02d}" for i in np.flatnonzero(high)]
        out: list[str] = []
        start = None
        for i, one in enumerate([*high, False]):
            if one and start is None:
                start = i
            if not one and start is not None:
                out.append(f"{self.ends[start]:.3g} to {self.ends[i]:.3g} {self.unit}")
                start = None
        return out


def views(held: HeldOut) -> Iterator[View]:
    """Views of the held-out residuals: by element, and along each quantity."""
    m = held.residual.shape[1]
    element = np.broadcast_to(np.arange(m, dtype=float), held.residual.shape)
    yield _view(held, "element", "", element, np.arange(m + 1) - 0.5, by_element=True)
    for each in held.quantities:
        finite = each.values[np.isfinite(each.values)]
        yield _view(held, each.name, each.unit, each.values, bin_ends(finite))


def bin_ends(values: FloatArray) -> FloatArray:
    """Limits of bins with equally many values, or of one bin for each value if there are few."""
    distinct = np.unique(values)
    if len(distinct) <= BINS:
        middle = 0.5 * (distinct[1:] + distinct[:-1])
        return np.concatenate([[distinct[0]], middle, [distinct[-1]]])
    return np.unique(np.quantile(values, np.linspace(0, 1, BINS + 1)))


def _view(
    held: HeldOut, name: str, unit: str, values: FloatArray, ends: FloatArray, *, by_element: bool = False
) -> View:
    present = held.present & np.isfinite(values)
    place = np.clip(np.searchsorted(ends, values[present], side="right") - 1, 0, len(ends) - 2)
    count = np.bincount(place, minlength=len(ends) - 1).astype(float)
    squares = np.bincount(place, weights=held.whitened[present] ** 2, minlength=len(count))
    some = count > 0
    with np.errstate(invalid="ignore", divide="ignore"):
        square = np.where(some, squares / count, np.nan)
        error = np.where(some, np.sqrt(2 / count), np.nan)
    return View(name, unit, None if by_element else ends, square, error)


def where_it_is(held: HeldOut | None) -> str:
    """Sentence with the quantities over which the excess is spread most unevenly, and where it is large."""
    if held is None:
        return "no touches were held out to look at"
    found = sorted(views(held), key=lambda view: -view.contrast)
    parts = []
    for view in found[:NAMED]:
        named = view.outstanding()
        if view.contrast > max(STANDS_OUT, found[0].contrast / 2) and named:
            parts.append(f"{view.name} {few(named, 4)}" if view.ends is not None else f"elements {few(named, 6)}")
    return "most at " + "; ".join(parts) if parts else "spread evenly over elements, locations, loads, radii and time"
