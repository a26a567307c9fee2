"""Touches with known references for a fit with effects: means, and deviations of samples from them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.recording import History
from bayestouch.data.averages import TouchMeans, average
from bayestouch.data.grouping import groups
from bayestouch.data.sample_rows import reads_of_rows
from bayestouch.data.touches import Touches


@dataclass(frozen=True, eq=False)
class Observations:
    """Touches with samples, on one clock; t touches, n samples, m elements. All rows are in contact.

    Attributes
    ----------
    means : TouchMeans
        Means, one row per touch.
    row_touch : (n,) int array
        Row of each sample's touch in `means`.
    deviation : (n, m) array
        Sample minus mean of its touch; NaN missing.
    weight : (n,) array
        Number of raw reads in a row.
    time_s, held_s : (n,) arrays
        Time of each sample, and time since its touch began, in `unit`.
    unit : str
        Unit of the times.
    history : History
        All touches of the data set with readings, in the order of time.
    span : (float, float)
        First and last time of the data set.
    table : Touches
        The rows in contact.
    sessions : tuple of (float, float)
        First and last time of each session; drifts are independent between sessions. Empty for one session.
    as_read : Touches or None
        The rows in contact with all their readings, if wrong ones were removed from `table`; else None.
    """

    means: TouchMeans
    row_touch: IntArray
    deviation: FloatArray
    weight: FloatArray
    time_s: FloatArray
    held_s: FloatArray
    unit: str
    history: History
    span: tuple[float, float]
    table: Touches
    sessions: tuple[tuple[float, float], ...] = ()
    as_read: Touches | None = None

    @property
    def n_touches(self) -> int:
        """Number of touches."""
        return self.means.n_touches

    @property
    def load(self) -> FloatArray:
        """Load of each touch as read, (t,), N/m or N; NaN if not measured."""
        return self.means.load

    @cached_property
    def touch_time_s(self) -> FloatArray:
        """Mean time of each touch, (t,).

        It is within the times of the samples: a mean of equal times can differ from them by rounding, and would put the
        touch beside the session that it ends or begins.
        """
        first, last = np.full(self.n_touches, np.inf), np.full(self.n_touches, -np.inf)
        np.minimum.at(first, self.row_touch, self.time_s)
        np.maximum.at(last, self.row_touch, self.time_s)
        return np.clip(self.of_touches(self.time_s), first, last)

    @cached_property
    def touch_held_s(self) -> FloatArray:
        """Mean over the samples of each touch of the time since it began, (t,)."""
        return self.of_touches(self.held_s)

    def of_touches(self, values: FloatArray) -> FloatArray:
        """Mean over the samples of each touch, (t,) or (t, m), of values (n,) or of values of the elements (n, m).

        Values of an element are averaged over the samples in which it has a reading, as its readings are; where it has
        none in a touch, over all samples.
        """
        if values.ndim == 2 and self._reading_weight is not None:
            return np.asarray(self._summing @ (values * self._reading_weight))
        shape = (-1, *[1] * (values.ndim - 1))
        total = self._summing @ (values * self.weight.reshape(shape))
        weight = np.bincount(self.row_touch, weights=self.weight, minlength=self.n_touches)
        return np.asarray(total / weight.reshape(shape))

    @cached_property
    def _reading_weight(self) -> FloatArray | None:
        """Weight of each reading in the mean of its touch, (n, m); None if no element lacks part of a touch."""
        there = ~np.isnan(self.deviation)
        read = self._summing @ there
        size = np.bincount(self.row_touch, minlength=self.n_touches)[:, None]
        if not ((read > 0) & (read < size)).any():
            return None
        weight = np.where(there | (read == 0)[self.row_touch], self.weight[:, None], 0.0)
        return np.asarray(weight / (self._summing @ weight)[self.row_touch])

    @cached_property
    def _summing(self) -> Any:
        """Sparse matrix (t, n) of ones that sums rows by touch."""
        from scipy.sparse import csr_array

        rows = np.arange(len(self.row_touch))
        return csr_array((np.ones(len(rows)), (self.row_touch, rows)), shape=(self.n_touches, len(rows)))

    def with_wires(self, order: IntArray) -> Observations:
        """The same touches after earlier ones whose readings of the elements are in another order, (m,)."""
        history = replace(self.history, readings=self.history.readings[:, order])
        return replace(self, history=history)

    def without(self, wrong: NDArray[np.bool_]) -> Observations:
        """The observations without the readings marked in `wrong` (n, m)."""
        kept = self._with_table(self.table.with_(readings=np.where(wrong, np.nan, self.table.readings)))
        return replace(kept, as_read=self.table if self.as_read is None else self.as_read)

    def with_all_readings(self) -> Observations:
        """The observations with the readings that were removed as wrong."""
        return self if self.as_read is None else self._with_table(self.as_read)

    def _with_table(self, table: Touches) -> Observations:
        return Observations.of(table, self.time_s, self.held_s, self.unit, self.history, self.span, self.sessions)

    @classmethod
    def of(
        cls,
        touches: Touches,
        time_s: FloatArray,
        held_s: FloatArray,
        unit: str,
        history: History,
        span: tuple[float, float],
        sessions: tuple[tuple[float, float], ...] = (),
    ) -> Observations:
        """Observations of all touches of a table, with the time of its rows; the rest reading is already subtracted."""
        rows = np.flatnonzero(touches.in_contact)
        means = average(touches)
        _, group = groups(touches.touch[rows])
        return cls(
            means=means,
            row_touch=group,
            deviation=touches.readings[rows] - means.readings[group],
            weight=reads_of_rows(touches)[rows],
            time_s=time_s[rows],
            held_s=held_s[rows],
            unit=unit,
            history=history,
            span=span,
            table=touches.select(rows),
            sessions=sessions,
        )


def history_of(touches: Touches, time_s: FloatArray) -> History:
    """Mean reading of every touch of a table, in the order of time."""
    rows = np.flatnonzero(touches.in_contact)
    _, group = groups(touches.touch[rows])
    return History.of(group, time_s[rows], touches.readings[rows])


@dataclass(frozen=True, eq=False)
class UntimedTouches:
    """Touches without readings or times, for effects that do not depend on time.

    Attributes
    ----------
    n_touches : int
        Number of touches.
    when_s : (t,) array or float
        Time of the touches on the clock of the calibration; by default they are later than its end.
    unit, history
        As in `Observations`; there is no history.
    """

    n_touches: int
    when_s: FloatArray | float = np.inf
    unit: str = "s"
    history: History | None = None

    @property
    def load(self) -> FloatArray:
        """NaN, (t,)."""
        return np.full(self.n_touches, np.nan)

    @property
    def touch_time_s(self) -> FloatArray:
        """Time of each touch, (t,)."""
        return np.broadcast_to(np.asarray(self.when_s), (self.n_touches,))

    @property
    def touch_held_s(self) -> FloatArray:
        """Zeros, (t,)."""
        return np.zeros(self.n_touches)

    time_s, held_s = touch_time_s, touch_held_s

    @property
    def row_touch(self) -> IntArray:
        """Index of the touch of each row, (t,): one row per touch."""
        return np.arange(self.n_touches)

    def of_touches(self, values: FloatArray) -> FloatArray:
        """The same values: each touch has one row."""
        return values
