"""Advice on missing information: what a report needs, and the touches that would provide it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from bayestouch.array_types import BoolArray
from bayestouch.checking.order import SCAN, in_scan_order
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.touches import Touches
from bayestouch.errors import few
from bayestouch.model.body import body_of
from bayestouch.model.silent import silent_elements
from bayestouch.model.usable_touches import DEAD


def lacking(dataset: DataSet, means: Mapping[str, TouchMeans]) -> Iterator[str]:
    """Yield one line for each result that a report cannot give, or not well, and the touches that would allow it.

    `means` are those `means_by_table` gives.
    """
    if dataset.calibration is None:
        yield "no calibration table: touches.csv is split by location, and one half is used for calibration"
    fitted = dataset.touches if dataset.calibration is None else dataset.calibration
    if not fitted.n_rows:
        name = "touches" if dataset.calibration is None else "calibration"
        yield f"no rows in {name}: the sensor cannot be calibrated"
        return
    known = means["touches" if dataset.calibration is None else "calibration"]
    yield from _loads_below_noise(dataset, known)
    yield from body_of(dataset.sensor).lacking(dataset, known)
    if in_scan_order(known):
        yield SCAN
    if dead := _named(~fitted.usable_elements):
        yield f"{dead}: {DEAD}; nothing is learnt from it, and it is left out"
    yield from silent_elements(dataset, means)
    if steps := _named(coarse_elements(fitted, known)):
        yield (
            f"{steps}: readings come in steps of more than twice their noise, so that the samples of a touch share a "
            "rounding error, which averaging does not reduce; record more digits, or use a smaller range"
        )
    if known.repeats_equal:
        yield (
            "the samples of each touch are all equal, so that they say nothing of the noise, and it cannot be "
            "distinguished from model error; record more digits of each reading, and no copies of a row"
        )
    elif not np.nansum(known.pure_error_dof) > 0:
        yield "no touch is repeated: noise cannot be distinguished from model error; take 3 to 5 samples of each touch"
    if fitted.in_contact.all():
        elsewhere = "" if dataset.touches.in_contact.all() else "; touches has some: copy them into calibration"
        missing = (
            "no reading without contact (depth, load or contact 0): an offset of the readings cannot be subtracted"
        )
        yield missing + elsewhere
    if dataset.touches.n_rows:
        yield from _references(dataset)
    else:
        yield "no rows in touches: there is nothing to read"


def _loads_below_noise(dataset: DataSet, known: TouchMeans) -> Iterator[str]:
    """A line if most loads are smaller than the noise of the force sensor: then nothing would have been measured."""
    sensor, load = dataset.sensor, np.abs(known.load[np.isfinite(known.load)])
    noise, body = sensor.force_noise_sd, sensor.body
    if noise is not None and len(load) and (typical := float(np.median(load))) < noise:
        yield (
            f"{body.load_column} is {typical:.3g} {body.load_unit} in the median, less than the noise of the force "
            f"sensor, {noise:g} {body.load_unit}: is one of them in another unit?; state both in {body.load_unit}"
        )


def coarse_elements(touches: Touches, known: TouchMeans) -> BoolArray:
    """Elements (m,) whose readings come in steps that are larger than twice their noise.

    With a noise σ of half a step q or more, the rounding errors of samples are independent of each other, and have the
    variance q²/12: samples of a touch scatter by σ² + q²/12, which is q²/3 or more. With less noise the samples of a
    touch have the same rounding error.

    Parameters
    ----------
    touches : Touches
        Readings as recorded.
    known : TouchMeans
        Means of the same touches.
    """
    out = np.full(known.n_elements, False)
    for k, column in enumerate(touches.readings.T):
        levels, times = np.unique(column[np.isfinite(column)], return_counts=True)
        # Readings of many digits hardly ever have the same value twice: their smallest difference is no step.
        if len(levels) < 2 or times.sum() < 2 * len(levels):
            continue
        out[k] = known.pure_error_variance[k] < np.diff(levels).min() ** 2 / 3
    return out


def _named(elements: BoolArray) -> str:
    return few([f"e{k + 1:02d}" for k in np.flatnonzero(elements)])


def _references(dataset: DataSet) -> Iterator[str]:
    touches, body = dataset.touches, dataset.sensor.body
    columns = {name: getattr(touches, name) for name in body.location_columns}
    absent = [name for name, values in columns.items() if values is None or not np.isfinite(values).any()]
    if absent:
        yield f"no {' and '.join(absent)} in touches: errors of the location cannot be given"
    if not np.isfinite(touches.load).any():
        yield f"no {body.load_column} in touches: errors of the load cannot be given"
    if body.reads_radius and np.isnan(touches.indenter_radius_mm).all():
        yield "no indenter_radius_mm in touches: errors of the radius cannot be given"
