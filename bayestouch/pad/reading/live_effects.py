"""Effects on the samples of a stream on a pad: each sample is corrected like the rows of a table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.missing import REMEMBERED, ends_before
from bayestouch.chain.recording import History
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.effect_changes import roots_of
from bayestouch.reading.live import HeldTouch, require_seconds


class PadStream:
    """Samples of touches on a pad. A `bayestouch.reading.live.LiveStream`.

    Parameters
    ----------
    effects : PadEffects or None
        Effects for which samples are corrected.
    samples : {"mean", "first", "last"}
        Samples of a touch that are used.
    """

    def __init__(self, effects: PadEffects | None, samples: str) -> None:
        self.effects, self.samples = effects, samples
        self.needs_time = effects is not None and any(effect.needs_samples for effect in effects.listed.plain)
        if effects is not None and self.needs_time:
            require_seconds(effects.listed.setting.time_unit)
        self._earlier: list[tuple[float, FloatArray]] = []
        self._history: History | None = None
        self._missing_s: FloatArray = np.zeros(0)
        self._began = self._last = 0.0
        self._raw: HeldTouch | None = None

    def begin(self, time_s: float) -> None:
        """Start a touch at this time (s)."""
        self._began, self._raw = time_s, None
        if self.effects is not None and self.needs_time and not self._earlier:
            # Before the first touch of a stream there may have been as many as in the calibration.
            setting, before = self.effects.listed.setting, len(self.effects.calibrated)
            self._missing_s = ends_before(time_s, before, setting.gap_s, setting.hold_s)
        if self._earlier:
            end, readings = (np.array(each) for each in zip(*self._earlier, strict=True))
            self._history = History(end, readings)

    def add(self, held: HeldTouch, values: FloatArray, load: float, time_s: float, reads: float) -> HeldTouch:
        """The touch with one more sample, corrected for the effects."""
        if self.effects is not None:
            before = HeldTouch.none(len(values)) if self._raw is None else self._raw
            self._raw, self._last = before.after(values, np.nan, reads), time_s
            values, load = self.effects.corrected_sample(values, load, time_s, time_s - self._began, self._history)
        if self.samples == "first" and held.samples:
            return replace(held, samples=held.samples + 1)
        if self.samples == "last":
            held = replace(HeldTouch.none(len(values), held.rest_reads), samples=held.samples)
        return held.after(values, load, reads)

    def by_missing(self, read: FloatArray) -> FloatArray:
        """As `CorrectedMeans.by_missing` for the present touch, (k, m), from its mean readings (m,)."""
        if self.effects is None or not len(self._missing_s):
            return np.zeros((0, len(read)))
        known = np.array([end for end, _ in self._earlier])
        square = self.effects.left_by_missing(read[None], np.array([self._began]), self._missing_s, known)
        return np.asarray(roots_of(square)[0])

    def end(self) -> None:
        """End the touch: its remainder changes the readings of later touches."""
        if self.needs_time and self._raw is not None:
            self._earlier = [*self._earlier, (self._last, self._raw.readings)][-REMEMBERED:]
            if len(self._earlier) == REMEMBERED:
                self._missing_s = np.zeros(0)
