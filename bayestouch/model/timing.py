"""Time of each row, on one clock for the whole data set."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.grouping import beginnings, groups
from bayestouch.data.touches import Touches

# Without times, touches begin one unit apart, and the samples of a touch take this share of the unit.
HELD_SHARE = 0.2


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
        """The times of the table if they are complete and increase, else the order of the rows."""
        _, group = groups(touches.touch)
        time = touches.time_s
        n = int(group.max()) + 1 if len(group) else 0
        first = beginnings(time, touches.in_contact, group, n)
        # A touch without rows in contact has `held_s` zero.
        held = np.maximum(time - np.minimum(first[group], time), 0.0)
        if np.isfinite(time).all() and np.all(np.diff(first[np.isfinite(first)]) >= 0) and n > 0 and np.ptp(time) > 0:
            return cls(time - time.min(), held, "s")
        return cls._by_order(
            touches, "times are missing" if np.isnan(time).any() else "times do not increase from touch to touch"
        )

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


def one_clock(first: Touches, second: Touches) -> tuple[Timing, Timing]:
    """Clocks of two tables that were recorded one after the other.

    If both have good times and the second begins after the first, these times are used; else the second is assumed to
    begin directly after the first.
    """
    one, two = Timing.of(first), Timing.of(second)
    if one.unit == two.unit == "s":
        start, end, begin = first.time_s.min(), first.time_s.max(), second.time_s.min()
        if begin >= end:
            return one, Timing(second.time_s - start, two.held_s, "s")
    elif one.unit != two.unit:
        # If one table has no good times, the order of the rows is used for both.
        one, two = (Timing.of(t.with_(time_s=np.full(t.n_rows, np.nan))) for t in (first, second))
    gap = typical_gap(one.time_s, one.held_s)
    return one, two.after(float(one.time_s.max()), gap)


def typical_gap(time_s: FloatArray, held_s: FloatArray) -> float:
    """Median time from the last row of a touch to the first row of the next; 0 for a single touch."""
    start = time_s - held_s
    order = np.argsort(time_s, kind="stable")
    begin, now = start[order], time_s[order]
    # The beginnings of the rows of one touch differ by rounding.
    new = np.flatnonzero(np.diff(begin) > 1e-9 * (np.ptp(time_s) if len(time_s) else 0.0))
    return float(np.median(begin[new + 1] - now[new])) if len(new) else 0.0
