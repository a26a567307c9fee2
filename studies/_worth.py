"""What models of a measured pad are worth when touches are read: linear, without physics, before and after a diagnosis.

All are given the same held-out touches. The location is read with the load given where it was measured, the load from
the elements alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from _page import markdown_table
from numpy.typing import NDArray
from scipy.stats import binomtest

import bayestouch
from bayestouch.baselines import HeldOutBaseline, baselines
from bayestouch.data.dataset import DataSet
from bayestouch.diagnosis.traced import Traced
from bayestouch.inference import infer_with
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
    "90 % regions hold (95 % interval)",
    "load: rms, N",
    "90 % intervals hold (95 % interval)",
)
#: Probability of the interval beside a share of touches.
SURE = 0.95


def share_text(share: float, touches: int) -> str:
    """A share of touches with its interval by Clopper and Pearson (1934), as if touches were independent."""
    ends = binomtest(round(share * touches), touches).proportion_ci(SURE, method="exact")
    return f"{share:.2f} ({ends.low:.2f} to {ends.high:.2f})"


@dataclass(frozen=True, eq=False)
class Worth:
    """Errors of held-out touches read in one way; NaN where loads were not measured.

    `distance_mm` and `load_error_N` are errors of each touch; `inside` and `load_inside` are 1 where its 90 % region
    and its interval contain the truth, else 0; `run` is its number of the run of touches that follow each other.
    """

    way: str
    readings_percent: float
    inside: NDArray[np.float64]
    load_inside: NDArray[np.float64]
    distance_mm: NDArray[np.float64]
    load_error_N: NDArray[np.float64]
    run: NDArray[np.int64]

    @classmethod
    def of_calibration(cls, way: str, calibration: bayestouch.Calibration, read: TouchReading, traced: Traced) -> Worth:
        """Errors of the posteriors that a calibration gives."""
        of = read.by_touch
        distance, load = of["location_rms_mm"], of["P_rms_N"]
        return cls(
            way,
            rms_percent(left_by(calibration, traced.data) / traced.before.fitted.model.peak),
            of["coverage_90"],
            of["P_coverage_90"],
            distance,
            load,
            runs_of(traced),
        )

    @classmethod
    def of_regression(cls, baseline: HeldOutBaseline, traced: Traced) -> Worth:
        """Errors of the posteriors that a regression gives, in its readings those of the means of touches."""
        found, read, held = baseline.errors, baseline.read, baseline.held
        return cls(
            baseline.regression.name,
            found["touch_error_percent_peak"],
            read.location_inside.astype(float),
            baseline.load_inside,
            np.sqrt(((read.location - held.location) ** 2).sum(axis=1)),
            read.load - (np.nan if held.load is None else held.load),
            runs_of(traced),
        )

    @property
    def coverage(self) -> float:
        """Share of 90 % regions that contain the location."""
        return float(self.inside.mean())

    @property
    def load_coverage(self) -> float:
        """Share of 90 % intervals that contain the load."""
        return float(self.load_inside.mean())

    @property
    def median_mm(self) -> float:
        """Median error of the location."""
        return float(np.median(self.distance_mm))

    @property
    def rms_mm(self) -> float:
        """Root mean square of the error of the location."""
        return float(np.sqrt(np.mean(self.distance_mm**2)))

    @property
    def load_rms_N(self) -> float:
        """Root mean square of the error of the load."""
        return float(np.sqrt(np.mean(self.load_error_N**2)))

    @property
    def touches(self) -> int:
        """Number of touches."""
        return len(self.distance_mm)

    def cells(self) -> list[str]:
        """Cells of its row, without the data's name."""
        numbers = (self.readings_percent, self.median_mm, self.rms_mm, self.load_rms_N)
        readings, median, rms, load = ("–" if np.isnan(each) else f"{each:.2f}" for each in numbers)
        held, held_load = (
            "–" if np.isnan(each) else share_text(each, self.touches) for each in (self.coverage, self.load_coverage)
        )
        return [self.way, readings, median, rms, held, load, held_load]


def runs_of(traced: Traced) -> NDArray[np.int64]:
    """Number of the run of touches that follow each other, for each held-out touch (t,)."""
    held = traced.before.held_out
    assert held is not None
    touch = held.observed.means.touch
    return np.cumsum(np.diff(touch, prepend=touch[0]) > 1)


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
    return calibration, read_held_out(infer_with, calibration, data, held, seed=0)


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
        *(Worth.of_regression(each, traced) for each in regressions),
        Worth.of_calibration("before: kernel and map", before.calibration, before.read, traced),
        Worth.of_calibration("after", after.calibration, after.read, traced),
    ]


def worth_table(found: Mapping[str, Sequence[Worth]]) -> str:
    """Markdown table of data sets, by name."""
    cells = [[name, *each.cells()] for name, ways in found.items() for each in ways]
    return markdown_table(HEAD, cells).rstrip()
