"""Posteriors of touches on a finger."""

from __future__ import annotations

from bayestouch.data.survey import Survey
from bayestouch.data.touch_source import TouchSource
from bayestouch.finger.reading.touch_reader import FingerTouchReader
from bayestouch.reading.driver import TouchRun
from bayestouch.reading.options import Options
from bayestouch.reading.run import touch_run
from bayestouch.results.objects import Calibration


def finger_run(source: TouchSource, found: Survey, calibration: Calibration, options: Options) -> TouchRun:
    """Make touches on a finger ready to be read; see `bayestouch.reading.run.touch_run`."""
    reader = FingerTouchReader.from_calibration(calibration, options)
    return touch_run(reader, source, found, calibration, options)
