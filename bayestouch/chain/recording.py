"""A recording on its way through the chain: what the effects see and pass on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class History:
    """What was read before: one entry a touch, in the order of time; h touches, m elements.

    Attributes
    ----------
    start_s, end_s : (h,) arrays
        First and last sample of the touch.
    readings : (h, m) array
        Mean reading of the touch; zero where missing.
    """

    start_s: FloatArray
    end_s: FloatArray
    readings: FloatArray

    @classmethod
    def of(cls, touch: IntArray, time_s: FloatArray, readings: FloatArray) -> History:
        """Mean reading of every touch, in the order of time.

        Parameters
        ----------
        touch : (n,) int array
            Touch of each row, counted from 0.
        time_s : (n,) array
            When the row was taken.
        readings : (n, m) array
            Readings; NaN missing.
        """
        n = int(touch.max()) + 1 if len(touch) else 0
        start, end = np.full(n, np.inf), np.full(n, -np.inf)
        np.minimum.at(start, touch, time_s)
        np.maximum.at(end, touch, time_s)
        total, count = np.zeros((n, readings.shape[1])), np.zeros((n, readings.shape[1]))
        np.add.at(total, touch, np.nan_to_num(readings))
        np.add.at(count, touch, ~np.isnan(readings))
        order = np.argsort(end, kind="stable")
        mean = np.divide(total, count, out=np.zeros_like(total), where=count > 0)
        return cls(start[order], end[order], mean[order])

    def leftover(self, start_s: FloatArray, fade_s: FloatArray) -> FloatArray:
        """Sum of the earlier touches' readings, faded from their end to the start of others.

        Parameters
        ----------
        start_s : (n,) array
            Beginnings of touches.
        fade_s : (f,) array
            Times in which what is left falls to 1/e.

        Returns
        -------
        (f, n, m) array
        """
        rates = 1 / fade_s[:, None]
        kept = np.exp(-np.maximum(np.diff(self.end_s), 0.0)[:, None, None] * rates)
        running = np.empty((len(self.end_s), len(fade_s), self.readings.shape[1]))
        running[:1] = self.readings[:1, None]
        for k in range(1, len(running)):
            running[k] = running[k - 1] * kept[k - 1] + self.readings[k]
        last = np.searchsorted(self.end_s, start_s, side="left") - 1
        some = last >= 0
        wait = np.where(some, start_s - self.end_s[np.maximum(last, 0)], 0.0)
        left = np.swapaxes(running[np.maximum(last, 0)], 0, 1) * np.exp(-wait * rates)[:, :, None]
        return np.asarray(np.where(some[:, None], left, 0.0))


@dataclass(frozen=True, eq=False)
class Recording:
    """Rows (touches or samples) with what is known of each; n rows, m elements.

    Attributes
    ----------
    indenter_radius_mm : (n,) array
        r_c; NaN on a pad or unknown.
    place : tuple of (n,) arrays
        Location in the unit of the touch table: θ_c in degree on a finger, x and y in mm on a pad.
    load : (n,) array
        Load, N/m or N.
    time_s, held_s : (n,) arrays
        When taken, and how long after the first sample of the touch.
    element_place : tuple of (m,) arrays
        Places of the elements, as `place`.
    peak : (m,) array
        Size of each element's reading right under the reference load: the unit of shares.
    reference_load : float
        The load that goes with `peak`.
    signal : (n, m) array
        Readings so far; zero before the body stage.
    history : History or None
        What was read before.
    """

    indenter_radius_mm: FloatArray
    place: tuple[FloatArray, ...]
    load: FloatArray
    time_s: FloatArray
    held_s: FloatArray
    element_place: tuple[FloatArray, ...]
    peak: FloatArray
    reference_load: float
    signal: FloatArray
    history: History | None = None

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return len(self.load)
