"""What is odd about a touch table although it can be read: told to the user, changed in nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.touches import Touches

#: A column whose largest (or smallest) value comes back in more than this share of its rows has piled up
#: there. Noise that the readout resolves makes an extreme value unique: 0.1 % is much.
STUCK_SHARE = 0.2

#: Below this many rows with readings an extreme comes back by chance.
STUCK_ROWS = 10


@dataclass(frozen=True, eq=False)
class Tally:
    """Counts over a table, which add up over pieces of it; m elements.

    Attributes
    ----------
    rows, touches : int
        How many.
    away, odd : int
        Rows without contact, and those of them that state a contact.
    load_missing, load_negative : int
        Rows.
    load_lowest : float
        Least load, N/m or N.
    location_missing : int or None
        Rows; None where the table has no location.
    without_reading : int
        Rows without any reading.
    there, lowest, highest : (m,) arrays
        Readings of each element: how many, and their extremes.
    touched, touched_lowest, touched_highest : (m,) arrays
        The same in contact.
    at_lowest, at_highest : (m,) int arrays
        Readings in contact that equal their extremes.
    """

    rows: int
    touches: int
    away: int
    odd: int
    load_missing: int
    load_negative: int
    load_lowest: float
    location_missing: int | None
    without_reading: int
    there: IntArray
    lowest: FloatArray
    highest: FloatArray
    touched: IntArray
    touched_lowest: FloatArray
    touched_highest: FloatArray
    at_lowest: IntArray
    at_highest: IntArray

    @classmethod
    def of(cls, touches: Touches) -> Tally:
        """Count one table, or a piece that holds its touches whole."""
        away, missing = ~touches.in_contact, np.isnan(touches.readings)
        location = [v for v in (touches.angle_deg, touches.x_mm, touches.y_mm) if v is not None]
        there, lowest, highest = _extremes(touches.readings)
        touched, touched_lowest, touched_highest = _extremes(readings := touches.readings[~away])
        return cls(
            rows=touches.n_rows,
            touches=touches.n_touches,
            away=int(away.sum()),
            odd=int(((touches.contact == 1) & away).sum()),
            load_missing=int(np.isnan(touches.load).sum()),
            load_negative=int((touches.load < 0).sum()),
            load_lowest=float(np.fmin.reduce(touches.load, initial=np.inf)),
            location_missing=int(np.isnan(location).any(axis=0).sum()) if location else None,
            without_reading=int(missing.all(axis=1).sum()),
            there=there,
            lowest=lowest,
            highest=highest,
            touched=touched,
            touched_lowest=touched_lowest,
            touched_highest=touched_highest,
            at_lowest=(readings == touched_lowest).sum(axis=0),
            at_highest=(readings == touched_highest).sum(axis=0),
        )

    def __add__(self, other: Tally) -> Tally:
        low = np.minimum(self.touched_lowest, other.touched_lowest)
        high = np.maximum(self.touched_highest, other.touched_highest)
        return Tally(
            rows=self.rows + other.rows,
            touches=self.touches + other.touches,
            away=self.away + other.away,
            odd=self.odd + other.odd,
            load_missing=self.load_missing + other.load_missing,
            load_negative=self.load_negative + other.load_negative,
            load_lowest=min(self.load_lowest, other.load_lowest),
            location_missing=None
            if self.location_missing is None
            else self.location_missing + (other.location_missing or 0),
            without_reading=self.without_reading + other.without_reading,
            there=self.there + other.there,
            lowest=np.minimum(self.lowest, other.lowest),
            highest=np.maximum(self.highest, other.highest),
            touched=self.touched + other.touched,
            touched_lowest=low,
            touched_highest=high,
            at_lowest=self.at_lowest * (self.touched_lowest == low) + other.at_lowest * (other.touched_lowest == low),
            at_highest=self.at_highest * (self.touched_highest == high)
            + other.at_highest * (other.touched_highest == high),
        )


def _extremes(readings: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """How many readings each element has, the least and the largest; inf and -inf where it has none."""
    there = (~np.isnan(readings)).sum(axis=0)
    return there, np.fmin.reduce(readings, axis=0, initial=np.inf), np.fmax.reduce(readings, axis=0, initial=-np.inf)


def remarks(tally: Tally) -> Iterator[str]:
    """Tell, one line each, what a reader of the results should know about the table."""
    if tally.touches == 1:
        yield "one touch only: there is nothing to compare it with"
    if tally.away:
        yield f"{_count(tally.away, tally.rows, 'row')} without contact (contact, depth or load is 0)"
    if tally.odd:
        rows = _count(tally.odd, tally.rows, "row")
        yield f"{rows} with contact = 1 but a depth or a load of 0, taken as without contact"
    yield from _loads(tally)
    if tally.location_missing is None:
        yield "no reference location"
    elif tally.location_missing:
        yield f"{_count(tally.location_missing, tally.rows, 'row')} without a reference location"
    yield from _missing(tally)
    yield from _stuck(tally)


def _loads(tally: Tally) -> Iterator[str]:
    if tally.load_missing == tally.rows:
        yield "no load measured"
    elif tally.load_missing:
        yield f"{_count(tally.load_missing, tally.rows, 'row')} without a measured load"
    if tally.load_negative:
        yield (
            f"{_count(tally.load_negative, tally.rows, 'row')} with a load below zero "
            f"(lowest {tally.load_lowest:g}), kept: noise or offset of the force sensor"
        )


def _missing(tally: Tally) -> Iterator[str]:
    missing = tally.rows - tally.there
    gone = tally.there == 0
    for k in np.flatnonzero(gone):
        yield f"e{k + 1:02d}: no reading in any row, so nothing is learnt from this element"
    if count := int(missing[~gone].sum()):
        worst = int(np.argmax(np.where(gone, -1, missing)))
        share = 100 * missing[worst] / tally.rows
        yield f"{count} readings missing, the most in e{worst + 1:02d} ({share:.3g} % of its rows)"
    if tally.without_reading:
        yield f"{_count(tally.without_reading, tally.rows, 'row')} without any reading"


def _stuck(tally: Tally) -> Iterator[str]:
    enough = tally.touched >= STUCK_ROWS
    for k in range(len(tally.there)):
        if tally.there[k] > 1 and tally.lowest[k] == tally.highest[k]:
            yield f"e{k + 1:02d}: constant at {tally.lowest[k]:g}, so nothing is learnt from this element"
            continue
        for at, extreme, which in (
            (tally.at_lowest, tally.touched_lowest, "smallest"),
            (tally.at_highest, tally.touched_highest, "largest"),
        ):
            share = at[k] / max(int(tally.touched[k]), 1)
            if enough[k] and share > STUCK_SHARE:
                yield (
                    f"e{k + 1:02d}: {100 * share:.0f} % of the readings in contact are exactly its {which}, "
                    f"{extreme[k]:g}: the element may be saturated there"
                )


def _count(part: int, whole: int, noun: str) -> str:
    return f"{int(part)} of {whole} {noun if whole == 1 else noun + 's'}"
