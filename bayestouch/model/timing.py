"""Time of each row, on one clock for the whole data set."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.grouping import beginnings, groups
from bayestouch.data.touches import Touches

# Without times, touches begin one unit apart, and the samples of a touch take this share of the unit.
HELD_SHARE = 0.2
OVERLAP = (
    "times of the two tables overlap, as where a clock begins again: the touches to be read are taken to follow "
    "directly after the calibration"
)
# Touches of k parts that were recorded in turn follow each other k times as close as those of one part. Clocks of
# their own bring touches of two parts as close as by chance; half of that distance allows for an uneven pace.
CLOSE = 0.5


@dataclass(frozen=True, eq=False)
class Timing:
    """Clock of a table; n rows, t touches (in the order of their first row).

    Attributes
    ----------
    time_s, held_s : (n,) arrays
        Time of each row, and time since the first row of its touch that is in contact (zero before it).
    unit : str
        ``"s"``, or ``"touch"`` if the order of the rows is used instead of times.
    note : str
        Assumption on the times; empty if the times of the table are used.
    """

    time_s: FloatArray
    held_s: FloatArray
    unit: str
    note: str = ""

    @classmethod
    def of(cls, touches: Touches) -> Timing:
        """The times of the table if they are complete and of one clock, in any order of rows; else this order."""
        time = touches.time_s
        if not np.isfinite(time).all():
            return cls._by_order(touches, "times are missing")
        if not len(time) or np.ptp(time) == 0:
            return cls._by_order(touches, "all times are the same")
        begin, end = _spans(touches)
        # Touches that are not sorted by time, such as those of a table that is sorted by tip, are parts that are.
        if not _of_one_clock(begin, end, np.cumsum(np.diff(begin, prepend=begin[:1]) < 0)):
            return cls._by_order(touches, "touches overlap in time, as where a clock begins again")
        _, group = groups(touches.touch)
        first = beginnings(time, touches.in_contact, group, int(group.max()) + 1)
        # A touch without rows in contact has `held_s` zero.
        held = np.maximum(time - np.minimum(first[group], time), 0.0)
        return cls(time - time.min(), held, "s")

    @classmethod
    def in_unit(cls, touches: Touches, unit: str) -> Timing:
        """The clock of a table for a calibration whose effects have times in this unit.

        A calibration without times counts in touches, so the order of the rows is used also where the table has times.
        """
        found = cls.of(touches)
        if found.unit == unit:
            return found
        if unit == "touch":
            return cls._by_order(touches, "the touches of the calibration had no times")
        return replace(
            found, note=f"{found.note} The effects of the calibration have times in {unit}, which do not fit."
        )

    @classmethod
    def _by_order(cls, touches: Touches, why: str) -> Timing:
        _, group = groups(touches.touch)
        n = int(group.max()) + 1 if len(group) else 0
        order = np.lexsort((touches.sample, group))
        starts = np.searchsorted(group[order], np.arange(n))
        rank = np.empty(len(group))
        rank[order] = np.arange(len(group)) - starts[group[order]]
        first = np.full(n, np.inf)
        np.minimum.at(first, group, np.where(touches.in_contact, rank, np.inf))
        since = np.maximum(rank - np.minimum(first[group], rank), 0.0)
        held = HELD_SHARE * since / max(float(since.max(initial=0.0)), 1.0)
        return cls(group + held, held, "touch", f"{why}: the order of the rows is taken as time, one unit a touch.")

    def after(self, end: float, gap: float) -> Timing:
        """The clock started at `end` + `gap`, for a table that was recorded after another."""
        return Timing(self.time_s + end + gap, self.held_s, self.unit, self.note)


def one_clock(first: Touches, second: Touches) -> tuple[Timing, Timing, bool]:
    """Clocks of two tables of one recording, and whether their touches interleave in time.

    If both have good times that fit each other, these are used: one table after the other, or touches of both in turn.
    Else the second is assumed to begin directly after the first.
    """
    one, two = Timing.of(first), Timing.of(second)
    if one.unit == two.unit == "s":
        if _fit_together(first, second):
            start = min(first.time_s.min(), second.time_s.min())
            one, two = (replace(own, time_s=t.time_s - start) for own, t in ((one, first), (two, second)))
            return one, two, _interleaved(first, second)
        two = replace(two, note=OVERLAP)
    elif one.unit != two.unit:
        # If one table has no good times, the order of the rows is used for both.
        one, two = (Timing.of(t.with_(time_s=np.full(t.n_rows, np.nan))) for t in (first, second))
    gap = typical_gap(one.time_s, one.held_s)
    return one, two.after(float(one.time_s.max()), gap), False


def _fit_together(first: Touches, second: Touches) -> bool:
    """Whether the times of two tables, each with good ones, are of one clock."""
    if not _interleaved(first, second):
        return True
    spans = [_spans(table) for table in (first, second)]
    begin, end = (np.concatenate(each) for each in zip(*spans, strict=True))
    return _of_one_clock(begin, end, np.repeat([0, 1], [len(each) for each, _ in spans]))


def _of_one_clock(begin_s: FloatArray, end_s: FloatArray, part: IntArray) -> bool:
    """Whether touches of several parts can be of one recording: those of different parts do not overlap in time.

    If each part has a clock that begins again, they do; or they are as close to each other as by chance.

    Parameters
    ----------
    begin_s, end_s : (t,) arrays
        Time at which each touch begins and ends.
    part : (t,) int array
        Part of each touch, such as its table.
    """
    own, order = np.lexsort((begin_s, part)), np.argsort(begin_s, kind="stable")
    steps = np.diff(begin_s[own])[np.diff(part[own]) == 0]
    close = CLOSE / len(np.unique(part)) * steps.min() if len(steps) else 0.0
    other = np.diff(part[order]) != 0
    free = begin_s[order][1:] > np.maximum.accumulate(end_s[order])[:-1]
    return bool((free & (np.diff(begin_s[order]) >= close))[other].all())


def _interleaved(first: Touches, second: Touches) -> bool:
    """Whether neither table ends before the other begins."""
    one, two = first.time_s, second.time_s
    return bool(one.min() < two.max() and two.min() < one.max())


def _spans(touches: Touches) -> tuple[FloatArray, FloatArray]:
    """Times (t,) of the first and the last row in contact of each touch that has one, in the order of the table."""
    _, group = groups(touches.touch)
    n = int(group.max()) + 1
    begin = beginnings(touches.time_s, touches.in_contact, group, n)
    end = -beginnings(-touches.time_s, touches.in_contact, group, n)
    pressed = np.isfinite(begin)
    return begin[pressed], end[pressed]


def typical_gap(time_s: FloatArray, held_s: FloatArray) -> float:
    """Median time from the last row of a touch to the first row of the next; 0 for a single touch."""
    start = time_s - held_s
    order = np.argsort(time_s, kind="stable")
    begin, now = start[order], time_s[order]
    # The beginnings of the rows of one touch differ by rounding.
    new = np.flatnonzero(np.diff(begin) > 1e-9 * (np.ptp(time_s) if len(time_s) else 0.0))
    return float(np.median(begin[new + 1] - now[new])) if len(new) else 0.0
