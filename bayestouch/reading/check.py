"""The check of a sensor before its touches are read, for fingers and pads."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from bayestouch.chain.noise import Noise
from bayestouch.reading.fault_tests import FEWEST
from bayestouch.reading.faults import SensorCheck, find_faults
from bayestouch.reading.touch_reader import TouchReader

#: Touches looked at, evenly spread over the table: twice as many would find changes of gain only a little smaller.
MOST = 256


def check_sensor(reader: TouchReader, touches: Any, block: Any, n_elements: int) -> SensorCheck:
    """Check elements and force sensor on touches that are to be read.

    Parameters
    ----------
    reader : TouchReader
        The calibrated sensor.
    touches, block : object
        The touches as `TouchReader.average` and `TouchReader.ready` give them. Fewer than `FEWEST` tell nothing.
    n_elements : int
        Elements of the sensor; of fewer than three none can be told from the others.
    """
    check = _look(reader, block, n_elements)
    if not reader.drifts_are_estimated:
        return check
    # The drift followed a faulty element: without that element it is estimated again, and the others are checked again.
    elements = replace(check, faults=tuple(fault for fault in check.faults if fault.column < n_elements), excess=1.0)
    if elements.sound:
        return check
    without = reader.without(elements)
    second = _look(without, without.ready(touches), n_elements)
    faults = sorted((*elements.faults, *second.faults), key=lambda fault: fault.column)
    return replace(second, faults=tuple(faults), order=elements.order[second.order])


def _look(reader: TouchReader, block: Any, n_elements: int) -> SensorCheck:
    t = block.n_touches
    if t < FEWEST or n_elements < 3:
        return SensorCheck((), np.arange(n_elements), 1.0, 0)
    some = np.unique(np.linspace(0, t - 1, min(t, MOST)).round().astype(np.int64))
    return find_faults(reader.fitted(block.select(some)))


def widened(noise: Noise, excess: float) -> Noise:
    """Noise that covers what the readings miss the model by."""
    if excess == 1:
        return noise
    return replace(noise, tactile_sd=noise.tactile_sd * excess, discrepancy_sd=noise.discrepancy_sd * excess)
