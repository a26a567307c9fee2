"""Touches that the sensor had, and that are not in the table: when they were, and what readings they had."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray

#: Number of earlier touches whose remainders are computed, where they are in no table or not kept.
REMEMBERED = 24


@dataclass(frozen=True, eq=False)
class MissingTouches:
    """Touches that may be missing in a table; s missing touches, h in the table, n of the calibration, m elements.

    They are taken to have followed each other as the touches of the calibration did. What they may leave in a touch is
    what the touches of the calibration left in those like it, so that in a sweep they were beside the touch.

    Attributes
    ----------
    end_s, known_s : (s,), (h,) arrays
        Time of the last sample of each missing touch, and of each touch of the table.
    calibrated : (n, m) array
        Mean readings of the touches of the calibration, in their order; zero where missing.
    """

    end_s: FloatArray
    known_s: FloatArray
    calibrated: FloatArray

    def left(
        self, read: FloatArray, when_s: FloatArray, peak: FloatArray, kept: Callable[[FloatArray], FloatArray]
    ) -> FloatArray:
        """Mean square (t, m, m) of the sum of the readings of missing touches, as far as they are kept.

        Parameters
        ----------
        read, when_s : (t, m), (t,) arrays
            Mean readings of touches (zero where missing), and their times.
        peak : (m,) array
            Size of the reading of each element.
        kept : callable
            Share (j,) of a reading that is kept after some times (j,).
        """
        end_s = np.concatenate([self.end_s, self.known_s])
        order = np.argsort(end_s, kind="stable")
        end_s, missing = end_s[order], order < len(self.end_s)
        n, m = self.calibrated.shape
        weight = np.where(peak > 0, 1 / np.maximum(peak, 1e-300), 0.0) ** 2
        size = np.maximum(self.calibrated**2 @ weight, 1e-100)
        out = np.zeros((len(read), m, m))
        for t, (own, when) in enumerate(zip(read, when_s, strict=True)):
            last = int(np.searchsorted(end_s, when, side="left"))
            there = max(last - REMEMBERED, 0) + np.flatnonzero(missing[max(last - REMEMBERED, 0) : last])
            if not len(there):
                continue
            # The touch that was so many touches before each of the calibration, as if that were repeated.
            before = self.calibrated[(np.arange(n)[:, None] - (last - there)) % n]
            sums = np.einsum("j,njm->nm", kept(when - end_s[there]), before)
            # Squared correlation of the readings; and as few touches may be like this one, one more that is like any.
            like = (self.calibrated @ (weight * own)) ** 2 / (size * max(float(own**2 @ weight), 1e-100)) + 1 / n
            out[t] = (sums * like[:, None]).T @ sums / like.sum()
        return out


def missing_ends(
    touch: IntArray, begin_s: FloatArray, end_s: FloatArray, pause_s: float, hold_s: float, *, before: int, timed: bool
) -> FloatArray:
    """Times at which touches that may be missing in a table ended, (s,), increasing.

    Before its first touch there may have been others. Between two touches those may be missing whose numbers are not in
    the table, if there was time for them: a long pause without missing numbers is a pause.

    Parameters
    ----------
    touch : (t,) int array
        Numbers of the touches of the table.
    begin_s, end_s : (t,) arrays
        Times of their first and last samples.
    pause_s, hold_s : float
        Usual time from the end of a touch to the beginning of the next, and of a touch.
    before : int
        Number of touches that may be missing before the first one, and largest number between two; at most
        `REMEMBERED` are looked at.
    timed : bool
        Whether the times were measured; else the numbers alone count.
    """
    before = min(before, REMEMBERED)
    order = np.argsort(begin_s, kind="stable")
    number, begin = touch[order], begin_s[order]
    rank = np.searchsorted(np.sort(touch), number)
    missing = np.abs(np.diff(number)) - np.abs(np.diff(rank))
    if timed:
        pause = begin[1:] - np.maximum.accumulate(end_s[order])[:-1]
        missing = np.clip(np.round((pause - pause_s) / (pause_s + hold_s)), 0, missing)
    counts = np.concatenate([[before], np.minimum(missing, before)]).astype(np.int64)
    ends = [ends_before(at, count, pause_s, hold_s) for at, count in zip(begin, counts, strict=True) if count]
    return np.sort(np.concatenate(ends)) if ends else np.zeros(0)


def ends_before(begin_s: float, count: int, pause_s: float, hold_s: float) -> FloatArray:
    """Times at which the last of `count` touches ended that followed each other until a touch began, increasing."""
    count = min(count, REMEMBERED)
    return np.asarray(begin_s - pause_s - (pause_s + hold_s) * np.arange(count)[::-1])
