"""Check of the calibrations from which priors are learned: the same build as the next finger, and different touches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.sensor import Sensor, finger_of
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.results.keys import LIKE
from bayestouch.results.objects import Calibration

# Smallest number of draws of an earlier calibration, for each of the m + 2 coordinates whose covariance is needed.
LEAST_DRAWS = 5
# Share of the largest reading by which equal readings differ after other rest readings were subtracted: far above the
# rounding of doubles, far below any noise.
ROUNDING = 1e-9


def check_other_touches(earlier: Sequence[tuple[str, Calibration]], table: Touches) -> None:
    """Raise an error if one of the calibrations was made from the touches of the next finger.

    Raises
    ------
    InputError
        Its touches would count twice.
    """
    means = table.baseline_corrected().averaged()
    for name, calibration in earlier:
        if _same(calibration.rows.touch, calibration.rows.observed, means.touch, means.readings):
            raise InputError(f"like: {name} was made from the touches that are calibrated now; they would count twice")


def check_same_build(earlier: Sequence[tuple[str, Calibration]], sensor: Sensor, contact: str) -> None:
    """Raise an error if priors cannot be learned from one of the calibrations.

    Raises
    ------
    InputError
        For the reasons that `bayestouch.finger.learned_priors.learned_priors` gives.
    """
    for i, (name, calibration) in enumerate(earlier):
        _check(name, calibration, sensor, contact)
        rows = calibration.rows
        for other, before in earlier[:i]:
            if _same(rows.touch, rows.observed, before.rows.touch, before.rows.observed):
                raise InputError(f"like: {name} and {other} are the same calibration; its touches would count twice")


def _check(name: str, calibration: Calibration, sensor: Sensor, contact: str) -> None:
    """Raise `InputError` if priors of this sensor cannot be learned from a calibration."""
    if calibration.sensor.body.kind != sensor.body.kind:
        raise InputError(f"like: {name} is of a {calibration.sensor.body.kind}, this sensor is a {sensor.body.kind}")
    theirs, ours = finger_of(calibration.sensor), finger_of(sensor)
    if theirs.n_elements != ours.n_elements:
        raise InputError(f"like: {name} has {theirs.n_elements} elements, this finger {ours.n_elements}")
    for what in ("core_radius_mm", "outer_radius_mm", "sensing_radius_mm"):
        if getattr(theirs, what) != getattr(ours, what):
            raise InputError(
                f"like: {name} is of another build: {what} is {getattr(theirs, what):g}, here {getattr(ours, what):g}"
            )
    if not np.allclose(theirs.element_angles_deg, ours.element_angles_deg):
        raise InputError(f"like: {name} is of another build: the angles of its elements are others")
    if calibration.sensor.reading_unit != sensor.reading_unit:
        raise InputError(
            f"like: {name} has readings in {calibration.sensor.reading_unit}, this finger in {sensor.reading_unit}"
        )
    draws = calibration.posterior["sigma"].size
    if draws < (needed := LEAST_DRAWS * (ours.n_elements + 2)):
        raise InputError(f"like: {name} has {draws} draws; expected {needed} or more for their covariance")
    used = str(calibration.settings["contact"])
    if used != contact:
        raise InputError(f"like: {name} has contact model {used!r}, this calibration {contact!r}")
    if calibration.settings.get(LIKE):
        raise InputError(
            f"like: {name} was itself calibrated with like; its posterior has what earlier fingers say, which would "
            "count twice: calibrate it without like"
        )


def _same(touch: IntArray, readings: FloatArray, others: IntArray, their_readings: FloatArray) -> bool:
    """Whether the touches whose numbers two tables have in common are the same.

    Their mean readings (t, m) are equal but for a constant of each element: an estimate of the rest reading.
    """
    if readings.shape[1] != their_readings.shape[1]:
        return False
    _, here, there = np.intersect1d(touch, others, return_indices=True)
    apart = readings[here] - their_readings[there]
    both = np.isfinite(apart)
    apart, both = apart[:, both.sum(axis=0) > 1], both[:, both.sum(axis=0) > 1]
    if not apart.size:
        return False
    spread = np.max(apart, axis=0, initial=-np.inf, where=both) - np.min(apart, axis=0, initial=np.inf, where=both)
    return bool((spread <= ROUNDING * np.nanmax(np.abs(readings))).all())
