"""Rows of a touch table as the readings of touches on a finger."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.averages import TouchMeans
from bayestouch.inference.finger_reader import TouchReadings
from bayestouch.results import Calibration
from bayestouch.touches import Touches


def readings_of(means: TouchMeans, calibration: Calibration, use_load: bool) -> tuple[TouchReadings, tuple[str, ...]]:
    """What is read of touches, with or without the force sensor; and notes."""
    notes: tuple[str, ...] = ()
    force_sd = calibration.noise.force_sd
    counts = np.where(np.isnan(means.readings), 0, means.counts)
    load = means.load if use_load else np.full(means.n_touches, np.nan)
    if use_load and np.isnan(load).any():
        notes = (
            f"{int(np.isnan(load).sum())} touches have no measured load: their load is inferred from the elements.",
        )
    reads = np.maximum(counts.max(axis=1), 1)
    return TouchReadings(means.readings, counts, load, force_sd / np.sqrt(reads)), notes


def rows_as_touches(touches: Touches) -> TouchMeans:
    """Every row in contact as a touch of its own, under the touch's number."""
    contact = touches.select(touches.in_contact)
    means = contact.with_(touch=np.arange(contact.n_rows), sample=np.zeros(contact.n_rows, dtype=np.int64)).averaged()
    return replace(means, touch=contact.touch)
