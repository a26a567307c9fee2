"""What models of a measured pad are worth when touches are read: linear, without physics, before and after a diagnosis.

All are given the same held-out touches. The location is read with the load given where it was measured, the load from
the elements alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, replace

import numpy as np
from _page import markdown_table
from numpy.typing import NDArray

import bayestouch
from bayestouch.baselines import HeldOutBaseline, baselines
from bayestouch.data.dataset import DataSet
from bayestouch.diagnosis.traced import Traced
from bayestouch.inference import infer
from bayestouch.model.held_out import HeldOut, rms_percent
from bayestouch.model.split_data import SplitData
from bayestouch.model.timing import Timing
from bayestouch.model.touch_errors import TouchReading
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.known_touches import pad_readings
from bayestouch.pad.reading.reader import PadReader
from bayestouch.pad.touch_errors import read_held_out

#: Mark of the table in a page.
WORTH = "<!-- what it is worth, made by studies/measured_diagnosis.py -->"
HEAD = (
    "data",
    "read with",
    "readings, % of the peak",
    "location: median, mm",
    "rms, mm",
    "90 % regions hold",
    "load: rms, N",
    "90 % intervals hold",
)


@dataclass(frozen=True)
class Worth:
    """Errors of held-out touches read in one way; NaN where loads were not measured."""

    way: str
    readings_percent: float
    median_mm: float
    rms_mm: float
    coverage: float
    load_rms_N: float
    load_coverage: float

    @classmethod
    def of_calibration(cls, way: str, calibration: bayestouch.Calibration, read: TouchReading, traced: Traced) -> Worth:
        """Errors of the posteriors that a calibration gives."""
        of = read.by_touch
        distance, load = of["location_rms_mm"], of["P_rms_N"]
        return cls(
            way,
            rms_percent(left_by(calibration, traced.data) / traced.before.fitted.model.peak),
            float(np.median(distance)),
            float(np.sqrt(np.mean(distance**2))),
            float(of["coverage_90"].mean()),
            float(np.sqrt(np.mean(load**2))),
            float(of["P_coverage_90"].mean()),
        )

    @classmethod
    def of_regression(cls, baseline: HeldOutBaseline) -> Worth:
        """Errors of the posteriors that a regression gives, in its readings those of the means of touches."""
        found = baseline.errors
        return cls(
            baseline.regression.name,
            found["touch_error_percent_peak"],
            found["location_median_mm"],
            found["location_rms_mm"],
            found["coverage_90"],
            found["P_rms_N"],
            found["P_coverage_90"],
        )

    def cells(self) -> list[str]:
        """Cells of its row, without the data's name."""
        way, *numbers = astuple(self)
        return [way, *("–" if np.isnan(each) else f"{each:.2f}" for each in numbers)]


def left_by(calibration: bayestouch.Calibration, data: SplitData) -> NDArray[np.float64]:
    """Reading minus what a calibration predicts at the location and load as stated, of held-out touches (t, m).

    Readings and loads are corrected for the effects of the calibration, as they are when touches are read; of touches
    with several samples, it takes the samples that are read. A load that was not measured is the calibration's mean.
    """
    reader, effects = PadReader.from_calibration(calibration), PadEffects.of(calibration)
    table = data.table
    if effects is not None:
        table = effects.corrected(table, Timing(data.time_s, data.held_s, data.unit))
    means = pad_readings(table.select(data.held_out), reader.map.dimensions, reader.samples)
    load = np.where(np.isfinite(means.load) & reader.load_measured, means.load, reader.load)
    signal, _ = reader.predict(means.location, load, np.maximum(means.counts, 1))
    return np.asarray(means.readings - reader.map.offset - signal)


def kernel_alone(traced: Traced, kernel: str) -> tuple[bayestouch.Calibration, TouchReading]:
    """Calibration in proportion to the load with a kernel and no map, and the held-out touches as it reads them."""
    data, held = traced.data, traced.before.held_out
    assert held is not None
    known = data.table.select(data.training).with_(notes=())
    calibration = calibrate_pad(replace(data.dataset, calibration=known), kernel=kernel, empirical=False)
    return calibration, read_held_out(infer, calibration, data, held, seed=0)


def worths(dataset: DataSet, traced: Traced) -> list[Worth]:
    """Every way of reading the held-out touches of a diagnosis of a data set."""
    before, after = traced.before, traced.after
    held: HeldOut | None = before.held_out
    assert held is not None and before.read is not None and after.read is not None
    peak = before.fitted.model.peak
    linear = kernel_alone(traced, str(before.calibration.settings["kernel"]))
    # A regression is given all touches that are not held out, of which a diagnosis may use a part.
    regressions = baselines(SplitData.of(dataset), held.observed, peak)
    return [
        Worth.of_calibration("kernel alone", *linear, traced),
        *(Worth.of_regression(each) for each in regressions),
        Worth.of_calibration("before: kernel and map", before.calibration, before.read, traced),
        Worth.of_calibration("after", after.calibration, after.read, traced),
    ]


def worth_table(found: Mapping[str, Sequence[Worth]]) -> str:
    """Markdown table of data sets, by name."""
    cells = [[name, *each.cells()] for name, ways in found.items() for each in ways]
    return markdown_table(HEAD, cells).rstrip()
