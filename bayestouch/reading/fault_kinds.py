"""Kinds of faults of one column of a touch table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.reading.fault_tests import TOLERANCE, SensorMisfit
from bayestouch.reading.stopped import NOTHING_SHARE, silent_at

#: A gain of so many standard deviations is not by chance.
FOLLOWS = 5.0

Kind = Literal["dead", "loose", "stuck", "gain", "offset", "unlike"]


@dataclass(frozen=True)
class ColumnFault:
    """Fault of one column of a touch table.

    Attributes
    ----------
    column : int
        Number of the element from 0; the force sensor has the number of elements.
    kind : str
        ``dead`` (readings do not follow the touches), ``loose`` (they do not follow a share `value` of the touches),
        ``stuck`` (one constant value), ``gain`` (reading is `value` times the expected one), ``offset`` (reading is too
        high by `value` times the peak) or ``unlike`` (any other misfit).
    value, sd : float
        Size of the fault as `kind` defines it, and its standard deviation.
    since : int or None
        Number of the touch from which a column is stuck or dead; None if it is at all touches.
    """

    column: int
    kind: Kind
    value: float = np.nan
    sd: float = np.nan
    since: int | None = None


def named(column: int, read: FloatArray, misfit: SensorMisfit) -> ColumnFault:
    """Fault of a column, from its readings `read` and the prediction by the other columns."""
    present = np.isfinite(read)
    y, s, s_sd = read[present], misfit.signal[present, column], misfit.signal_sd[present, column]
    scale = float(misfit.scale[column])
    if len(y) > 1 and np.ptp(y) == 0:
        return ColumnFault(column, "stuck")
    # The uncertainty of the signal would bias the slope towards zero, so its variance is subtracted from the square.
    weight = 1 / (s_sd**2 + (0.02 * scale) ** 2)
    square = float((weight * (s**2 - s_sd**2)).sum())
    if square <= 0:
        return ColumnFault(column, "unlike")
    gain = float((weight * y * s).sum()) / square
    rest = y - gain * s
    sd = float(np.sqrt((weight**2 * s**2 * rest**2).sum())) / square
    # One error of the rest reading moves all readings.
    rest_sd = misfit.rest_sd_of(column)
    if rest_sd:
        sd = float(np.hypot(sd, rest_sd * (weight * s).sum() / square))
    # A little of the signal that a dead element gets from its neighbours is no gain; a load in another unit is one.
    follows = column == misfit.n_elements and abs(gain) > FOLLOWS * sd
    if abs(gain) < NOTHING_SHARE and sd < NOTHING_SHARE and not follows:
        return ColumnFault(column, "dead", gain, sd)
    # The error of the expected signal has the same gain.
    misfit_sd = float(np.sqrt(np.median(weight * rest**2))) / max(abs(gain), 1.0)
    offset = float(np.sum(weight * (y - s)) / weight.sum()) / scale
    without_offset = float(np.sqrt(np.median(weight * (y - s - offset * scale) ** 2)))
    if column < misfit.n_elements and abs(offset) > TOLERANCE and without_offset < min(1.0, 0.5 * misfit_sd):
        return ColumnFault(column, "offset", offset, float(np.hypot(0.02 / np.sqrt(len(y)), rest_sd / scale)))
    if misfit_sd < 2.0 and sd < 0.5 * abs(gain - 1):
        return ColumnFault(column, "gain", gain, sd)
    return ColumnFault(column, "unlike")


def silent_fault(column: int, read: FloatArray, misfit: SensorMisfit, touch: IntArray) -> ColumnFault | None:
    """Fault of an element that reads some touches and nothing of others; None if it has no such fault.

    Parameters
    ----------
    column : int
        Number of the element.
    read, touch : (t,) arrays
        Its readings, and the numbers of the touches, in the order of time.
    misfit : SensorMisfit
        Misfit of the touches without this element.
    """
    silent, told = silent_at(read, misfit, column)
    if not silent.any() or (silent == told).all():
        return None
    first = int(silent.argmax())
    if (silent == told)[first:].all():
        return ColumnFault(column, "dead", since=int(touch[first]))
    return ColumnFault(column, "loose", float(silent.sum() / told.sum()))
