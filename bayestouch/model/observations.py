"""What a diagnosis works on: touches with known references, as means and as deviations of samples from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.recording import History
from bayestouch.data.averages import TouchMeans, average
from bayestouch.data.grouping import groups
from bayestouch.data.touches import Touches


@dataclass(frozen=True, eq=False)
class Observations:
    """Touches with samples, on one clock; t touches, n samples, m elements. All rows are in contact.

    Attributes
    ----------
    means : TouchMeans
        Means, one row a touch.
    row_touch : (n,) int array
        Place of each sample's touch among the means.
    deviation : (n, m) array
        Sample minus mean of its touch; NaN missing.
    weight : (n,) array
        Raw reads behind a row.
    time_s, held_s : (n,) arrays
        When each sample was taken, and since the touch began.
    unit : str
        Unit of the times.
    history : History
        Every touch of the data set that was read, in the order of time.
    span : (float, float)
        First and last time of the data set.
    table : Touches
        The rows in contact.
    sessions : tuple of (float, float)
        First and last time of each table: what wanders with time may have jumped in between. Empty for one table.
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

    @property
    def n_touches(self) -> int:
        """Number of touches."""
        return self.means.n_touches

    @property
    def load(self) -> FloatArray:
        """Load of each touch as read, (t,); NaN where it was not."""
        return self.means.load

    @property
    def touch_time_s(self) -> FloatArray:
        """Mean time of each touch, (t,)."""
        return self.of_touches(self.time_s)

    def of_touches(self, values: FloatArray) -> FloatArray:
        """Means over the samples of each touch of values by row, (n,) or (n, m)."""
        total = np.zeros((self.n_touches, *values.shape[1:]))
        np.add.at(total, self.row_touch, values * self.weight.reshape(-1, *[1] * (values.ndim - 1)))
        weight = np.bincount(self.row_touch, weights=self.weight, minlength=self.n_touches)
        return np.asarray(total / weight.reshape(-1, *[1] * (values.ndim - 1)))

    def without(self, wrong: NDArray[np.bool_]) -> Observations:
        """The same without some readings (n, m)."""
        table = self.table.with_(readings=np.where(wrong, np.nan, self.table.readings))
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
        """Observations of all touches of a table with the clock of its rows; readings have their rest subtracted."""
        rows = np.flatnonzero(touches.in_contact)
        means = average(touches)
        _, group = groups(touches.touch[rows])
        reads = np.ones(len(rows)) if touches.reads is None else np.nan_to_num(touches.reads, nan=1.0)[rows]
        return cls(
            means=means,
            row_touch=group,
            deviation=touches.readings[rows] - means.readings[group],
            weight=np.asarray(reads, dtype=np.float64),
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
    """Touches of which only the number counts: for effects that are the same whenever a touch is made.

    Attributes
    ----------
    n_touches : int
        Number of touches.
    """

    n_touches: int
    unit: str = "s"
    history: History | None = None

    @property
    def load(self) -> FloatArray:
        """Not known."""
        return np.full(self.n_touches, np.nan)

    @property
    def touch_time_s(self) -> FloatArray:
        """Zero."""
        return np.zeros(self.n_touches)

    time_s = held_s = touch_time_s

    @property
    def row_touch(self) -> IntArray:
        """One row a touch."""
        return np.arange(self.n_touches)

    def of_touches(self, values: FloatArray) -> FloatArray:
        """The values themselves."""
        return values
