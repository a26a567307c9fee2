"""Touches that may be missing in a table, for effects that remember earlier touches."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.missing import MissingTouches, missing_ends
from bayestouch.data.grouping import beginnings, groups
from bayestouch.data.touches import Touches
from bayestouch.effects import Effect, Setting, Values
from bayestouch.model.timing import Timing


def missing_in(
    table: Touches, timing: Timing, effects: Iterable[Effect], setting: Setting, n_calibrated: int
) -> FloatArray:
    """Times at which touches that may be missing in a table ended, (s,); none if no effect remembers touches.

    Before the first touch there may have been as many as in the calibration, `n_calibrated`.
    """
    if not any(effect.remembers for effect in effects):
        return np.zeros(0)
    timed = timing.unit == "s"
    return missing_ends(*holds(table, timing), setting.gap_s, setting.hold_s, before=n_calibrated, timed=timed)


def holds(table: Touches, timing: Timing) -> tuple[IntArray, FloatArray, FloatArray]:
    """Number of each touch of a table, and the times of its first and last samples in contact, (t,) each."""
    rows = np.flatnonzero(table.in_contact)
    number, group = groups(table.touch[rows])
    time_s, pressed = timing.time_s[rows], np.ones(len(rows), dtype=bool)
    begin_s, end_s = (sign * beginnings(sign * time_s, pressed, group, len(number)) for sign in (1, -1))
    return number, begin_s, end_s


def left_by_missing(
    effects: Iterable[tuple[Effect, Values]],
    calibrated: FloatArray,
    peak: FloatArray,
    read: FloatArray,
    when_s: FloatArray,
    missing_s: FloatArray,
    known_s: FloatArray,
) -> FloatArray:
    """Mean square (t, m, m) of what touches that may be missing leave in the readings of others.

    Parameters
    ----------
    effects : iterable of (Effect, values)
        Effects of the calibration with their values.
    calibrated : (n, m) array
        Mean readings of the touches of the calibration, in their order; zero where missing.
    peak : (m,) array
        As in `bayestouch.chain.recording.Recording`.
    read, when_s : (t, m), (t,) arrays
        Mean readings of the touches that are read (NaN missing), and their times.
    missing_s, known_s : (s,), (h,) arrays
        Times at which touches ended that may be missing, and the known ones.
    """
    total = np.zeros((*read.shape, read.shape[1]))
    if len(missing_s):
        missing = MissingTouches(missing_s, known_s, calibrated)
        for effect, values in effects:
            if effect.remembers:
                total += effect.left_by_missing(values, read, when_s, missing, peak)
    return total
