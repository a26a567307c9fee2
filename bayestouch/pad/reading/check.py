"""The check of a pad's elements and force sensor before its touches are read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.data.averages import TouchMeans
from bayestouch.pad.reading.lattice import lattice_for
from bayestouch.pad.reading.misfit import PadMisfit
from bayestouch.pad.reading.reader import PadReader
from bayestouch.reading.fault_tests import FEWEST
from bayestouch.reading.faults import SensorCheck, find_faults

#: Touches looked at, evenly spread over the table.
MOST = 256


def check_pad(readings: TouchMeans, reader: PadReader) -> SensorCheck:
    """Check elements and force sensor on touches that are to be read.

    Parameters
    ----------
    readings : TouchMeans
        The touches; fewer than `FEWEST` tell nothing.
    reader : PadReader
        The calibrated pad.
    """
    t, m = readings.readings.shape
    if t < FEWEST or m < 3:
        return SensorCheck((), np.arange(m), 1.0, 0)
    some = np.unique(np.linspace(0, t - 1, min(t, MOST)).round().astype(np.int64))
    return find_faults(PadMisfit(reader, lattice_for(reader), readings.select(some)))


def corrected_readings(readings: TouchMeans, check: SensorCheck) -> TouchMeans:
    """Touches with swapped wires put right and readings of faulty elements, or of the force sensor, missing."""
    order, out = check.order, check.left_out
    return replace(
        readings,
        readings=np.where(out, np.nan, readings.readings[:, order]),
        counts=np.where(out, 0, readings.counts[:, order]),
        load=np.full(readings.n_touches, np.nan) if check.force_left_out else readings.load,
    )
