"""Rows of a touch table as touches on a finger that are to be read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.data.averages import TouchMeans
from bayestouch.data.baseline import Baseline
from bayestouch.data.survey import Survey
from bayestouch.data.touches import Touches
from bayestouch.finger.reading.check import corrected_means
from bayestouch.finger.reading.reader import TouchReadings
from bayestouch.reading.faults import SensorCheck
from bayestouch.reading.options import Options
from bayestouch.results.objects import Calibration


@dataclass(frozen=True, eq=False)
class FingerTouches:
    """A block of touches: averaged, and the same as the posterior wants them."""

    means: TouchMeans
    readings: TouchReadings

    @property
    def n_touches(self) -> int:
        """How many touches."""
        return self.means.n_touches

    def select(self, index: NDArray[np.int64]) -> FingerTouches:
        """Some of the touches."""
        return FingerTouches(self.means.select(index), self.readings.select(index))

    @classmethod
    def joined(cls, parts: Sequence[FingerTouches]) -> FingerTouches:
        """All touches of several blocks that no effects act on."""
        if len(parts) == 1:
            return parts[0]
        return cls(TouchMeans.joined([part.means for part in parts]), _joined([part.readings for part in parts]))


@dataclass(frozen=True, eq=False)
class Intake:
    """How samples become touches to be read, where no effects act on them."""

    calibration: Calibration
    baseline: Baseline
    options: Options
    check: SensorCheck | None = None

    def __call__(self, piece: Touches) -> FingerTouches:
        """Touches of a piece of the table that holds them whole."""
        corrected = self.baseline.subtracted(piece)
        means = rows_as_touches(corrected) if self.options.each_sample else corrected.averaged()
        use_load = self.options.use_load
        if self.check is not None:
            means, use_load = corrected_means(means, self.check), use_load and not self.check.force_left_out
        return FingerTouches(means, readings_of(means, self.calibration, use_load))


def readings_of(means: TouchMeans, calibration: Calibration, use_load: bool) -> TouchReadings:
    """What is read of touches, with or without the force sensor."""
    force_sd = calibration.noise.force_sd
    counts = np.where(np.isnan(means.readings), 0, means.counts)
    load = means.load if use_load else np.full(means.n_touches, np.nan)
    reads = np.maximum(counts.max(axis=1), 1)
    return TouchReadings(means.readings, counts, load, force_sd / np.sqrt(reads))


def load_notes(found: Survey, options: Options) -> tuple[str, ...]:
    """How many touches are read without a load although loads are used."""
    missing = found.rows_without_load if options.each_sample else found.touches_without_load
    if not options.use_load or not missing:
        return ()
    return (f"{missing} touches have no measured load: their load is inferred from the elements.",)


def rows_as_touches(touches: Touches) -> TouchMeans:
    """Every row in contact as a touch of its own, under the touch's number."""
    contact = touches.select(touches.in_contact)
    means = contact.with_(touch=np.arange(contact.n_rows), sample=np.zeros(contact.n_rows, dtype=np.int64)).averaged()
    return replace(means, touch=contact.touch)


def _joined(parts: Sequence[TouchReadings]) -> TouchReadings:
    """Readings of several blocks one after the other."""
    names = ("readings", "counts", "load", "load_sd")
    columns: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return replace(parts[0], **columns)
