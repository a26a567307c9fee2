"""Data that are missing for the calibration of a pad."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import pad_of
from bayestouch.data.splits import with_calibration
from bayestouch.errors import InputError
from bayestouch.model.misplaced import misplaced
from bayestouch.pad.choice import identifiable_kernels
from bayestouch.pad.problem import pad_problem
from bayestouch.pad.reached import Reached


def lacking_to_calibrate(dataset: DataSet, known: TouchMeans) -> Iterator[str]:
    """A line of text for each kind of touch that is missing and that the calibration needs.

    Parameters
    ----------
    dataset : DataSet
        Data set of a pad.
    known : TouchMeans
        Touches with references, from the calibration table or, without one, from the only table.
    """
    pad = pad_of(dataset.sensor)
    columns = {name: getattr(known, name) for name in pad.location_columns}
    absent = [name for name, values in columns.items() if values is None or not np.isfinite(values).any()]
    if absent:
        yield f"cannot be calibrated: no {' and '.join(absent)}"
        return
    if not np.isfinite(np.stack([np.asarray(values) for values in columns.values()])).all(axis=0).any():
        yield f"cannot be calibrated: no touch has {' and '.join(columns)}"
        return
    try:
        table = with_calibration(dataset).calibration
        assert table is not None
        problem, _ = pad_problem(dataset.sensor, table, samples="auto", seed=0)
        identifiable_kernels(problem, dataset.sensor)
    except InputError as error:
        column = f"column {error.column}: " if error.column else ""
        yield f"cannot be calibrated: {column}{error.message}"
        return
    yield from misplaced(known, np.stack(list(pad.places_mm.values()), axis=1), pad.location_columns, " mm")
    if note := Reached.of(problem.priors.position, problem.known.location).note(problem.usable):
        yield note
