"""Touches on a finger whose calibration has effects, which may depend on what was before a touch."""

from __future__ import annotations

from collections.abc import Callable

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.noise import Noise
from bayestouch.data.touches import Touches
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.reading.check import check_finger, corrected_means
from bayestouch.finger.reading.reader import IndenterPriors, TouchReadings
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.finger.reading.rows import FingerTouches, readings_of
from bayestouch.finger.reading.touches_with_effects import observe, prepare
from bayestouch.reading.after_check import looked_at_again, widened
from bayestouch.reading.fault_notes import fault_notes
from bayestouch.reading.faults import SensorCheck
from bayestouch.reading.options import Options
from bayestouch.results.objects import Calibration


def touches_with_effects(
    corrected: Touches,
    calibration: Calibration,
    options: Options,
    effects_chain: ChainWithEffects,
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
    calibration, options, effects_chain
        What reads them.
    chain, table, covariance, priors
        Made of the calibration.

    Returns
    -------
    FingerTouches, Noise, SensorCheck or None, tuple of str
        The touches, the noise to read them with, what the check found, and notes.
    """
    observed, note = observe(corrected, effects_chain, calibration.noise, options.each_sample)
    means, noise, check = observed.means, calibration.noise, None
    notes = (note,) if note else ()

    def with_effects(plain: TouchReadings) -> TouchReadings:
        return prepare(plain, observed, effects_chain, chain, table, priors, noise, plug_in=options.plug_in)

    prepared = with_effects(readings_of(means, calibration, options.use_load))
    if not options.check_sensor:
        return FingerTouches(means, prepared), noise, check, notes
    typical = float(calibration.settings["typical_load"])

    def check_of(readings: TouchReadings) -> SensorCheck:
        return check_finger(readings, chain, table, noise, covariance, typical)

    def again(first: SensorCheck) -> SensorCheck:
        return check_of(with_effects(readings_of(corrected_means(means, first), calibration, options.use_load)))

    check = check_of(prepared)
    if effects_chain.listed.drifts:
        check = looked_at_again(check, again)
    if not check.sound:
        means, noise = corrected_means(means, check), widened(noise, check.excess)
        prepared = with_effects(readings_of(means, calibration, options.use_load and not check.force_left_out))
    return FingerTouches(means, prepared), noise, check, (*notes, *fault_notes(check, "N/m"))
