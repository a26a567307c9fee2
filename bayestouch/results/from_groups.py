"""Calibrations and posteriors rebuilt from groups of arrays: the inverse of `bayestouch.results.groups`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.data.sensor import Sensor
from bayestouch.data.sensor_toml import sensor_from_toml
from bayestouch.errors import InputError
from bayestouch.priors.parameter_text import parameters_from_json
from bayestouch.results.arrays import array_of, arrays_of, group_of
from bayestouch.results.data import TouchRows
from bayestouch.results.draws_on_file import DrawsOnFile, NoDraws
from bayestouch.results.groups import ROW_ARRAYS, ROW_READS, ROW_SAMPLE, Attributes, Groups
from bayestouch.results.keys import E_MAP, EFFECTS, IDENTIFIED_MAP
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.results.schema import GROUPS, LOG_DENSITY
from bayestouch.results.summaries import STATISTICS
from bayestouch.results.tips import TipProbabilities


def calibration_from_groups(groups: Groups, attributes: Attributes) -> Calibration:
    """Calibration from its groups; the inverse of `bayestouch.results.groups.calibration_groups`.

    Raises
    ------
    InputError
        If something is missing or inconsistent.
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
            # Files of earlier versions do not have it.
            load_scatter=float(array_of(noise, "load_scatter", ())) if "load_scatter" in noise else 0.0,
        ),
        rows=_rows(groups, sensor),
        statistics=_from_json(attributes, "statistics", dict),
        extra=_extra(groups, common["settings"]),
        **common,
    )


def touches_of(groups: Groups, attributes: Attributes, draws: DrawsOnFile | None = None) -> TouchPosteriors:
    """Posteriors of touches from their groups; the inverse of `bayestouch.results.groups.touch_groups`.

    Parameters
    ----------
    groups, attributes
        Content of the file.
    draws : DrawsOnFile, optional
        Draws on file, if the group ``posterior`` was not read into memory.

    Raises
    ------
    InputError
        If something is missing or inconsistent.
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
    statistics, reference = grades_of(groups), arrays_of(group_of(groups, "constant_data"))
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
        estimates=summary,
        **common,
    )


def grades_of(groups: Groups) -> dict[str, FloatArray]:
    """Grades (t,) of the draws of each touch, by name."""
    group = group_of(groups, "sample_stats")
    return arrays_of(group.drop_vars([name for name in group.data_vars if group[name].dims[:1] == ("chain",)]), "touch")


def _extra(groups: Groups, settings: Mapping[str, str | float]) -> dict[str, FloatArray]:
    """Arrays that only some calibrations have.

    Without any, the group is empty. ArviZ leaves out empty groups when it writes a file.
    """
    needed = EFFECTS in settings or settings.get(E_MAP) == IDENTIFIED_MAP
    return arrays_of(group_of(groups, "extra")) if needed or "extra" in groups else {}


def _requested(groups: Groups) -> dict[str, dict[str, FloatArray]]:
    """Groups that were asked for: arrays (chain, draw, ...) by group and variable."""
    found = {
        name: arrays_of(groups[name], "chain", "draw") for name in GROUPS if name in groups and groups[name].data_vars
    }
    if LOG_DENSITY in groups.get("sample_stats", {}):
        found["sample_stats"] = arrays_of(groups["sample_stats"][[LOG_DENSITY]], "chain", "draw")
    return found


def _rows(groups: Groups, sensor: Sensor) -> TouchRows:
    rows, observed = group_of(groups, "rows"), group_of(groups, "observed_data")
    touch = array_of(rows, "touch", (-1,), "iu")
    shape = (len(touch), sensor.n_elements)
    arrays = {name: array_of(rows, name, shape) for name in ROW_ARRAYS}
    # Rest readings had no noise in these files, and each sample had its own load.
    samples = arrays["counts"].max(axis=1, initial=0).astype(float)
    unknown = {"samples": samples, "load_reads": np.maximum(samples, 1.0)}
    reads = {name: array_of(rows, name, shape[:1]) if name in rows else unknown[name] for name in ROW_READS}
    return TouchRows(
        touch=touch,
        location={
            name.removeprefix("location_"): array_of(rows, name, shape[:1])
            for name in map(str, rows.data_vars)
            if name.startswith("location_")
        },
        radius_mm=array_of(rows, "radius_mm", shape[:1]),
        load=array_of(observed if "load" in observed else group_of(groups, "constant_data"), "load", shape[:1]),
        observed=array_of(observed, "reading", shape),
        **arrays,
        **reads,
        sample=array_of(rows, ROW_SAMPLE, shape[:1], "iu") if ROW_SAMPLE in rows else None,
    )


def _common(groups: Groups, attributes: Attributes) -> tuple[Sensor, dict[str, Any]]:
    """Sensor, and the fields that calibrations and posteriors of touches share."""
    from dataclasses import replace

    for name in ("sensor", "parameters"):
        if name not in attributes:
            raise InputError("missing from the posterior file", column=name)
    sensor = replace(sensor_from_toml(attributes["sensor"]), notes=tuple(_from_json(attributes, "sensor_notes", list)))
    return sensor, {
        "parameters": parameters_from_json(attributes["parameters"]),
        "settings": _from_json(attributes, "settings", dict),
        "notes": notes_of(attributes),
        "groups": _requested(groups),
    }


def notes_of(attributes: Attributes) -> tuple[str, ...]:
    """Notes of a result, from the attributes of its file."""
    return tuple(_from_json(attributes, "notes", list))


def _from_json(attributes: Attributes, name: str, kind: type) -> Any:
    try:
        value = json.loads(attributes[name])
    except (KeyError, ValueError, RecursionError):
        value = None
    if not isinstance(value, kind):
        raise InputError(f"expected JSON ({'an object' if kind is dict else 'a list'})", column=name)
    return value
