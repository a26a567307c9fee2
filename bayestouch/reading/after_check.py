"""What follows from a check of the sensor, for fingers and pads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from bayestouch.chain.noise import Noise
from bayestouch.reading.faults import SensorCheck


def looked_at_again(check: SensorCheck, again: Callable[[SensorCheck], SensorCheck]) -> SensorCheck:
    """A check where drifts are found from the very readings that are checked: a drift follows a faulty element.

    Parameters
    ----------
    check : SensorCheck
        Of all readings.
    again : callable
        Check of the readings without the faulty elements of the one it is given, and with wires put right.
    """
    m = len(check.order)
    elements = replace(check, faults=tuple(fault for fault in check.faults if fault.column < m), excess=1.0)
    if elements.sound:
        return check
    second = again(elements)
    faults = sorted((*elements.faults, *second.faults), key=lambda fault: fault.column)
    return replace(second, faults=tuple(faults), order=elements.order[second.order])


def widened(noise: Noise, excess: float) -> Noise:
    """Noise that covers what the readings miss the model by."""
    if excess == 1:
        return noise
    return replace(noise, tactile_sd=noise.tactile_sd * excess, discrepancy_sd=noise.discrepancy_sd * excess)
