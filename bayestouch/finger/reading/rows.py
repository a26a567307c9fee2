"""Mean readings of touches on a finger, from the rows of a touch table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bayestouch.array_types import IntArray
from bayestouch.data.averages import TouchMeans
from bayestouch.data.touches import Touches
from bayestouch.finger.reading.reader import TouchReadings


@dataclass(frozen=True, eq=False)
class FingerTouches:
    """A block of touches: `means` has the averages, `readings` has them in the form used by `FingerPosterior`."""

    means: TouchMeans
    readings: TouchReadings

    @property
    def n_touches(self) -> int:
        """Number of touches."""
        return self.means.n_touches

    def select(self, index: IntArray) -> FingerTouches:
        """Some of the touches."""
        return FingerTouches(self.means.select(index), self.readings.select(index))

    @classmethod
    def joined(cls, parts: Sequence[FingerTouches]) -> FingerTouches:
        """All touches of several blocks."""
        if len(parts) == 1:
            return parts[0]
        readings = _joined([part.readings for part in parts])
        contexts = [part.readings.context for part in parts if part.readings.context is not None]
        if contexts:
            readings = replace(readings, context=contexts[0].joined(contexts))
        return cls(TouchMeans.joined([part.means for part in parts]), readings)


def readings_of(means: TouchMeans, force_sd: float, use_load: bool) -> TouchReadings:
    """Readings of touches, with or without the load; `force_sd` is the noise of the force sensor (N/m)."""
    counts = np.where(np.isnan(means.readings), 0, means.counts)
    load = means.load if use_load else np.full(means.n_touches, np.nan)
    return TouchReadings(means.readings, counts, load, force_sd / np.sqrt(means.reads_of_load))


def rows_as_touches(touches: Touches) -> TouchMeans:
    """Each row in contact as a separate touch, with the numbers of its touch and its sample."""
    contact = touches.select(touches.in_contact)
    means = contact.with_(touch=np.arange(contact.n_rows), sample=np.zeros(contact.n_rows, dtype=np.int64)).averaged()
    return replace(means, touch=contact.touch, sample=contact.sample)


def _joined(parts: Sequence[TouchReadings]) -> TouchReadings:
    """Readings of several blocks, concatenated."""
    names = ("readings", "counts", "load", "load_sd")
    columns: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return replace(parts[0], **columns)
