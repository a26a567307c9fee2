"""Check of a sensor before its touches are inferred, for fingers and pads."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray, IndexArray, IntArray
from bayestouch.reading.fault_tests import FEWEST
from bayestouch.reading.faults import SensorCheck, find_faults, odd_touches
from bayestouch.reading.touch_reader import TouchReader

#: Largest number of touches in the check, evenly spread over the table. Twice as many would find only slightly smaller
#: changes of gain.
MOST = 256
#: Largest share of touches that count as odd. With more it is the sensor that has changed.
MOST_ODD = 0.2


def check_sensor(
    reader: TouchReader, touches: Any, block: Any, n_elements: int, rest_variance: FloatArray | None = None
) -> SensorCheck:
    """Faults of elements and force sensor, from the touches that are to be inferred.

    Parameters
    ----------
    reader : TouchReader
        The calibrated sensor.
    touches, block : object
        The touches as returned by `TouchReader.average` and `TouchReader.ready`. With fewer touches than `FEWEST`, no
        fault can be found.
    n_elements : int
        Number of elements of the sensor.
    rest_variance : (m,) array, optional
        Variance of the error that all touches share by the rest reading that was subtracted; it is no fault.
    """
    check = _checked(reader, touches, block, n_elements, rest_variance)
    if not reader.drifts_are_estimated:
        return check
    # A faulty element also changed the estimated drift: estimate it without that element, then check the others again.
    elements = replace(check, faults=tuple(fault for fault in check.faults if fault.column < n_elements), excess=1.0)
    if elements.sound:
        return check
    without = reader.without(elements)
    second = _checked(without, touches, without.ready(touches), n_elements, rest_variance)
    if not second.touches:
        return check
    faults = sorted((*elements.faults, *second.faults), key=lambda fault: fault.column)
    return replace(second, faults=tuple(faults), order=elements.order[second.order])


def _checked(
    reader: TouchReader, touches: Any, block: Any, n_elements: int, rest_variance: FloatArray | None
) -> SensorCheck:
    fitted = reader.fitted(touches, block, np.arange(block.n_touches))
    # Without one of its readings, a touch must still have more readings than unknowns: else every element can be left
    # out with a perfect fit of the others, and a sound one is.
    told = np.flatnonzero(np.isfinite(fitted.columns).sum(axis=1) - 1 > len(reader.parameters))
    if len(told) < FEWEST:
        return SensorCheck((), np.arange(n_elements), 1.0, 0)
    spread = np.linspace(0, len(told) - 1, min(len(told), MOST)).round().astype(np.int64)
    some = in_time(told[np.unique(spread)], touches.means.time_s)
    fitted = reader.fitted(touches, block, some, rest_variance)
    check = find_faults(fitted)
    if check.excess == 1:
        return check
    # The sensor as a whole differs from the model, or a few touches do: with a wrong load, or soon after others that
    # the table does not have.
    odd = odd_touches(fitted)
    kept = some[~odd]
    if odd.mean() > MOST_ODD or len(kept) < FEWEST:
        return check
    rest = find_faults(reader.fitted(touches, block, kept, rest_variance))
    return replace(rest, odd=tuple(map(int, fitted.touch[odd]))) if rest.sound else check


def in_time(some: IntArray, time_s: FloatArray) -> IndexArray:
    """Rows of some touches in the order of time; as they are if a touch has no time (`time_s` is that of all, (t,))."""
    time = time_s[some]
    return some[np.argsort(time, kind="stable")] if np.isfinite(time).all() else some
