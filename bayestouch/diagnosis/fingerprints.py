"""Fingerprints of a data set, by which a saved diagnosis is recognised as one of it."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Sensor
from bayestouch.data.touches import Touches
from bayestouch.results.partial import fingerprint_of


def data_fingerprints(dataset: DataSet) -> dict[str, str | None]:
    """Hash of the sensor and of each table; None for a calibration table that the data set does not have.

    They depend on values alone: not on the folder, the name of the sensor (which may be that of the folder), the format
    of the tables, the source of the data, or columns and keys that this package does not use.
    """
    calibration = dataset.calibration
    return {
        "sensor": _of_sensor(dataset.sensor),
        "calibration": None if calibration is None else _of_table(calibration),
        "touches": _of_table(dataset.touches),
    }


def _of_sensor(sensor: Sensor) -> str:
    body = sensor.body
    geometry = {key: getattr(body, key) for key in body.geometry_keys}
    readings = (sensor.reading_unit, sensor.reading_quantity)
    return fingerprint_of(body.kind, geometry, sensor.rubber, sensor.force_noise_sd, readings)


def _of_table(touches: Touches) -> str:
    columns: dict[str, Any] = {
        each.name: getattr(touches, each.name) for each in fields(touches) if each.name not in ("extra", "notes")
    }
    return fingerprint_of({name: _one_nan(values) for name, values in columns.items()})


def _one_nan(values: Any) -> Any:
    """Values of a column, with the same bits in all that are missing."""
    if isinstance(values, np.ndarray) and values.dtype.kind == "f":
        return np.where(np.isnan(values), np.nan, values)
    return values
