"""What the summary of each class says: lines of plain text, the first says what the object is."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bayestouch.arrays import FloatArray
from bayestouch.diagnosis.outcome import sentences
from bayestouch.draws_on_file import DrawsOnFile
from bayestouch.errors import few
from bayestouch.reporting.text import fixed, number, plural, plus_minus

if TYPE_CHECKING:
    from bayestouch.checking import DataCheck
    from bayestouch.comparison import Comparison
    from bayestouch.dataset import DataSet
    from bayestouch.diagnosis.result import Diagnosis
    from bayestouch.parameters import Parameter
    from bayestouch.ranks import RankStatistics
    from bayestouch.reporting import Report
    from bayestouch.results import Calibration, TouchPosteriors
    from bayestouch.sensor import Sensor
    from bayestouch.simulation import SimulatedDataSet
    from bayestouch.touches import Touches

#: Tuples up to this length are shown whole.
_SHOWN = 6
_PLAIN = (str, int, float, type(None))


def lines_of(value: object) -> list[str]:
    """Lines of the summary of an object; of a class without lines of its own, its fields in short."""
    for each in type(value).__mro__:
        if each.__name__ in _LINES:
            return _LINES[each.__name__](value)
    return [_fields(value)]


def _fields(value: Any) -> str:
    inside = ", ".join(f"{each.name}={_short(getattr(value, each.name))}" for each in fields(value))
    return f"{type(value).__name__}({inside})"


def _short(value: Any) -> str:
    """One value of a field: arrays and what is long by kind, size and range."""
    if isinstance(value, np.ndarray):
        return f"array of {'×'.join(map(str, value.shape))}{_range(value)}"
    if isinstance(value, Mapping):
        return f"{{{few([str(name) for name in value])}}}"
    if isinstance(value, tuple | list):
        if len(value) <= _SHOWN and all(isinstance(each, _PLAIN) for each in value):
            return f"({', '.join(map(_plain, value))})"
        return plural(len(value), "value") + _range(value)
    if is_dataclass(value):
        plain = all(isinstance(getattr(value, each.name), _PLAIN) for each in fields(value))
        return _fields(value) if plain else f"{type(value).__name__}(…)"
    return _plain(value)


def _plain(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else few([repr(value)], length=60)


def _range(values: Any) -> str:
    try:
        known = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        return ""
    known = known[~np.isnan(known)]
    if not known.size:
        return ""
    low, high = _size(known.min()), _size(known.max())
    return f" all {low}" if low == high else f" from {low} to {high}"


def _size(value: Any) -> str:
    return "∞" if value == np.inf else number(float(value))


def _sensor_in_short(sensor: Sensor) -> str:
    return f"{sensor.name[:60]!r}: a {sensor.body.kind} of {plural(sensor.n_elements, 'element')}"


def _sensor(sensor: Sensor) -> list[str]:
    noise = "" if sensor.force_noise_sd is None else f"± {number(sensor.force_noise_sd)} {sensor.body.load_unit}"
    quantity = " ".join(filter(None, [sensor.reading_quantity, sensor.reading_unit])) or "no unit stated"
    lines = [f"Sensor {_sensor_in_short(sensor)}", _fields(sensor.body), _fields(sensor.rubber)]
    return [*lines, f"force sensor {noise or 'not stated'}; readings: {quantity[:60]}"]


def _touches(touches: Touches) -> list[str]:
    counts = [plural(touches.n_touches, "touch"), plural(touches.n_rows, "row"), plural(touches.n_elements, "element")]
    lines = [f"Touches: {', '.join(counts)}"]
    radii = np.unique(touches.indenter_radius_mm[~np.isnan(touches.indenter_radius_mm)])
    if radii.size:
        lines.append(f"indenters r_c: {few([_size(radius) for radius in radii], 12)} mm")
    # a table on a finger has angles, one on a pad has places; without either the body is not known
    on_pad, on_finger = touches.x_mm is not None, touches.angle_deg is not None
    load_unit = " N/m" if on_finger else " N" if on_pad else ""
    columns = {
        "angle": (touches.angle_deg, "°"),
        "x": (touches.x_mm, " mm"),
        "y": (touches.y_mm, " mm"),
        "load": (touches.load, load_unit),
    }
    spans = [f"{name}{span}{unit}" for name, (column, unit) in columns.items() if (span := _range_of(column))]
    missing = int(np.isnan(touches.readings).sum())
    return [*lines, *filter(None, [", ".join(spans)]), f"readings{_range(touches.readings)}, {missing} missing"]


def _range_of(column: FloatArray | None) -> str:
    return "" if column is None else _range(column)


def _dataset(dataset: DataSet) -> list[str]:
    return [f"DataSet of {_sensor_in_short(dataset.sensor)}", *_tables(dataset)]


def _tables(dataset: DataSet) -> list[str]:
    lines = []
    for name, table in (("calibration", dataset.calibration), ("touches", dataset.touches)):
        if table is None:
            lines.append(f"{name}: none")
        else:
            load = f", load{span} {dataset.sensor.body.load_unit}" if (span := _range(table.load)) else ""
            lines.append(f"{name}: {plural(table.n_touches, 'touch')}, {plural(table.n_rows, 'row')}{load}")
    return [*lines, *_notes(dataset.notes), *([] if dataset.path is None else [f"from {_path(dataset.path)}"])]


def _simulated(simulated: SimulatedDataSet) -> list[str]:
    effects = ", ".join(f"{name} {size:g}" for name, size in simulated.truth["effects"].items()) or "none"
    first = f"SimulatedDataSet of {_sensor_in_short(simulated.dataset.sensor)}"
    return [first, *_tables(simulated.dataset), f"seed {simulated.truth['seed']}; effects: {effects}"]


def _check(check: DataCheck) -> list[str]:
    advice = check.facts["advice"]
    lacking = f"what these data lack: {' '.join(advice)}" if advice else "nothing is lacking for a report"
    return [f"DataCheck of {_sensor_in_short(check.dataset.sensor)}", *_tables(check.dataset), lacking]


def _calibration(calibration: Calibration) -> list[str]:
    numbers = calibration.statistics
    fit = f"error {number(numbers.get('error_percent_peak'))} % of the peak"
    fit += f" (noise {number(numbers.get('noise_percent_peak'))} %)"
    fit += f", lack of fit {number(numbers.get('lack_of_fit'))}"
    names = _effects(calibration)
    return [
        f"Calibration of {_sensor_in_short(calibration.sensor)}",
        f"{plural(len(calibration.rows.touch), 'touch')}, {_draws(calibration.posterior)}",
        fit,
        *([f"effects: {few(names, 8)}"] if names else []),
        "; ".join(filter(None, (_parameter(calibration, each) for each in calibration.parameters))),
        *_sampler(calibration),
        *_notes(calibration.notes),
    ]


def _parameter(calibration: Calibration, parameter: Parameter) -> str:
    """Mean ± sd; over the elements where there are several: range of the means ± the median sd."""
    if parameter.name not in calibration.posterior:
        return ""
    draws = np.asarray(calibration.posterior[parameter.name])
    each = draws.reshape(-1, *draws.shape[2:])
    mean, sd, unit = each.mean(axis=0), float(np.median(each.std(axis=0))), f" {parameter.unit}".rstrip()
    if mean.ndim == 0:
        return f"{parameter.symbol} {plus_minus(float(mean), sd)}{unit}"
    return f"{parameter.symbol}{_range(mean)}{unit} (± {number(sd, 2)})"


def _draws(posterior: Mapping[str, FloatArray]) -> str:
    shapes = posterior.shapes if isinstance(posterior, DrawsOnFile) else {k: v.shape for k, v in posterior.items()}
    for chains, draws, *_ in shapes.values():
        return f"{plural(chains, 'chain')} of {plural(draws, 'draw')}"
    return "summaries only"


def _effects(calibration: Calibration) -> list[str]:
    try:
        return list(json.loads(str(calibration.settings.get("effects", "{}")))["parameters"])
    except (KeyError, TypeError, ValueError):  # none, or a damaged text, which is refused where it is used
        return []


def _sampler(calibration: Calibration) -> list[str]:
    numbers, settings = calibration.statistics, calibration.settings
    if "ess_bulk" in numbers:
        return [f"effective sample size at least {numbers['ess_bulk']:.0f}, R-hat at most {fixed(numbers['rhat'], 3)}"]
    return [f"posterior: {settings[key]}" for key in ("sampler", "posterior") if key in settings]


def _posteriors(posteriors: TouchPosteriors) -> list[str]:
    count, missed = len(posteriors.rows.touch), posteriors.missed
    return [
        f"TouchPosteriors of {_sensor_in_short(posteriors.sensor)}",
        f"{plural(count, 'touch')}, {_draws(posteriors.posterior)}",
        f"{missed} of {count} missed the sampler's targets" if missed else "all meet the sampler's targets",
        *filter(None, (_estimates(posteriors, each) for each in posteriors.parameters)),
        *_notes(posteriors.notes),
    ]


def _estimates(posteriors: TouchPosteriors, parameter: Parameter) -> str:
    name, unit = parameter.name, f" {parameter.unit}".rstrip()
    # draws on file may be larger than memory: a summary does not read them
    in_memory = not isinstance(posteriors.posterior, DrawsOnFile) and name in posteriors.posterior
    if name not in posteriors.summary and not in_memory:
        return ""
    mean = posteriors.mean(name)
    if not mean.size or not np.isfinite(mean).all():  # r_c of a flat tip is infinite; its R is shown
        return ""
    middle, sd = (number(float(np.median(each)), 3) for each in (mean, posteriors.sd(name)))
    return f"{parameter.symbol}: median {middle},{_range(mean)}{unit}; median sd {sd}{unit}"


def _diagnosis(diagnosis: Diagnosis) -> list[str]:
    verdict, *_, errors = sentences(diagnosis.numbers)
    found = few(list(diagnosis.effects), 8) if diagnosis.effects else "none"
    return [
        f"Diagnosis of {_sensor_in_short(diagnosis.calibration_before.sensor)}",
        verdict,
        f"effects found: {found}",
        errors,
    ]


def _report(report: Report) -> list[str]:
    answer = report.numbers["answer"]
    verdict = [f"{row['question']} {row['short']}." for row in answer.get("verdict", ())]
    keys = [f"{row['quantity']}: {number(row['value'])} {row['unit']}".rstrip() for row in answer["key_numbers"]]
    first = f"Report in {_path(report.path)}, {plural(len(report.figures), 'figure')}"
    return [first, *verdict, *([", ".join(keys)] if keys else [])]


def _comparison(comparison: Comparison) -> list[str]:
    rows = len(comparison.numbers["parameters"])
    first = f"Comparison in {_path(comparison.path)}: {plural(rows, 'parameter')}, those of each element apart"
    return [first, *comparison.numbers["sentences"]]


def _ranks(ranks: RankStatistics) -> list[str]:
    count = len(next(iter(ranks.ranks.values())))
    worst = min(ranks.p_value, key=lambda name: ranks.p_value[name])
    spans = (_range(list(values.values())) for values in (ranks.mean_square, ranks.coverage_90))
    square, coverage = spans
    return [
        f"Ranks of {plural(count, 'simulation')}: {'uniform' if ranks.passes() else 'not uniform'} at 1 %",
        f"{plural(len(ranks.ranks), 'parameter')}, ranks among {ranks.ranked} draws",
        f"least p-value {number(ranks.p_value[worst])} ({worst[:60]}), threshold {number(ranks.threshold())}",
        f"mean square of the normal scores{square}; coverage of 90 % intervals{coverage}",
    ]


def _notes(notes: tuple[str, ...]) -> list[str]:
    return [f"{plural(len(notes), 'note')} in .notes"] if notes else []


def _path(path: Path) -> str:
    text = str(path)
    return text if len(text) <= 70 else f"…{text[-69:]}"


# by name: a summary of one class does not import the modules of all others
_LINES: dict[str, Callable[[Any], list[str]]] = {
    "Calibration": _calibration,
    "Comparison": _comparison,
    "DataCheck": _check,
    "DataSet": _dataset,
    "Diagnosis": _diagnosis,
    "RankStatistics": _ranks,
    "Report": _report,
    "Sensor": _sensor,
    "SimulatedDataSet": _simulated,
    "TouchPosteriors": _posteriors,
    "Touches": _touches,
}
