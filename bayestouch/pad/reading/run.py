"""Posteriors of touches on a pad."""

from __future__ import annotations

from bayestouch.data.survey import Survey, survey
from bayestouch.data.touch_source import InMemory, TouchSource
from bayestouch.data.touches import Touches
from bayestouch.pad.reading.touch_reader import PadTouchReader
from bayestouch.progress import Progress
from bayestouch.reading.driver import TouchRun
from bayestouch.reading.options import Kept, Options
from bayestouch.reading.run import touch_run
from bayestouch.results.objects import Calibration, TouchPosteriors


def pad_run(source: TouchSource, found: Survey, calibration: Calibration, options: Options) -> TouchRun:
    """Make touches on a pad ready to be read; see `bayestouch.reading.run.touch_run`."""
    reader = PadTouchReader.from_calibration(calibration, options)
    return touch_run(reader, source, found, calibration, options)


def infer_pad(
    touches: Touches,
    calibration: Calibration,
    *,
    plug_in: bool = False,
    use_load: bool = True,
    draws: int = 1000,
    seed: int = 0,
    progress: Progress | None = None,
) -> TouchPosteriors:
    """Posteriors of location and load of touches on a pad, in memory and by one process; see `bayestouch.infer`."""
    options = Options(plug_in=plug_in, use_load=use_load, kept=Kept(draws), seed=seed)
    source = InMemory(touches)
    options.check(source, calibration)
    run = pad_run(source, survey(source), calibration, options)
    return run.reader.read(next(run.blocks(run.n_touches)), 0, 1, progress)
