"""Recordings: the rows of touches or samples to which the effects are applied."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from bayestouch.array_types import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class History:
    """Earlier touches in the order of time, one entry per touch; h touches, m elements.

    Attributes
    ----------
    end_s : (h,) array
        Time of the last sample of the touch.
    readings : (h, m) array
        Mean reading of the touch; NaN where missing.
    missing_s : (s,) array
        Time of the last sample of each touch that may be missing in the table; increasing.
    """

    end_s: FloatArray
    readings: FloatArray
    missing_s: FloatArray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, touch: IntArray, time_s: FloatArray, readings: FloatArray) -> History:
        """Return the mean reading of every touch, in the order of time.

        Parameters
        ----------
        touch : (n,) int array
            Touch of each row, counted from 0.
        time_s : (n,) array
            Time of the row.
        readings : (n, m) array
            Readings; NaN missing.
        """
        n = int(touch.max()) + 1 if len(touch) else 0
        end = np.full(n, -np.inf)
        np.maximum.at(end, touch, time_s)
        total, count = np.zeros((n, readings.shape[1])), np.zeros((n, readings.shape[1]))
        np.add.at(total, touch, np.nan_to_num(readings))
        np.add.at(count, touch, ~np.isnan(readings))
        order = np.argsort(end, kind="stable")
        mean = np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0)
        return cls(end[order], mean[order])

    def above(self, zero: FloatArray | float) -> History:
        """The same touches with what they read above `zero`, the readings (m,) without touch."""
        return replace(self, readings=self.readings - zero)

    def leftover(self, start_s: FloatArray, fade_s: FloatArray) -> FloatArray:
        """Return the sum of the readings of the earlier touches, after decay from their end to the given times.

        A missing reading counts as zero.

        Parameters
        ----------
        start_s : (n,) array
            Start times of touches.
        fade_s : (f,) array
            Time constants: the remainder decays to 1/e in this time.

        Returns
        -------
        (f, n, m) array
        """
        rates = 1 / fade_s[:, None]
        kept = np.exp(-np.maximum(np.diff(self.end_s, prepend=self.end_s[:1]), 0.0)[:, None, None] * rates)
        running = np.repeat(np.nan_to_num(self.readings)[:, None], len(fade_s), axis=1)
        # After the step of n, an entry has the sum of the last 2n touches, and what is kept of an earlier sum.
        n = 1
        while n < len(running):
            running[n:] += running[:-n] * kept[n:]
            kept[n:] = kept[n:] * kept[:-n]
            n *= 2
        last = np.searchsorted(self.end_s, start_s, side="left") - 1
        some = last >= 0
        wait = np.where(some, start_s - self.end_s[np.maximum(last, 0)], 0.0)
        left = np.swapaxes(running[np.maximum(last, 0)], 0, 1) * np.exp(-wait * rates)[:, :, None]
        return np.asarray(np.where(some[:, None], left, 0.0))


@dataclass(frozen=True, eq=False)
class Recording:
    """Rows (touches or samples) with location, load, time and signal; n rows, m elements.

    Attributes
    ----------
    indenter_radius_mm : (n,) array
        r_c; NaN on a pad or unknown.
    place : tuple of (n,) arrays
        Location in the unit of the touch table: θ_c in degree on a finger, x and y in mm on a pad.
    load : (n,) array
        Load, N/m or N.
    time_s, held_s : (n,) arrays
        Time of the row, and time since the first sample of the touch.
    element_place : tuple of (m,) arrays
        Locations of the elements, in the unit of `place`.
    peak : (m,) array
        Size of each element's reading directly under the reference load; fractions refer to it.
    reference_load : float
        Load for which `peak` is given.
    signal : (n, m) array
        Readings after the stages applied so far; zero before the body stage.
    history : History or None
        Earlier touches.
    curvature_per_mm : (n,) array or None
        What is added to 1/R beside the radius r_c, 1/mm; None for nothing.
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
    curvature_per_mm: FloatArray | None = None

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return len(self.load)
