"""Results as groups of named arrays, the ArviZ schema, and back.

``posterior`` (with ``chain`` and ``draw``), ``sample_stats``, ``observed_data`` and ``constant_data`` are ArviZ's. Our
own: ``rows``, the touches with their prediction; ``summary``, five numbers of each parameter of each touch; ``tips``,
how probable each known tip is; and of a calibration ``noise``, ``mode``, ``laplace`` and ``extra``. What is text
(sensor, parameters, settings, notes) goes with them as attributes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from bayestouch.draws_on_file import DrawsOnFile, NoDraws
from bayestouch.errors import InputError
from bayestouch.noise import Noise
from bayestouch.parameter_text import parameters_from_json, parameters_to_json
from bayestouch.parameters import Parameter
from bayestouch.posterior_arrays import array_of, arrays_of, by_touch, dataset, group_of, own_dims
from bayestouch.results import Calibration, TouchPosteriors, TouchRows
from bayestouch.sensor import Sensor
from bayestouch.sensor_toml import sensor_from_toml, sensor_to_toml
from bayestouch.summaries import STATISTICS
from bayestouch.tip_probabilities import TipProbabilities

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
Groups: TypeAlias = "dict[str, xr.Dataset]"
Attributes: TypeAlias = dict[str, str]

#: Counted up when files of a new version cannot be read by an old one.
FORMAT = "1"

# Units of what follows from the parameters; {} stands for the unit of the readings.
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
_ROW_ARRAYS = ("predicted", "sd", "counts")


def calibration_groups(calibration: Calibration) -> tuple[Groups, Attributes]:
    """Groups and attributes of a calibration."""
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


def touch_groups(result: TouchPosteriors) -> tuple[Groups, Attributes]:
    """Groups and attributes of posteriors of touches."""
    units = _units(result.parameters, result.sensor)
    touch = {"touch": ("touch", result.rows.touch)}
    rows = _row_groups(result.rows, result.sensor, units)
    posterior = {name: (("chain", "draw", "touch"), values) for name, values in result.posterior.items()}
    groups = {
        **({"posterior": dataset(posterior, units).assign_coords(touch)} if posterior else {}),
        "sample_stats": by_touch(result.sample_stats, {}).assign_coords(touch),
        **rows,
        # The reference values of a touch file are those to hold the draws against, by the same names.
        "constant_data": by_touch(result.reference, units).assign_coords(touch),
    }
    if result.summary:
        summary = {name: (("statistic", "touch"), values) for name, values in result.summary.items()}
        statistic = {"statistic": ("statistic", np.array(STATISTICS, dtype=object))}
        groups["summary"] = dataset(summary, units).assign_coords(touch | statistic)
    if result.tips is not None:
        groups["tips"] = result.tips.to_group(result.rows.touch)
    return groups, _attributes("touches", result)


def calibration_from_groups(groups: Groups, attributes: Attributes) -> Calibration:
    """Rebuild a calibration; the inverse of `calibration_groups`.

    Raises
    ------
    InputError
        Something is missing or does not fit.
    """
    sensor, common = _common(groups, attributes)
    noise, laplace = group_of(groups, "noise"), group_of(groups, "laplace")
    m = sensor.n_elements
    layout = array_of(laplace, "row", (-1,), "OUT")
    return Calibration(
        sensor=sensor,
        mode=arrays_of(group_of(groups, "mode")),
        posterior=arrays_of(group_of(groups, "posterior"), "chain", "draw"),
        covariance=array_of(laplace, "covariance", (len(layout), len(layout))),
        layout=tuple(map(str, layout)),
        noise=Noise(
            tactile_sd=array_of(noise, "tactile_sd", (m,)),
            discrepancy_sd=array_of(noise, "discrepancy_sd", (m,)),
            signal_share=float(array_of(noise, "signal_share", ())),
            force_sd=float(array_of(noise, "force_sd", ())),
        ),
        rows=_rows(groups, sensor),
        statistics=_from_json(attributes, "statistics", dict),
        extra=arrays_of(group_of(groups, "extra")),
        **common,
    )


def touches_of(groups: Groups, attributes: Attributes, draws: DrawsOnFile | None = None) -> TouchPosteriors:
    """Rebuild posteriors of touches; the inverse of `touch_groups`.

    Parameters
    ----------
    groups, attributes
        As read.
    draws : DrawsOnFile, optional
        In place of the group ``posterior``, where that was left on file.

    Raises
    ------
    InputError
        Something is missing or does not fit.
    """
    sensor, common = _common(groups, attributes)
    rows = _rows(groups, sensor)
    t = len(rows.touch)
    summary = arrays_of(groups["summary"], "statistic", "touch") if "summary" in groups else {}
    for name, values in summary.items():
        if values.shape != (len(STATISTICS), t):
            raise InputError(f"expected an array of shape {(len(STATISTICS), t)}, got {values.shape}", column=name)
    in_memory = {}
    if draws is None and ("posterior" in groups or not summary):
        in_memory = arrays_of(group_of(groups, "posterior"), "chain", "draw", "touch")
    statistics, reference = arrays_of(group_of(groups, "sample_stats")), arrays_of(group_of(groups, "constant_data"))
    shapes = {name: values.shape for name, values in (in_memory | statistics | reference).items()}
    for name, shape in (shapes | dict(draws.shapes if draws is not None else {})).items():
        if shape[-1:] != (t,):
            raise InputError(f"expected {t} touches, got an array of shape {shape}", column=name)
    return TouchPosteriors(
        sensor=sensor,
        posterior=draws or in_memory or NoDraws(),
        sample_stats=statistics,
        reference=reference,
        rows=rows,
        tips=TipProbabilities.from_groups(groups, t),
        summary=summary,
        **common,
    )


def _row_groups(rows: TouchRows, sensor: Sensor, units: Mapping[str, str]) -> Groups:
    touch = {"touch": ("touch", rows.touch)}
    by_element = {name: (("touch", "element"), getattr(rows, name)) for name in _ROW_ARRAYS}
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


def _rows(groups: Groups, sensor: Sensor) -> TouchRows:
    rows, observed = group_of(groups, "rows"), group_of(groups, "observed_data")
    touch = array_of(rows, "touch", (-1,), "iu")
    shape = (len(touch), sensor.n_elements)
    arrays = {name: array_of(rows, name, shape) for name in _ROW_ARRAYS}
    return TouchRows(
        touch=touch,
        location={
            name.removeprefix("location_"): array_of(rows, name, shape[:1])
            for name in map(str, rows.data_vars)
            if name.startswith("location_")
        },
        radius_mm=array_of(rows, "radius_mm", shape[:1]),
        load=array_of(observed, "load", shape[:1]),
        observed=array_of(observed, "reading", shape),
        **arrays,
    )


def _units(parameters: tuple[Parameter, ...], sensor: Sensor) -> dict[str, str]:
    derived = {name: unit.replace("{}", sensor.reading_unit) for name, unit in _DERIVED_UNITS.items()}
    return derived | {parameter.name: parameter.unit for parameter in parameters}


def _attributes(kind: str, result: Calibration | TouchPosteriors) -> Attributes:
    return {
        "bayestouch": kind,
        "bayestouch_format": FORMAT,
        "sensor": sensor_to_toml(result.sensor),
        "sensor_notes": _to_json(result.sensor.notes),
        "parameters": parameters_to_json(result.parameters),
        "settings": _to_json(result.settings),
        "notes": _to_json(result.notes),
    }


def _common(groups: Groups, attributes: Attributes) -> tuple[Sensor, dict[str, Any]]:
    """The sensor, and what calibrations and posteriors of touches share."""
    from dataclasses import replace

    for name in ("sensor", "parameters"):
        if name not in attributes:
            raise InputError("missing from the posterior file", column=name)
    sensor = replace(sensor_from_toml(attributes["sensor"]), notes=tuple(_from_json(attributes, "sensor_notes", list)))
    return sensor, {
        "parameters": parameters_from_json(attributes["parameters"]),
        "settings": _from_json(attributes, "settings", dict),
        "notes": notes_of(attributes),
    }


def notes_of(attributes: Attributes) -> tuple[str, ...]:
    """Notes of a result, from the attributes of its file."""
    return tuple(_from_json(attributes, "notes", list))


def _to_json(value: Any) -> str:
    def plain(other: Any) -> Any:
        if isinstance(other, Mapping):
            return dict(other)
        if isinstance(other, np.generic):
            return other.item()
        raise InputError(f"cannot be saved: a {type(other).__name__} among settings, statistics or notes")

    return json.dumps(value, default=plain, ensure_ascii=False)


def _from_json(attributes: Attributes, name: str, kind: type) -> Any:
    try:
        value = json.loads(attributes[name])
    except (KeyError, ValueError, RecursionError):
        value = None
    if not isinstance(value, kind):
        raise InputError(f"expected JSON ({'an object' if kind is dict else 'a list'})", column=name)
    return value
