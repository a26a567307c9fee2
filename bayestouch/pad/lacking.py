"""What a data set lacks for the calibration of a pad."""

from __future__ import annotations

from collections.abc import Iterator

from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import pad_of


def lacking_to_calibrate(dataset: DataSet, known: TouchMeans) -> Iterator[str]:
    """A line for each kind of touch that the calibration needs.

    Parameters
    ----------
    dataset : DataSet
    known : TouchMeans
        Touches with references: of the calibration table, or of the one table that there is.
    """
    columns = pad_of(dataset.sensor).location_columns
    absent = [name for name in columns if getattr(known, name) is None]
    if absent:
        yield f"cannot be calibrated: no {' and '.join(absent)}"
