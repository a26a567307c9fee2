"""Results as groups of named arrays in the ArviZ schema.

The groups ``posterior`` (with ``chain`` and ``draw``), ``sample_stats``, ``observed_data`` and ``constant_data`` are
those of ArviZ. This package adds ``rows`` (touches with their predictions), ``summary`` (five statistics of each
parameter and touch), ``tips`` (probability of each known tip) and, for a calibration, ``noise``, ``mode``, ``laplace``
and ``extra``. Text (sensor, parameters, settings, notes) is stored in attributes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.sensor import Sensor
from bayestouch.data.sensor_toml import sensor_to_toml
from bayestouch.errors import InputError
from bayestouch.priors.parameter_text import parameters_to_json
from bayestouch.priors.parameters import Parameter
from bayestouch.results.arrays import by_touch, dataset, own_dims
from bayestouch.results.data import CalibrationData, PosteriorsData, TouchRows
from bayestouch.results.summaries import STATISTICS

if TYPE_CHECKING:
    import xarray as xr

Groups: TypeAlias = "dict[str, xr.Dataset]"
Attributes: TypeAlias = dict[str, str]

#: Increased when old versions cannot read the files of a new version.
FORMAT = "1"

# Units of quantities that are derived from the parameters; {} is replaced by the unit of the readings.
_DERIVED_UNITS = {
    "r_c": "mm",
    "R": "mm",
    "theta_c": "degree",
    "x": "mm",
    "y": "mm",
    "gain": "{}",
    "noise_sd": "{}",
    "discrepancy_sd": "{}",
    "tactile_sd": "{}",
    "reading": "{}",
    "predicted": "{}",
    "sd": "{}",
}
ROW_ARRAYS = ("predicted", "sd", "counts")


def calibration_groups(calibration: CalibrationData) -> tuple[Groups, Attributes]:
    """Groups and attributes of a calibration, as they are written to a file."""
    import xarray as xr

    units = _units(calibration.parameters, calibration.sensor)
    m = calibration.sensor.n_elements

    def named(values: Mapping[str, FloatArray], *leading: str) -> xr.Dataset:
        shapes = {name: np.shape(array)[len(leading) :] for name, array in values.items()}
        dims = {name: ("element",) if shape == (m,) else own_dims(name, len(shape)) for name, shape in shapes.items()}
        return dataset({name: ((*leading, *dims[name]), array) for name, array in values.items()}, units)

    layout = np.array(calibration.layout, dtype=object)
    laplace = xr.Dataset(
        {"covariance": (("row", "column"), calibration.covariance)},
        {"row": ("row", layout), "column": ("column", layout)},
    )
    noise = dataset(
        {
            "tactile_sd": (("element",), calibration.noise.tactile_sd),
            "discrepancy_sd": (("element",), calibration.noise.discrepancy_sd),
            "signal_share": ((), calibration.noise.signal_share),
            "force_sd": ((), calibration.noise.force_sd),
        },
        units | {"force_sd": calibration.sensor.body.load_unit},
    )
    groups = {
        "posterior": named(calibration.posterior, "chain", "draw"),
        "mode": named(calibration.mode),
        "laplace": laplace,
        "noise": noise,
        "extra": named(calibration.extra),
        **_row_groups(calibration.rows, calibration.sensor, units),
    }
    return groups, _attributes("calibration", calibration) | {"statistics": _to_json(calibration.statistics)}


def touch_groups(result: PosteriorsData) -> tuple[Groups, Attributes]:
    """Groups and attributes of posteriors of touches, as they are written to a file."""
    units = _units(result.parameters, result.sensor)
    touch = {"touch": ("touch", result.rows.touch)}
    rows = _row_groups(result.rows, result.sensor, units)
    posterior = {name: (("chain", "draw", "touch"), values) for name, values in result.posterior.items()}
    groups = {
        **({"posterior": dataset(posterior, units).assign_coords(touch)} if posterior else {}),
        "sample_stats": by_touch(result.sample_stats, {}).assign_coords(touch),
        **rows,
        # Reference values of the touches, under the same names as the draws, so that both can be compared.
        "constant_data": by_touch(result.reference, units).assign_coords(touch),
    }
    if result.summary:
        summary = {name: (("statistic", "touch"), values) for name, values in result.summary.items()}
        statistic = {"statistic": ("statistic", np.array(STATISTICS, dtype=object))}
        groups["summary"] = dataset(summary, units).assign_coords(touch | statistic)
    if result.tips is not None:
        groups["tips"] = result.tips.to_group(result.rows.touch)
    return groups, _attributes("touches", result)


def _row_groups(rows: TouchRows, sensor: Sensor, units: Mapping[str, str]) -> Groups:
    touch = {"touch": ("touch", rows.touch)}
    by_element = {name: (("touch", "element"), getattr(rows, name)) for name in ROW_ARRAYS}
    observed = {"reading": (("touch", "element"), rows.observed), "load": (("touch",), rows.load)}
    location = dict(rows.location)
    return {
        "observed_data": dataset(observed, {**units, "load": sensor.body.load_unit}).assign_coords(touch),
        "constant_data": by_touch(location | {"r_c": rows.radius_mm}, units).assign_coords(touch),
        "rows": dataset(
            by_element
            | {f"location_{name}": (("touch",), values) for name, values in location.items()}
            | {"radius_mm": (("touch",), rows.radius_mm)},
            units,
        ).assign_coords(touch),
    }


def _units(parameters: tuple[Parameter, ...], sensor: Sensor) -> dict[str, str]:
    derived = {name: unit.replace("{}", sensor.reading_unit) for name, unit in _DERIVED_UNITS.items()}
    return derived | {parameter.name: parameter.unit for parameter in parameters}


def _attributes(kind: str, result: CalibrationData | PosteriorsData) -> Attributes:
    return {
        "bayestouch": kind,
        "bayestouch_format": FORMAT,
        "sensor": sensor_to_toml(result.sensor),
        "sensor_notes": _to_json(result.sensor.notes),
        "parameters": parameters_to_json(result.parameters),
        "settings": _to_json(result.settings),
        "notes": _to_json(result.notes),
    }


def _to_json(value: Any) -> str:
    def plain(other: Any) -> Any:
        if isinstance(other, Mapping):
            return dict(other)
        if isinstance(other, np.generic):
            return other.item()
        raise InputError(f"cannot be saved: a {type(other).__name__} among settings, statistics or notes")

    return json.dumps(value, default=plain, ensure_ascii=False)
