"""The check of a finger's elements and force sensor before its touches are read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.data.averages import TouchMeans
from bayestouch.finger.reading.misfit import FingerMisfit
from bayestouch.finger.reading.reader import CalibratedFinger, IndenterPriors, TouchReadings
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.reading.fault_tests import FEWEST
from bayestouch.reading.faults import SensorCheck, find_faults

#: Touches looked at, evenly spread over the table: twice as many would find changes of gain only a little smaller.
MOST = 256


def check_finger(
    readings: TouchReadings,
    chain: CalibratedFinger,
    table: ReadingTable,
    noise: Noise,
    reading_covariance: Callable[[FloatArray, FloatArray, FloatArray], FloatArray],
    typical_load: float,
) -> SensorCheck:
    """Check elements and force sensor on touches that are to be read.

    Parameters
    ----------
    readings : TouchReadings
        The touches; fewer than `FEWEST` tell nothing.
    chain, table, noise, reading_covariance
        The calibrated finger, as for `DrawTask`; where readings have effects, their context knows the covariance.
    typical_load : float
        N/m.
    """
    t, m = readings.readings.shape
    if t < FEWEST or m < 3:
        return SensorCheck((), np.arange(m), 1.0, 0)
    some = np.unique(np.linspace(0, t - 1, min(t, MOST)).round().astype(np.int64))
    priors = IndenterPriors.of(chain, typical_load)
    looked_at = readings.select(some)
    covariance = reading_covariance if looked_at.context is None else looked_at.context.covariance
    return find_faults(FingerMisfit(chain, table, priors, noise, covariance, looked_at, typical_load))


def corrected_means(means: TouchMeans, check: SensorCheck) -> TouchMeans:
    """Touches with swapped wires put right and readings of faulty elements missing."""
    readings, counts = means.readings[:, check.order], means.counts[:, check.order]
    out = check.left_out
    return replace(means, readings=np.where(out, np.nan, readings), counts=np.where(out, 0, counts))
