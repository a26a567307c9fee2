"""Results as groups of named arrays in the ArviZ schema.

The groups ``posterior`` (with ``chain`` and ``draw``), ``sample_stats``, ``observed_data`` and ``constant_data`` are
those of ArviZ. On request there are the `bayestouch.results.schema.GROUPS`. This package adds ``rows`` (touches with
their predictions), ``summary`` (five statistics of each parameter and touch), ``tips`` (probability of each known tip)
and, for a calibration, ``noise``, ``mode``, ``laplace`` and ``extra``. Text (sensor, parameters, settings, notes) is
stored in attributes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.sensor_toml import sensor_to_toml
from bayestouch.errors import InputError
from bayestouch.priors.parameter_text import parameters_to_json
from bayestouch.results.arrays import by_touch, dataset, own_dims
from bayestouch.results.data import CalibrationData, PosteriorsData, TouchRows
from bayestouch.results.schema import touch_coordinates
from bayestouch.results.summaries import STATISTICS
from bayestouch.results.units import units_of

if TYPE_CHECKING:
    import xarray as xr

Groups: TypeAlias = "dict[str, xr.Dataset]"
Attributes: TypeAlias = dict[str, str]

#: Increased when old versions cannot read the files of a new version; and all that can be read.
FORMAT = "2"
READABLE = ("1", FORMAT)
#: Beginning of a note on groups that a file has and that were not read. It is true of that file only, and never saved.
NOT_READ = "not read, because they take more than 1 GB together: "

ROW_ARRAYS = ("predicted", "sd", "counts")
#: Number of reads of a touch. Files of 0.1.0 do not have them.
ROW_READS = ("samples", "load_reads")
#: Number of each sample within its touch; only where each sample was read by itself.
ROW_SAMPLE = "sample_number"
#: Variables by touch (and element) of the groups that are written on request.
OF_TOUCHES = ("reading", "load", "whole_touch")


def calibration_groups(calibration: CalibrationData) -> tuple[Groups, Attributes]:
    """Groups and attributes of a calibration, as they are written to a file."""
    import xarray as xr

    units = units_of(calibration)
    touch = touch_coordinates(calibration.rows)
    m = calibration.sensor.n_elements

    def named(values: Mapping[str, FloatArray], *leading: str) -> xr.Dataset:
        shapes = {name: np.shape(array)[len(leading) :] for name, array in values.items()}
        dims = {name: ("element",) if shape == (m,) else own_dims(name, len(shape)) for name, shape in shapes.items()}
        return dataset({name: ((*leading, *dims[name]), array) for name, array in values.items()}, units)

    layout = np.array(calibration.layout, dtype=object)
    laplace = xr.Dataset(
        {"covariance": (("row", "column"), calibration.covariance, {"units": "unit of row times unit of column"})},
        {"row": ("row", layout), "column": ("column", layout)},
    )
    noise = dataset(
        {
            "tactile_sd": (("element",), calibration.noise.tactile_sd),
            "discrepancy_sd": (("element",), calibration.noise.discrepancy_sd),
            "signal_share": ((), calibration.noise.signal_share),
            "force_sd": ((), calibration.noise.force_sd),
            "load_scatter": ((), calibration.noise.load_scatter),
        },
        units,
    )
    groups = {
        "posterior": named(calibration.posterior, "chain", "draw"),
        "mode": named(calibration.mode),
        "laplace": laplace,
        "noise": noise,
        "extra": named(calibration.extra),
        **_requested(calibration, units, touch),
        # Loads are given to the model of a calibration. ArviZ compares all observed data with predictions.
        **_row_groups(calibration.rows, units, touch, loads="constant_data"),
    }
    return groups, _attributes("calibration", calibration) | {"statistics": _to_json(calibration.statistics)}


def touch_groups(result: PosteriorsData, first: int = 0) -> tuple[Groups, Attributes]:
    """Groups and attributes of posteriors of touches, as they are written to a file.

    `first` is the position of the first touch in the table.
    """
    units = units_of(result)
    touch = touch_coordinates(result.rows, first)
    rows = _row_groups(result.rows, units, touch, loads="observed_data")
    posterior = {name: (("chain", "draw", "touch"), values) for name, values in result.posterior.items()}
    groups = {
        **({"posterior": dataset(posterior, units).assign_coords(touch)} if posterior else {}),
        "sample_stats": by_touch(result.sample_stats, {}).assign_coords(touch),
        **rows,
        # Reference values of the touches, under the same names as the draws, so that both can be compared.
        "constant_data": by_touch(result.reference, units).assign_coords(touch),
    }
    for name, group in _requested(result, units, touch).items():
        groups[name] = groups[name].merge(group) if name in groups else group
    if result.estimates:
        summary = {name: (("statistic", "touch"), values) for name, values in result.estimates.items()}
        statistic = {"statistic": ("statistic", np.array(STATISTICS, dtype=object))}
        groups["summary"] = dataset(summary, units).assign_coords(touch | statistic)
    if result.tips is not None:
        groups["tips"] = result.tips.to_group(result.rows.touch)
    return groups, _attributes("touches", result)


def _requested(
    result: CalibrationData | PosteriorsData, units: Mapping[str, str], touch: Mapping[str, xr.Variable]
) -> Groups:
    """Groups that were asked for."""
    m = result.sensor.n_elements
    groups = {}
    for group, values in result.groups.items():
        of_density = group in ("log_likelihood", "log_prior", "sample_stats")
        named = {}
        for name, array in values.items():
            shape = np.shape(array)[2:]
            if isinstance(result, PosteriorsData) or name in OF_TOUCHES:
                dims: tuple[str, ...] = ("touch", "element")[: len(shape)]
            else:
                dims = ("element",) if shape == (m,) else own_dims(name, len(shape))
            named[name] = (("chain", "draw", *dims), array)
        made = dataset(named, {} if of_density else units)
        groups[group] = made.assign_coords(touch) if "touch" in made.dims else made
    return groups


def _row_groups(rows: TouchRows, units: Mapping[str, str], touch: Mapping[str, xr.Variable], *, loads: str) -> Groups:
    """Groups of the touches as they were read; `loads` is the group of the measured loads."""
    by_element = {name: (("touch", "element"), getattr(rows, name)) for name in ROW_ARRAYS}
    location = dict(rows.location)
    groups = {
        "observed_data": dataset({"reading": (("touch", "element"), rows.observed)}, units).assign_coords(touch),
        "constant_data": by_touch(location | {"r_c": rows.radius_mm}, units).assign_coords(touch),
        "rows": dataset(
            by_element
            | {f"location_{name}": (("touch",), values) for name, values in location.items()}
            | {name: (("touch",), getattr(rows, name)) for name in ("radius_mm", *ROW_READS)}
            | ({} if rows.sample is None else {ROW_SAMPLE: (("touch",), rows.sample)}),
            units,
        ).assign_coords(touch),
    }
    groups[loads] = groups[loads].merge(by_touch({"load": rows.load}, units))
    return groups


def _attributes(kind: str, result: CalibrationData | PosteriorsData) -> Attributes:
    attributes = {
        "bayestouch": kind,
        "bayestouch_format": FORMAT,
        "sensor": sensor_to_toml(result.sensor),
        "sensor_notes": _to_json(result.sensor.notes),
        "parameters": parameters_to_json(result.parameters),
        "settings": _to_json(result.settings),
        "notes": _to_json(tuple(note for note in result.notes if not note.startswith(NOT_READ))),
    }
    # Notes and settings name files, and the name of a file may hold bytes that are no text in UTF-8.
    return {name: text.encode(errors="replace").decode() for name, text in attributes.items()}


def _to_json(value: Any) -> str:
    def plain(other: Any) -> Any:
        if isinstance(other, Mapping):
            return dict(other)
        if isinstance(other, np.generic):
            return other.item()
        raise InputError(f"cannot be saved: a {type(other).__name__} among settings, statistics or notes")

    return json.dumps(value, default=plain, ensure_ascii=False)
