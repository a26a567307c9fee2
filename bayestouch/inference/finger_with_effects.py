"""Touches on a finger whose calibration has effects, which may depend on what was before a touch."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bayestouch.affected.described import AffectedChain
from bayestouch.chain.finger import FingerChain
from bayestouch.inference.after_check import looked_at_again, widened
from bayestouch.inference.fault_notes import fault_notes
from bayestouch.inference.faults import SensorCheck
from bayestouch.inference.finger_affected import observe, prepare
from bayestouch.inference.finger_check import check_finger, corrected_means
from bayestouch.inference.finger_reader import IndenterPriors, TouchReadings
from bayestouch.inference.finger_rows import FingerTouches, readings_of
from bayestouch.inference.options import Options
from bayestouch.inference.reading_table import ReadingTable
from bayestouch.noise import Noise
from bayestouch.results import Calibration
from bayestouch.touches import Touches

FloatArray = NDArray[np.float64]


def affected_touches(
    corrected: Touches,
    calibration: Calibration,
    options: Options,
    affected: AffectedChain,
    chain: FingerChain,
    table: ReadingTable,
    covariance: Callable[[FloatArray, FloatArray, FloatArray], FloatArray],
    priors: IndenterPriors,
) -> tuple[FingerTouches, Noise, SensorCheck | None, tuple[str, ...]]:
    """Touches of a whole table with the effects of each touch's own time, after the check of the sensor.

    Parameters
    ----------
    corrected : Touches
        The table, rest reading subtracted.
    calibration, options, affected
        What reads them.
    chain, table, covariance, priors
        Made of the calibration.

    Returns
    -------
    FingerTouches, Noise, SensorCheck or None, tuple of str
        The touches, the noise to read them with, what the check found, and notes.
    """
    observed, note = observe(corrected, affected, calibration.noise, options.each_sample)
    means, noise, check = observed.means, calibration.noise, None
    notes = (note,) if note else ()

    def with_effects(plain: TouchReadings) -> TouchReadings:
        return prepare(plain, observed, affected, chain, table, priors, noise, plug_in=options.plug_in)

    prepared = with_effects(readings_of(means, calibration, options.use_load))
    if not options.check_sensor:
        return FingerTouches(means, prepared), noise, check, notes
    typical = float(calibration.settings["typical_load"])

    def check_of(readings: TouchReadings) -> SensorCheck:
        return check_finger(readings, chain, table, noise, covariance, typical)

    def again(first: SensorCheck) -> SensorCheck:
        return check_of(with_effects(readings_of(corrected_means(means, first), calibration, options.use_load)))

    check = check_of(prepared)
    if affected.listed.drifts:
        check = looked_at_again(check, again)
    if not check.sound:
        means, noise = corrected_means(means, check), widened(noise, check.excess)
        prepared = with_effects(readings_of(means, calibration, options.use_load and not check.force_left_out))
    return FingerTouches(means, prepared), noise, check, (*notes, *fault_notes(check, "N/m"))
