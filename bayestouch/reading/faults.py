"""Faulty sensors: which element, or the force sensor, no longer reads as it was calibrated, and going on without it.

The columns of the touch table (elements and force sensor) are left out one by one, the worst first, until what is
left agrees with itself; then each is tried again among the sound ones, so that no column pays for another's fault.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IndexArray
from bayestouch.data.averages import TouchMeans
from bayestouch.reading.fault_kinds import ColumnFault, named
from bayestouch.reading.fault_tests import ColumnTests, SensorMisfit, tested

#: No more than this share of the elements is left out; beyond it the readings as a whole do not fit the calibration.
LARGEST_SHARE = 1 / 3
#: Elements that miss the model by more than this many times what noise and calibration explain widen the noise: the
#: second where something was found to be at fault.
LARGEST_MISFIT, SLIGHT_MISFIT = 2.0, 1.2
#: Columns that are left out on trial, where a faulty element moves the touches themselves.
MOST_TRIED = 8


class FittedTouches(Protocol):
    """Touches that can be fitted without some of the columns, the last of which is the force sensor."""

    @property
    def columns(self) -> FloatArray:
        """What each column read, (t, k)."""
        ...

    @property
    def few(self) -> bool:
        """Whether elements are so few that a faulty one takes the touches to another place, where others misfit."""
        ...

    def with_order(self, order: IndexArray) -> FittedTouches:
        """The same touches with the readings of the elements in another order."""
        ...

    def __call__(self, out: BoolArray) -> SensorMisfit:
        """Fit without the columns `out`, a mask (k,)."""
        ...


@dataclass(frozen=True, eq=False)
class SensorCheck:
    """What the readings of many touches say of the sensor.

    Attributes
    ----------
    faults : tuple of ColumnFault
        Columns to go on without, elements first.
    order : (m,) int array
        Column that holds the readings of each element: not 0, 1, 2 … where wires are swapped.
    excess : float
        How many times noise and calibration the readings miss the model by, where no few elements explain it; else 1.
    touches : int
        Touches looked at.
    """

    faults: tuple[ColumnFault, ...]
    order: IndexArray
    excess: float
    touches: int

    @property
    def left_out(self) -> BoolArray:
        """Elements to go on without, (m,)."""
        out = np.zeros(len(self.order), dtype=bool)
        out[[fault.column for fault in self.faults if fault.column < len(out)]] = True
        return out

    @property
    def force_left_out(self) -> bool:
        """Whether to go on without the force sensor."""
        return any(fault.column == len(self.order) for fault in self.faults)

    def corrected(self, means: TouchMeans) -> TouchMeans:
        """Touches with swapped wires put right, and without readings of faulty elements."""
        readings, counts, out = means.readings[:, self.order], means.counts[:, self.order], self.left_out
        return replace(means, readings=np.where(out, np.nan, readings), counts=np.where(out, 0, counts))

    @property
    def sound(self) -> bool:
        """Whether nothing was found."""
        return not self.faults and self.excess == 1 and bool(np.all(np.diff(self.order) == 1))


def find_faults(fitted: FittedTouches) -> SensorCheck:
    """Look for columns that no longer read as calibrated.

    Parameters
    ----------
    fitted : FittedTouches
        Touches with the model of the calibrated sensor.
    """
    t, k = fitted.columns.shape
    order = np.arange(k - 1)
    out = _without(fitted)
    if out is None:
        return _as_a_whole(fitted)
    while (pair := _swapped(fitted, out)) is not None:
        swap = _exchanged(k - 1, pair)
        fitted, order = fitted.with_order(swap), order[swap]
        out[list(pair)] = False
        out = _readmitted(fitted, out)  # what paid for the wires
    misfit, columns = fitted(out), fitted.columns
    faults = tuple(named(int(column), columns[:, column], misfit) for column in np.flatnonzero(out))
    if any(fault.column == k - 1 and fault.kind == "unlike" for fault in faults):
        # no factor puts the force sensor right: more likely it is the elements, each in its own way
        return _as_a_whole(fitted)
    # Where some elements are at fault the others may be a little; where none is, the model is what it was calibrated.
    overall, worst = _root_mean_squares(misfit)
    widen = overall > (SLIGHT_MISFIT if len(faults) else LARGEST_MISFIT)
    return SensorCheck(faults, order, max(1.0, worst) if widen else 1.0, t)


def _as_a_whole(fitted: FittedTouches) -> SensorCheck:
    """Another order of the elements that makes everything agree, or else how much there is to be explained."""
    t, k = fitted.columns.shape
    order = np.arange(k - 1)
    excess = max(1.0, _root_mean_squares(fitted(np.zeros(k, dtype=bool)))[1])
    for other in (order[::-1], np.roll(order, 1), np.roll(order, -1)):
        turned = fitted.with_order(other)
        out = _without(turned)
        # one element more may be at fault: that whose wire was left over by the shift
        if out is None or out.sum() > 1 or out[-1]:
            continue
        misfit = turned(out)
        if _root_mean_squares(misfit)[1] < 0.5 * excess:
            columns = np.flatnonzero(out)
            faults = tuple(named(int(column), turned.columns[:, column], misfit) for column in columns)
            return SensorCheck(faults, other, 1.0, t)
    return SensorCheck((), order, excess, t)


def _without(fitted: FittedTouches) -> BoolArray | None:
    """Columns (k,) to leave out so that the others agree; None where they are too many."""
    k = fitted.columns.shape[1]
    out = np.zeros(k, dtype=bool)
    largest = max(1, int(LARGEST_SHARE * (k - 1)))
    while (tests := _trouble(fitted, out)) is not None:
        out[_worst(fitted, out, tests)] = True
        if out[:-1].sum() > largest:
            return None
    return _readmitted(fitted, out) if out.sum() > 1 else out


def _readmitted(fitted: FittedTouches, out: BoolArray) -> BoolArray:
    """Columns (k,) to leave out, without those that agree with all others after all."""
    for column in np.flatnonzero(out):
        tried = out.copy()
        tried[column] = False
        if _trouble(fitted, tried) is None:
            out = tried
    return out


def _trouble(fitted: FittedTouches, out: BoolArray) -> ColumnTests | None:
    """Tests of the columns that are not `out`; None where nothing is wrong with them."""
    misfit = fitted(out)
    tests = tested(misfit)
    # where a faulty element takes touches away from itself, nothing is left of it to be tested: all others misfit
    hidden = fitted.few and _root_mean_squares(misfit)[0] > LARGEST_MISFIT
    return None if tests.agree and not hidden else tests


def _worst(fitted: FittedTouches, out: BoolArray, tests: ColumnTests) -> int:
    """The column to leave out next."""
    k = len(out)
    if fitted.few:
        likely = np.argsort(np.where(out, -1.0, tests.drop))[::-1][: min(MOST_TRIED, int((~out).sum()))]
        only = np.eye(k, dtype=bool)
        return min(map(int, likely), key=lambda column: _root_mean_squares(fitted(out | only[column]))[0])
    # where elements differ but none stands out, a large fault of one may hide in what it does to its neighbours
    suspects = tests.faulty if tests.faulty.any() else ~out & (np.arange(k) < k - 1)
    return int(np.where(suspects, tests.drop, -1.0).argmax())


def _swapped(fitted: FittedTouches, out: BoolArray) -> tuple[int, int] | None:
    """Two elements, one of them in `out`, that agree with all others when their readings are exchanged."""
    m = len(out) - 1
    if not out[:m].any():
        return None
    untold = np.isnan(tested(fitted(out)).gain[:m])
    for first in np.flatnonzero(out[:m]):
        # the partner is at fault too, unless nothing is asked of it where the touches are
        for second in np.flatnonzero((out[:m] | untold) & (np.arange(m) != first)):
            kept = out.copy()
            kept[[first, second]] = False
            exchanged = fitted.with_order(_exchanged(m, (int(first), int(second))))
            if np.isfinite(tested(exchanged(kept)).gain[first]) and _trouble(exchanged, kept) is None:
                return int(first), int(second)
    return None


def _exchanged(m: int, pair: tuple[int, int]) -> IndexArray:
    order = np.arange(m)
    order[list(pair)] = order[list(reversed(pair))]
    return order


def _root_mean_squares(misfit: SensorMisfit) -> tuple[float, float]:
    """Of the standardised residuals of all elements together, and of the element that has the largest."""
    told = (misfit.information > 0)[:, :-1]
    score, information = misfit.score[:, :-1], misfit.information[:, :-1]
    squares = np.where(told, score**2 / np.where(told, information, 1.0), 0.0)
    worst = squares.sum(axis=0) / np.maximum(told.sum(axis=0), 1)
    return float(np.sqrt(squares.sum() / max(int(told.sum()), 1))), float(np.sqrt(worst.max()))
