"""When each row was taken, on one clock for the whole data set."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.grouping import groups
from bayestouch.data.touches import Touches

# Without a clock a touch begins one unit after the one before and its samples fill this share of it.
HELD_SHARE = 0.2


@dataclass(frozen=True, eq=False)
class Timing:
    """Clock of a table; n rows, t touches (in the order of their first row).

    Attributes
    ----------
    time_s, held_s : (n,) arrays
        Time of each row, and since the first row of its touch that is in contact; zero before that.
    unit : str
        ``"s"``, or ``"touch"`` where the order of the rows stands for the time.
    note : str
        What was assumed; empty where the clock is good.
    """

    time_s: FloatArray
    held_s: FloatArray
    unit: str
    note: str = ""

    @classmethod
    def of(cls, touches: Touches) -> Timing:
        """The table's own clock where it is complete and runs forward, else the order of the rows."""
        _, group = groups(touches.touch)
        time = touches.time_s
        n = int(group.max()) + 1 if len(group) else 0
        first = np.full(n, np.inf)
        np.minimum.at(first, group, np.where(np.isnan(time) | ~touches.in_contact, np.inf, time))
        # A touch that is all rest has no first row in contact: its rows are held for no time.
        held = np.maximum(time - np.minimum(first[group], time), 0.0)
        if np.isfinite(time).all() and np.all(np.diff(first[np.isfinite(first)]) >= 0) and n > 0 and np.ptp(time) > 0:
            return cls(time - time.min(), held, "s")
        why = "times are missing" if np.isnan(time).any() else "times do not increase from touch to touch"
        most = max(int(touches.sample.max(initial=0)), 1)
        held = HELD_SHARE * touches.sample / most
        return cls(group + held, held, "touch", f"{why}: the order of the rows stands for time, one unit a touch.")

    def after(self, end: float, gap: float) -> Timing:
        """The same clock started at `end` + `gap`, for a table that was recorded after another."""
        return Timing(self.time_s + end + gap, self.held_s, self.unit, self.note)


def one_clock(first: Touches, second: Touches) -> tuple[Timing, Timing]:
    """Clocks of two tables that were recorded one after the other.

    Where both have good times and the second begins after the first, the clock is theirs; else the second is taken
    to begin right after the first.
    """
    one, two = Timing.of(first), Timing.of(second)
    if one.unit == two.unit == "s":
        start, end, begin = first.time_s.min(), first.time_s.max(), second.time_s.min()
        if begin >= end:
            return one, Timing(second.time_s - start, two.held_s, "s")
    elif one.unit != two.unit:
        # One good clock of two is none: both are put in order.
        one, two = (Timing.of(t.with_(time_s=np.full(t.n_rows, np.nan))) for t in (first, second))
    gap = typical_gap(one.time_s, one.held_s)
    return one, two.after(float(one.time_s.max()), gap)


def typical_gap(time_s: FloatArray, held_s: FloatArray) -> float:
    """Median time from the last row of a touch to the first row of the next; 0 where there is one touch only."""
    start = time_s - held_s
    order = np.argsort(time_s, kind="stable")
    begin, now = start[order], time_s[order]
    new = np.flatnonzero(np.diff(begin) > 0)
    return float(np.median(begin[new + 1] - now[new])) if len(new) else 0.0
