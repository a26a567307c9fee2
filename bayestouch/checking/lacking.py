"""Advice on missing information: what a report needs, and the touches that would provide it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayestouch.checking.order import SCAN, in_scan_order
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.model.body import body_of


def lacking(dataset: DataSet) -> Iterator[str]:
    """Yield one line for each result that a report cannot give, or not well, and the touches that would allow it."""
    if dataset.calibration is None:
        yield "no calibration table: touches.csv is split by location, and one half is used for calibration"
    fitted = dataset.touches if dataset.calibration is None else dataset.calibration
    if not fitted.n_rows:
        name = "touches" if dataset.calibration is None else "calibration"
        yield f"no rows in {name}: the sensor cannot be calibrated"
        return
    known = fitted.baseline_corrected().averaged()
    yield from _loads_below_noise(dataset, known)
    yield from body_of(dataset.sensor).lacking(dataset, known)
    if in_scan_order(known):
        yield SCAN
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
