"""Elements that stop reading: a wire broke, has a loose contact, or an input of the readout stopped.

Such an element reads the same from some touch on, or nothing but its noise at some of the touches.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IndexArray
from bayestouch.reading.fault_tests import FEWEST, FEWEST_SIGNALS, SIGNAL_SHARE, SensorMisfit

#: Readings are the same if they differ by less than this share of the peak: means of equal samples are rounded.
SAME = 1e-9
#: An element reads nothing if its readings follow the touches by less than this share of the expected amount.
NOTHING_SHARE = 0.15


def same_since(columns: FloatArray, scale: FloatArray) -> IndexArray:
    """First touch from which each column (t, k) reads the same as at the last touch, (k,); missing readings differ."""
    with np.errstate(invalid="ignore"):
        differ = ~(np.abs(columns - columns[-1]) <= SAME * scale)
    t = len(columns)
    return np.where(differ.any(axis=0), t - differ[::-1].argmax(axis=0), 0)


def stopped_at(
    columns: FloatArray, scale: FloatArray, fitted: Callable[[BoolArray], SensorMisfit], most: int
) -> IndexArray:
    """Touch from which each element reads the same although the touches differ, (k,); t for all other columns.

    The other elements must say of some of these touches that the element reads something else, far beyond noise and
    model errors. An element that reads the same at all touches is no matter of this function.

    Parameters
    ----------
    columns : (t, k) array
        Readings of the elements, in the order of the touches, then of the force sensor.
    scale : (k,) array
        Peak readings.
    fitted : callable
        Misfit of the touches without the columns of a mask.
    most : int
        Largest number of such elements. If there are more, the last touches of the table are copies of one.
    """
    t, k = columns.shape
    first = same_since(columns, scale)
    long = (first > 0) & (t - first >= FEWEST) & (np.arange(k) < k - 1)
    if not 0 < long.sum() <= most:
        return np.full(k, t)
    misfit = fitted(long)
    apart = np.abs(columns - misfit.signal) - 2 * misfit.signal_sd > SIGNAL_SHARE * scale
    later = np.arange(t)[:, None] >= first
    return np.where(long & ((apart & later).sum(axis=0) >= FEWEST_SIGNALS), first, t)


def silent_at(read: FloatArray, misfit: SensorMisfit, column: int) -> tuple[BoolArray, BoolArray]:
    """Touches (t,) of which an element reads nothing although it should, and those that it should read.

    It should read a touch if the other elements say, far beyond their uncertainty, that it reads more than
    `SIGNAL_SHARE` of its peak. It reads nothing of those at which it is nearer to zero than to what it should read, if
    it follows these by less than `NOTHING_SHARE`. Fewer than `FEWEST_SIGNALS` may be odd touches, and count as none.

    Parameters
    ----------
    read : (t,) array
        Readings of the element.
    misfit : SensorMisfit
        Misfit of the touches without this element.
    column : int
        Number of the element.
    """
    signal, sd = misfit.signal[:, column], misfit.signal_sd[:, column]
    told = np.isfinite(read) & (np.abs(signal) - 2 * sd > SIGNAL_SHARE * misfit.scale[column])
    silent = told & (np.abs(read) < 0.5 * np.abs(signal))
    follows = abs(float((read[silent] * signal[silent]).sum())) >= NOTHING_SHARE * float((signal[silent] ** 2).sum())
    if follows or silent.sum() < FEWEST_SIGNALS:
        silent = np.zeros_like(told)
    return silent, told


def may_be_silent(columns: FloatArray, misfit: SensorMisfit) -> BoolArray:
    """Elements (m,) that may be silent, by what the other elements say to first order while all are fitted.

    `columns` (t, k) are the readings of elements and force sensor. What is said is rough: the silent element has moved
    the touches.
    """
    read, (beside, variance) = columns[:, :-1], misfit.expected
    expected = np.where(np.isfinite(variance), read - beside, 0.0)
    with np.errstate(invalid="ignore"):
        silent = (np.abs(expected) > SIGNAL_SHARE * misfit.scale[:-1]) & (np.abs(read) < 0.5 * np.abs(expected))
    return np.asarray(silent.sum(axis=0) >= FEWEST_SIGNALS)
