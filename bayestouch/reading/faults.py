"""Faulty sensors: search for elements, or a force sensor, that no longer read as in the calibration.

The columns of the touch table (elements and force sensor) are left out one by one, the worst first, until the others
agree with each other. Then each column is tried again among the sound ones, so that none is left out because of a
fault of another.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations
from typing import Protocol

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IndexArray, IntArray
from bayestouch.data.averages import TouchMeans
from bayestouch.reading.fault_kinds import ColumnFault, named, silent_fault
from bayestouch.reading.fault_tests import ColumnTests, SensorMisfit
from bayestouch.reading.stopped import may_be_silent, silent_at, stopped_at

#: Largest share of the elements that is left out. With more faults, the calibration does not fit the readings at all.
LARGEST_SHARE = 1 / 3
#: The noise is widened if elements deviate from the model by more than this many times what noise and calibration
#: explain. The second number applies if a fault was found.
LARGEST_MISFIT, SLIGHT_MISFIT = 2.0, 1.2
#: A touch is odd if the rms of its standardised residuals is larger. By noise alone that of one reading is so in one
#: touch of 370, and that of four readings in one of 10⁷.
ODD = 3.0
#: Number of columns that are left out on trial if a faulty element shifts the estimates of the touches.
MOST_TRIED = 8
#: An element is faulty if a reading is beyond this many times the largest peak at a typical load: no touch makes it.
#: In a fit it would outweigh all other readings: the touch would follow it, and the other elements would misfit.
ABSURD = 100.0


class FittedTouches(Protocol):
    """Touches that can be fitted without some of the columns; the last column is the force sensor."""

    @property
    def touch(self) -> IntArray:
        """Number of each touch, (t,), in the order of time where it is known."""
        ...

    @property
    def columns(self) -> FloatArray:
        """Readings of each column, (t, k)."""
        ...

    @property
    def scale(self) -> FloatArray:
        """Peak reading of each element at a typical load, then this load, (k,)."""
        ...

    @property
    def few(self) -> bool:
        """True if there are so few elements that a faulty one shifts the fitted touch, so that the others misfit."""
        ...

    def with_order(self, order: IndexArray) -> FittedTouches:
        """Same touches with the readings of the elements in another order."""
        ...

    def __call__(self, out: BoolArray) -> SensorMisfit:
        """Residuals of a fit without the columns in the mask `out` (k,)."""
        ...


@dataclass(frozen=True, eq=False)
class SensorCheck:
    """Result of the check of a sensor.

    Attributes
    ----------
    faults : tuple of ColumnFault
        Columns that are left out, elements first.
    order : (m,) int array
        Column with the readings of each element; other than 0, 1, 2 … if wires are swapped.
    excess : float
        Ratio of the misfit to what noise and calibration explain, if leaving out a few elements does not help; else 1.
    touches : int
        Number of touches in the check.
    odd : tuple of int
        Numbers of the few touches that differ from the model, see `odd_touches`; the others are as calibrated.
    """

    faults: tuple[ColumnFault, ...]
    order: IndexArray
    excess: float
    touches: int
    odd: tuple[int, ...] = ()

    @property
    def left_out(self) -> BoolArray:
        """Mask of the elements that are left out, (m,)."""
        out = np.zeros(len(self.order), dtype=bool)
        out[[fault.column for fault in self.faults if fault.column < len(out)]] = True
        return out

    @property
    def force_left_out(self) -> bool:
        """True if the force sensor is left out."""
        return any(fault.column == len(self.order) for fault in self.faults)

    def corrected(self, means: TouchMeans) -> TouchMeans:
        """Touches with swapped wires corrected, and without the readings of faulty elements."""
        order = self.order
        return self.without_faulty(replace(means, readings=means.readings[:, order], counts=means.counts[:, order]))

    def without_faulty(self, means: TouchMeans) -> TouchMeans:
        """Touches, whose wires are right, without the readings of faulty elements."""
        out = self.left_out
        return replace(means, readings=np.where(out, np.nan, means.readings), counts=np.where(out, 0, means.counts))

    @property
    def swapped(self) -> bool:
        """True if wires are swapped."""
        return bool((np.diff(self.order) != 1).any())

    @property
    def sound(self) -> bool:
        """True if no fault was found."""
        return not self.faults and self.excess == 1 and not self.swapped


def find_faults(fitted: FittedTouches) -> SensorCheck:
    """Result of a search for columns that no longer read as in the calibration.

    Parameters
    ----------
    fitted : FittedTouches
        Touches and the model of the calibrated sensor.
    """
    whole, (t, k) = fitted, fitted.columns.shape
    order = np.arange(k - 1)
    out = _columns_to_leave_out(fitted)
    if out is None:
        out = _force_sensor_alone(fitted)
    if out is None:
        # Sound elements beside swapped ones can seem silent, and are left out before these, one after the other.
        pair = _swapped_alone(fitted)
        return _check_of_whole(fitted) if pair is None else SensorCheck((), _exchanged(k - 1, pair), 1.0, t)
    while (pair := _swapped(fitted, out)) is not None:
        swap = _exchanged(k - 1, pair)
        fitted, order = fitted.with_order(swap), order[swap]
        out[list(pair)] = False
        out = _readmitted(fitted, out)  # columns that misfitted only because of the swapped wires
    misfit = fitted(out)
    faults = _named(fitted, out, misfit)
    if any(fault.column == k - 1 and fault.kind == "unlike" for fault in faults):
        # no factor corrects the force sensor: more likely each element has a fault of its own
        return _check_of_whole(fitted)
    # Next to faulty elements, the others may have small faults; without any fault, the model should fit as calibrated.
    overall, worst = _root_mean_squares(misfit)
    widen = overall > (SLIGHT_MISFIT if len(faults) else LARGEST_MISFIT)
    if widen and (pair := _swapped_alone(whole)) is not None:
        # what was left out had misfitted because of the wires
        return SensorCheck((), _exchanged(k - 1, pair), 1.0, t)
    return SensorCheck(faults, order, max(1.0, worst) if widen else 1.0, t)


def odd_touches(fitted: FittedTouches) -> BoolArray:
    """Mask (t,) of touches whose residuals are more than `ODD` times what noise and calibration explain, as rms."""
    informative, squares = _squares(fitted(np.zeros(fitted.columns.shape[1], dtype=bool)))
    return np.asarray(squares.sum(axis=1) > ODD**2 * np.maximum(informative.sum(axis=1), 1))


def _check_of_whole(fitted: FittedTouches) -> SensorCheck:
    """Check of the sensor as a whole: an order of the elements with which all agree, else the size of the misfit."""
    t, k = fitted.columns.shape
    order = np.arange(k - 1)
    excess = max(1.0, _root_mean_squares(fitted(np.zeros(k, dtype=bool)))[1])
    for other in (order[::-1], np.roll(order, 1), np.roll(order, -1)):
        turned = fitted.with_order(other)
        out = _columns_to_leave_out(turned)
        # one more element may be faulty: the one that has no wire after the shift
        if out is None or out.sum() > 1 or out[-1]:
            continue
        misfit = turned(out)
        if _root_mean_squares(misfit)[1] < 0.5 * excess:
            return SensorCheck(_named(turned, out, misfit), other, 1.0, t)
    return SensorCheck((), order, excess, t)


def _columns_to_leave_out(fitted: FittedTouches) -> BoolArray | None:
    """Columns (k,) to leave out so that the others agree; None if there are too many."""
    k = fitted.columns.shape[1]
    broken = _broken(fitted)
    out = broken.copy()
    largest = _most(k)
    if broken.sum() > largest:
        return None
    while True:
        misfit = fitted(out)
        agree = _agree(misfit, few=fitted.few)
        # An element that is silent at a few touches may pass the tests of all touches.
        doubtful = not agree or _root_mean_squares(misfit)[0] > LARGEST_MISFIT
        silent = _silent(fitted, out, misfit) if doubtful else None
        if silent is not None:
            broken[silent] = out[silent] = True
        elif not agree:
            out[_worst(fitted, out, misfit.tests)] = True
        else:
            break
        if out[:-1].sum() > largest:
            return None
    return broken | _readmitted(fitted, out) if out.sum() > 1 else out


def _force_sensor_alone(fitted: FittedTouches) -> BoolArray | None:
    """The force sensor alone (k,), if all elements agree without it; None if they do not, or if that tests nothing.

    Loads that are several times too large move the fitted touches so far that elements seem to misfit more.
    """
    out = np.arange(fitted.columns.shape[1]) == fitted.columns.shape[1] - 1
    misfit = fitted(out)
    tested, squares = _squares(misfit)
    sound = _agree(misfit, few=fitted.few) and squares.sum() <= LARGEST_MISFIT**2 * tested.sum()
    return out if tested.any() and sound else None


def _most(k: int) -> int:
    """Largest number of elements that are left out, of k columns."""
    return max(1, int(LARGEST_SHARE * (k - 1)))


def _broken(fitted: FittedTouches) -> BoolArray:
    """Mask (k,) of elements with a reading that no touch makes, or with one that stays the same from a touch on."""
    largest = ABSURD * fitted.scale[:-1].max()
    absurd = np.append((np.abs(fitted.columns[:, :-1]) > largest).any(axis=0), False)
    return absurd | (_stopped_at(fitted) < len(fitted.columns))


def _silent(fitted: FittedTouches, out: BoolArray, misfit: SensorMisfit) -> int | None:
    """Element to leave out that reads nothing of some touches although the others say that it should; None if none.

    It comes before the tests: a silent element can move touches so far that its neighbours fail them first. For the
    same reason a sound element may seem silent beside a faulty one. So without it the others must agree better than
    without the column that the tests say.
    """
    columns, tests = fitted.columns, misfit.tests
    maybe = np.flatnonzero(may_be_silent(columns, misfit) & ~out[:-1])
    only = np.eye(len(out), dtype=bool)
    # Both take fits, which are the same for all elements: they are made for the first silent one that needs them.
    worst = cache(lambda: _worst(fitted, out, tests))
    without_worst = cache(lambda: _root_mean_squares(fitted(out | only[worst()])))
    for column in maybe[np.argsort(-tests.drop[maybe], kind="stable")][:MOST_TRIED]:
        without = fitted(out | only[column])
        if silent_at(columns[:, column], without, column)[0].any() and (
            worst() == column or _root_mean_squares(without) < without_worst()
        ):
            return int(column)
    return None


def _stopped_at(fitted: FittedTouches) -> IndexArray:
    columns = fitted.columns
    return stopped_at(columns, fitted.scale, fitted, _most(columns.shape[1]))


def _named(fitted: FittedTouches, out: BoolArray, misfit: SensorMisfit) -> tuple[ColumnFault, ...]:
    """Faults of the columns in `out`."""
    columns, stopped = fitted.columns, _stopped_at(fitted)

    def fault(column: int) -> ColumnFault:
        if stopped[column] < len(columns):
            return ColumnFault(column, "stuck", since=int(fitted.touch[stopped[column]]))
        read = columns[:, column]
        silent = None if column == columns.shape[1] - 1 else silent_fault(column, read, misfit, fitted.touch)
        return silent or named(column, read, misfit)

    return tuple(fault(int(column)) for column in np.flatnonzero(out))


def _readmitted(fitted: FittedTouches, out: BoolArray) -> BoolArray:
    """Mask (k,) of columns to leave out, without those that agree with all others when they are tried again."""
    for column in np.flatnonzero(out):
        tried = out.copy()
        tried[column] = False
        if _agree(fitted(tried), few=fitted.few):
            out = tried
    return out


def _agree(misfit: SensorMisfit, *, few: bool) -> bool:
    """Whether no fault is found in the columns that were fitted."""
    # a faulty element can shift the touches so far that its own readings cannot be tested: all others misfit
    hidden = few and _root_mean_squares(misfit)[0] > LARGEST_MISFIT
    return misfit.tests.agree and not hidden


def _worst(fitted: FittedTouches, out: BoolArray, tests: ColumnTests) -> int:
    """Column to leave out next."""
    k = len(out)
    if fitted.few:
        likely = np.argsort(np.where(out, -1.0, tests.drop))[::-1][: min(MOST_TRIED, int((~out).sum()))]
        only = np.eye(k, dtype=bool)
        return min(map(int, likely), key=lambda column: _root_mean_squares(fitted(out | only[column]))[0])
    # if elements differ but none is clearly faulty, a large fault of one may be hidden in the misfit of its neighbours
    suspects = tests.faulty if tests.faulty.any() else ~out & (np.arange(k) < k - 1)
    return int(np.where(suspects, tests.drop, -1.0).argmax())


def _swapped(fitted: FittedTouches, out: BoolArray) -> tuple[int, int] | None:
    """Two elements, one of them in `out`, that agree with all others if their readings are exchanged; None if none."""
    m = len(out) - 1
    suspects = out[:m] & ~_broken(fitted)[:m]
    if not suspects.any():
        return None
    left_out = fitted(out)
    without_information = np.isnan(left_out.tests.gain[:m]) & ~out[:m]
    # The tests do not see all misfits: with a wrong exchange the others may deviate in both directions.
    largest = SLIGHT_MISFIT * max(1.0, _root_mean_squares(left_out)[0])
    for first in np.flatnonzero(suspects):
        # the other element is faulty too, unless the touches contain no information on it
        for second in np.flatnonzero((suspects | without_information) & (np.arange(m) != first)):
            kept = out.copy()
            kept[[first, second]] = False
            misfit = fitted.with_order(_exchanged(m, (int(first), int(second))))(kept)
            tested = np.isfinite(misfit.tests.gain[first]) and np.isfinite(misfit.tests.offset[second])
            if tested and _agree(misfit, few=fitted.few) and _root_mean_squares(misfit)[0] <= largest:
                return int(first), int(second)
    return None


def _swapped_alone(fitted: FittedTouches) -> tuple[int, int] | None:
    """Two elements with which no column needs to be left out if their readings are exchanged; None if none.

    They are among the columns that misfit most while all are in.
    """
    none = np.zeros(fitted.columns.shape[1], dtype=bool)
    m = len(none) - 1
    likely = np.sort(np.argsort(fitted(none).tests.drop[:m])[::-1][:MOST_TRIED])
    for first, second in combinations(likely.tolist(), 2):
        misfit = fitted.with_order(_exchanged(m, (first, second)))(none)
        # to give an element the wire of a dead one is to leave it out
        tested = np.isfinite(misfit.tests.offset[[first, second]]).all()
        if tested and _agree(misfit, few=fitted.few) and _root_mean_squares(misfit)[0] <= SLIGHT_MISFIT:
            return first, second
    return None


def _exchanged(m: int, pair: tuple[int, int]) -> IndexArray:
    order = np.arange(m)
    order[list(pair)] = order[list(reversed(pair))]
    return order


def _squares(misfit: SensorMisfit) -> tuple[BoolArray, FloatArray]:
    """Readings of elements that can be tested, and the squares of their standardised residuals, (t, m) both."""
    informative = (misfit.information > 0)[:, :-1]
    score, information = misfit.score[:, :-1], misfit.information[:, :-1]
    return informative, np.where(informative, score**2 / np.where(informative, information, 1.0), 0.0)


def _root_mean_squares(misfit: SensorMisfit) -> tuple[float, float]:
    """Root mean squares of the standardised residuals: of all elements together, and of the worst element."""
    informative, squares = _squares(misfit)
    worst = squares.sum(axis=0) / np.maximum(informative.sum(axis=0), 1)
    return float(np.sqrt(squares.sum() / max(int(informative.sum()), 1))), float(np.sqrt(worst.max()))
