"""Figures at the top of a report: the error of each quantity, with an interval."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.reporting.evidence import Evidence

# Enough resamples that the ends of a 90 % interval vary by about a hundredth of its width.
_RESAMPLES = 2000
_ENDS = (0.05, 0.95)


@dataclass(frozen=True, eq=False)
class HeadlineError:
    """Errors of one quantity.

    Attributes
    ----------
    name, unit : str
        Name and unit for the page.
    errors : ndarray
        Posterior mean minus reference of each touch, (t,); NaN without a reference.
    sd : ndarray
        Posterior standard deviation of each touch, (t,).
    """

    name: str
    unit: str
    errors: FloatArray
    sd: FloatArray


def headline(quantities: list[HeadlineError], evidence: Evidence) -> list[dict[str, Any]]:
    """Rms error of each quantity with the ends of its 90 % interval.

    The interval is from a bootstrap over places, because touches at one place share the error of the calibration there.
    A quantity without references has the median posterior standard deviation instead, with the range of 90 % of its
    touches.

    Returns
    -------
    list of dict
        ``quantity``, ``unit``, ``kind`` (``rms error`` or ``posterior sd``), ``value``, ``low``, ``high`` (None if all
        touches are at one place), ``touches``, ``places``.
    """
    place = _places(evidence)
    return [_figure(quantity, place, evidence.seed) for quantity in quantities]


def _places(evidence: Evidence) -> IntArray:
    """Number of the place of each touch, (t,); a touch without a reference location has a place of its own."""
    where = np.stack([np.asarray(values, dtype=float) for values in evidence.posteriors.rows.location.values()], axis=1)
    known = np.isfinite(where).all(axis=1)
    place = len(where) + np.arange(len(where))
    place[known] = np.unique(where[known], axis=0, return_inverse=True)[1].ravel()
    return place


def _figure(quantity: HeadlineError, place: IntArray, seed: int) -> dict[str, Any]:
    named: dict[str, Any] = {"quantity": quantity.name, "unit": quantity.unit}
    known = np.isfinite(quantity.errors)
    if not known.any():
        low, high = np.quantile(quantity.sd, _ENDS)
        value = float(np.median(quantity.sd))
        many = {"touches": len(quantity.sd), "places": len(np.unique(place))}
        return {**named, "kind": "posterior sd", "value": value, "low": float(low), "high": float(high), **many}
    squares = quantity.errors[known] ** 2
    low_high = _bootstrap(squares, place[known], seed)
    many = {"touches": int(known.sum()), "places": len(np.unique(place[known]))}
    value = float(np.sqrt(squares.mean()))
    return {**named, "kind": "rms error", "value": value, "low": low_high[0], "high": low_high[1], **many}


def _bootstrap(squares: FloatArray, place: IntArray, seed: int) -> tuple[float | None, float | None]:
    """Ends of the 90 % interval of the root mean square, where places are drawn with replacement."""
    _, place = np.unique(place, return_inverse=True)
    totals, counts = np.bincount(place, squares), np.bincount(place)
    n = len(counts)
    if n < 2:
        return None, None
    drawn = np.random.default_rng(seed).multinomial(n, np.full(n, 1 / n), _RESAMPLES)
    low, high = np.quantile(np.sqrt(drawn @ totals / (drawn @ counts)), _ENDS)
    return float(low), float(high)
