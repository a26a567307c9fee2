"""Elements that read the same from some touch on: a wire broke, or an input of the readout stopped."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IndexArray
from bayestouch.reading.fault_tests import FEWEST, FEWEST_SIGNALS, SIGNAL_SHARE, SensorMisfit

#: Readings are the same if they differ by less than this share of the peak: means of equal samples are rounded.
SAME = 1e-9


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
