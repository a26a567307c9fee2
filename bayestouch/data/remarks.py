"""Remarks on a readable touch table that looks unusual; the remarks do not change the data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.data.arrays import turned
from bayestouch.data.grouping import all_equal, beginnings, groups
from bayestouch.data.touches import Touches
from bayestouch.output.text import plural

#: If more than this share of an element's readings equals the largest (or smallest) one, the element may be saturated.
#: With noise that the readout resolves, the extreme value occurs about once: 0.1 % of the rows would already be many.
STUCK_SHARE = 0.2

#: Rows of one touch that are further apart than this, in mm or degree, are at two places: a stage returns to a place
#: within tenths of that, and numbers of touches that were given twice are mostly much further apart.
APART = 1.0

#: With fewer rows with readings than this, an extreme value may repeat by chance.
STUCK_ROWS = 10


@dataclass(frozen=True, eq=False)
class Tally:
    """Counts over a table; the counts of its pieces can be added; m elements.

    Attributes
    ----------
    rows, touches : int
        Number of rows and of touches.
    away, odd : int
        Number of rows without contact, and of those among them with contact = 1.
    load_missing, load_negative : int
        Number of rows without a load, and with a load below zero.
    load_lowest : float
        Lowest load, N/m or N.
    location_missing : int or None
        Number of rows without a location; None if the table has no location columns.
    with_one_load : int
        Number of touches with the same load in two or more rows in contact, and no other one.
    at_two_places : int
        Number of touches with rows in contact whose locations differ by more than `APART`.
    time_missing : int
        Number of rows without a time.
    begun, begun_last : float
        Times at which the first and the last touch in the table began, of those with a time in contact; NaN for none.
    begun_before : int
        Number of touches that began before the one listed before them.
    without_reading : int
        Number of rows without any reading.
    there, lowest, highest : (m,) arrays
        Readings of each element: number, lowest and highest.
    touched, touched_lowest, touched_highest : (m,) arrays
        The same for rows in contact.
    at_lowest, at_highest : (m,) int arrays
        Number of readings in contact that equal `touched_lowest` and `touched_highest`.
    pairs, equal : (m,) int arrays
        Number of readings in contact that follow another one of their touch, neither of them at an extreme of its
        piece; and of those among them that equal it.
    """

    rows: int
    touches: int
    away: int
    odd: int
    load_missing: int
    load_negative: int
    load_lowest: float
    location_missing: int | None
    with_one_load: int
    at_two_places: int
    time_missing: int
    begun: float
    begun_last: float
    begun_before: int
    without_reading: int
    there: IntArray
    lowest: FloatArray
    highest: FloatArray
    touched: IntArray
    touched_lowest: FloatArray
    touched_highest: FloatArray
    at_lowest: IntArray
    at_highest: IntArray
    pairs: IntArray
    equal: IntArray

    @classmethod
    def of(cls, touches: Touches) -> Tally:
        """Return the counts of a table, or of a piece of it with complete touches."""
        begin, touch = _begin_in_order(touches), touches.touch
        away, missing = ~touches.in_contact, np.isnan(touches.readings)
        location = [v for v in (touches.angle_deg, touches.x_mm, touches.y_mm) if v is not None]
        there, lowest, highest = touched, touched_lowest, touched_highest = _extremes(readings := touches.readings)
        if away.any():
            touched, touched_lowest, touched_highest = _extremes(readings := touches.readings[~away])
            touch = touch[~away]
        at_lowest, at_highest = readings == touched_lowest, readings == touched_highest
        # rows that follow another row of their touch
        follow = np.flatnonzero(touch[1:] == touch[:-1]) + 1
        inside = ~(np.isnan(readings) | at_lowest | at_highest)
        pairs = inside[follow] & inside[follow - 1]
        return cls(
            rows=touches.n_rows,
            touches=touches.n_touches,
            away=int(away.sum()),
            odd=int(((touches.contact == 1) & away).sum()),
            load_missing=int(np.isnan(touches.load).sum()),
            load_negative=int((touches.load < 0).sum()),
            load_lowest=float(np.fmin.reduce(touches.load, initial=np.inf)),
            location_missing=int(np.isnan(location).any(axis=0).sum()) if location else None,
            with_one_load=_with_one_load(touches),
            at_two_places=_at_two_places(touches),
            time_missing=int(np.isnan(touches.time_s).sum()),
            begun=float(begin[0]) if len(begin) else np.nan,
            begun_last=float(begin[-1]) if len(begin) else np.nan,
            begun_before=int((np.diff(begin) < 0).sum()),
            without_reading=int(missing.all(axis=1).sum()),
            there=there,
            lowest=lowest,
            highest=highest,
            touched=touched,
            touched_lowest=touched_lowest,
            touched_highest=touched_highest,
            at_lowest=at_lowest.sum(axis=0),
            at_highest=at_highest.sum(axis=0),
            pairs=pairs.sum(axis=0),
            equal=(pairs & (readings[follow] == readings[follow - 1])).sum(axis=0),
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
            with_one_load=self.with_one_load + other.with_one_load,
            at_two_places=self.at_two_places + other.at_two_places,
            time_missing=self.time_missing + other.time_missing,
            begun=other.begun if np.isnan(self.begun) else self.begun,
            begun_last=self.begun_last if np.isnan(other.begun_last) else other.begun_last,
            begun_before=self.begun_before + other.begun_before + (other.begun < self.begun_last),
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
            pairs=self.pairs + other.pairs,
            equal=self.equal + other.equal,
        )

    @property
    def coarse(self) -> BoolArray:
        """Whether the steps of each element's readout are larger than twice its noise, (m,).

        With normal noise a reading equals the one before in half of the cases if a step is 2.1 standard deviations.
        Where each reading is one of two values, there is no other step.
        """
        two = (self.at_lowest + self.at_highest == self.touched) & (self.touched_lowest < self.touched_highest)
        return np.asarray((2 * self.equal > self.pairs) | two)


def _extremes(readings: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Number of readings of each element, the lowest and the highest; inf and -inf if it has none."""
    there = (~np.isnan(readings)).sum(axis=0)
    return there, np.fmin.reduce(readings, axis=0, initial=np.inf), np.fmax.reduce(readings, axis=0, initial=-np.inf)


def _with_one_load(touches: Touches) -> int:
    """Number of touches with the same load in two or more rows in contact, and no other one."""
    ids, group = groups(touches.touch[touches.in_contact])
    return int(all_equal(touches.load[touches.in_contact], group, len(ids)).sum())


def _begin_in_order(touches: Touches) -> FloatArray:
    """Time at which each touch began, in the order of the table, of the touches with a time in contact."""
    if np.isnan(touches.time_s).all():
        return np.empty(0)
    ids, group = groups(touches.touch)
    begin = beginnings(touches.time_s, touches.in_contact, group, len(ids))
    return begin[np.isfinite(begin)]


def _at_two_places(touches: Touches) -> int:
    """Number of touches with rows in contact whose locations differ by more than `APART` from one to the next."""
    rows = np.flatnonzero(touches.in_contact)
    rows = rows[np.argsort(touches.touch[rows], kind="stable")]
    same = np.diff(touches.touch[rows]) == 0
    apart = np.zeros(len(same), dtype=bool)
    for values in (touches.x_mm, touches.y_mm):
        if values is not None:
            apart |= np.abs(np.diff(values[rows])) > APART
    if touches.angle_deg is not None:
        apart |= np.abs(turned(np.diff(touches.angle_deg[rows]))) > APART
    return len(np.unique(touches.touch[rows[1:][same & apart]]))


def remarks(tally: Tally) -> Iterator[str]:
    """Yield one line for each unusual feature of the table that affects the results."""
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
    if tally.at_two_places:
        yield (
            f"{plural(tally.at_two_places, 'touch')} at more than one place: rows with one number are averaged, so "
            "give each touch a number of its own"
        )
    yield from _times(tally)
    yield from _missing(tally)
    yield from _stuck(tally)


def _loads(tally: Tally) -> Iterator[str]:
    if tally.load_missing == tally.rows:
        yield "no load measured"
    elif tally.load_missing:
        yield f"{_count(tally.load_missing, tally.rows, 'row')} without a measured load"
    # A force sensor that rounds its loads gives equal ones in a few touches.
    if 2 * tally.with_one_load > tally.touches:
        touches = _count(tally.with_one_load, tally.touches, "touch", "touches")
        yield f"{touches} with the same load in all rows: these loads count as one reading of the force sensor"
    if tally.load_negative:
        yield (
            f"{_count(tally.load_negative, tally.rows, 'row')} with a load below zero "
            f"(lowest {tally.load_lowest:g}), kept: noise or offset of the force sensor"
        )


def _times(tally: Tally) -> Iterator[str]:
    instead = "where times matter, the order of the touches is used in their place"
    by_time = "where times matter, touches are sorted by them, or taken in this order if they overlap in time"
    if 0 < tally.time_missing < tally.rows:
        yield f"{_count(tally.time_missing, tally.rows, 'row')} without a time: {instead}"
    elif tally.begun_before:
        began = f"{plural(tally.begun_before, 'touch')} began before the one above"
        yield f"times become smaller from one touch to the next ({began}): {by_time}"


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
    enough, coarse = tally.touched >= STUCK_ROWS, tally.coarse
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
                why = "the element may be saturated there"
                if coarse[k]:
                    why = "steps of the readout are larger than twice the noise, or the element is saturated there"
                yield (
                    f"e{k + 1:02d}: {100 * share:.0f} % of the readings in contact are exactly its {which}, "
                    f"{extreme[k]:g}: {why}"
                )


def _count(part: int, whole: int, noun: str, nouns: str = "rows") -> str:
    return f"{int(part)} of {whole} {noun if whole == 1 else nouns}"
