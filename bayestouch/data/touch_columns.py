"""Names and allowed values of the columns of a touch table."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.data.arrays import MAX_ID
from bayestouch.data.geometry import geometries
from bayestouch.data.sensor import Sensor
from bayestouch.data.tables import Header
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError, few, misspelt, nearest

#: Columns that have the same name for every sensor.
COMMON = ("touch", "sample", "time_s", "indenter_radius_mm", "depth_mm", "contact", "reads")

#: Largest measured number: squares of readings in units of their noise stay numbers of 32 bits. And the largest time,
#: whose squares are numbers of 64 bits; a clock may count from any zero, in any unit.
LARGEST, LARGEST_TIME = 1e12, 1e30
#: Columns whose own rule has a limit.
_COUNTS = frozenset({"touch", "sample", "contact", "reads"})

#: Unknown names of a header for which the known one is looked for.
_ASKED = 100

_ELEMENT = re.compile(r"e([0-9]{1,9})")
_ELEMENT_SD = re.compile(r"e([0-9]{1,9})_sd")


class Columns(NamedTuple):
    """Column names: readings, their sd by element (None if absent), all number columns; and those not in the header."""

    readings: tuple[str, ...]
    readings_sd: tuple[str | None, ...]
    numeric: frozenset[str]
    absent: frozenset[str]

    def unknown_among(self, names: tuple[str, ...]) -> str:
        """Names of a header that are not used, as text, with known names that may be meant; empty if there are none."""
        unknown = [name for name in names if name not in self.numeric]
        meant = {nearest(name, self.absent) for name in unknown[:_ASKED]}
        return few(unknown) + "".join(sorted(meant))


def load_columns() -> frozenset[str]:
    """Columns of the load on any body."""
    return frozenset(body.load_column for body in geometries().values())


def element_name(index: int) -> str:
    """Return the column name of element `index`, counted from 0: e01, e02 …"""
    return f"e{index + 1:02d}"


def understand(header: Header, sensor: Sensor, *, location: bool) -> Columns:
    """Return the columns of a sensor's touch table that a header contains.

    Parameters
    ----------
    location : bool
        Whether the reference location is required.

    Raises
    ------
    InputError
        A column is missing; an element is missing or occurs twice; or the sensor has another number of elements.
    """
    names, file, row = header.names, header.file, header.row
    body = sensor.body
    if "touch" not in names:
        found = few(names)
        raise InputError(f"expected a header with this column, found {found}", file=file, row=row, column="touch")
    for other in load_columns() - {body.load_column}:
        if other in names and body.load_column not in names:
            expected = f"expected {body.load_column} ({body.load_unit}) on a {body.kind}"
            raise InputError(f"{expected}, found {other}", file=file, row=row, column=other)
    here = [name for name in body.location_columns if name in names]
    for name in body.location_columns:
        if name not in names and (location or here):
            kind = f"{body.kind} in the plane" if name == "y_mm" else body.kind
            known = {*COMMON, *load_columns(), *body.location_columns}
            message = f"missing: the reference location on a {kind}{misspelt(name, set(names) - known)}"
            raise InputError(message, file=file, row=row, column=name)
    readings = _elements(header, sensor)
    sds: dict[int, str] = {}
    for name in names:
        if (match := _ELEMENT_SD.fullmatch(name)) and 1 <= (number := int(match[1])) <= sensor.n_elements:
            if number in sds:
                raise InputError(f"the same as {sds[number]}", file=file, row=row, column=name)
            sds[number] = name
    numeric = {*COMMON, body.load_column, *body.location_columns, *readings, *sds.values()}
    return Columns(
        readings=readings,
        readings_sd=tuple(sds.get(i) for i in range(1, sensor.n_elements + 1)),
        numeric=frozenset(numeric & set(names)),
        absent=frozenset(numeric - set(names)),
    )


def _elements(header: Header, sensor: Sensor) -> tuple[str, ...]:
    found: dict[int, str] = {}
    for name in header.names:
        if match := _ELEMENT.fullmatch(name):
            number = int(match[1])
            if number == 0:
                message = "elements are counted from e01"
                raise InputError(message, file=header.file, row=header.row, column=name)
            if number in found:
                message = f"the same element as {found[number]}"
                raise InputError(message, file=header.file, row=header.row, column=name)
            found[number] = name
    last = element_name(sensor.n_elements - 1)
    expected = (
        f"expected readings of {sensor.n_elements} elements (e01 … {last}), "
        f"one for each of {sensor.body.elements_key} in sensor.toml, found {len(found) or 'none'}"
    )
    if not found:
        raise InputError(expected, file=header.file, row=header.row, column="e01")
    for number in range(1, len(found) + 1):
        if number not in found:
            column = element_name(number - 1)
            others = [name for name in header.names if not (_ELEMENT.fullmatch(name) or _ELEMENT_SD.fullmatch(name))]
            message = f"missing: {expected}{misspelt(column, others)}"
            raise InputError(message, file=header.file, row=header.row, column=column)
    if len(found) != sensor.n_elements:
        raise InputError(expected, file=header.file, row=header.row)
    return tuple(found[number] for number in sorted(found))


def check_values(columns: Mapping[str, FloatArray], *, file: str | Path, line: npt.ArrayLike | None = None) -> None:
    """Raise an error if a known column of a table has a value that is not allowed, or rows contradict each other.

    Parameters
    ----------
    columns : mapping of column name to array, shape (n_rows,)
    line : int array, shape (n_rows,), optional
        Line number of each row in the file; by default rows are counted from line 2.

    Raises
    ------
    InputError
        A value is not allowed in its column (the first such row is named); a sample occurs twice; a touch has
        two indenters.
    """
    lines = np.arange(2, 2 + len(columns["touch"])) if line is None else np.asarray(line)
    if fault := _first_fault(columns):
        index, name, message = fault
        raise InputError(message, file=file, row=int(lines[index]), column=name)
    _check_samples(columns, lines, file)
    _check_indenters(columns, lines, file)


def check_in_memory(touches: Touches, *, file: str | Path | None = None) -> None:
    """Raise an error if a table in memory has a value that is not allowed in its column of a file.

    Raises
    ------
    InputError
        The message names the column, and the first such row, counted from 0 as in the arrays.
    """
    names = ("time_s", "indenter_radius_mm", "angle_deg", "x_mm", "y_mm", "load", "depth_mm", "contact", "reads")
    columns = {name: values for name in names if (values := getattr(touches, name)) is not None}
    for values, suffix in ((touches.readings, ""), (touches.readings_sd, "_sd")):
        # Most of the numbers are here: each is looked at once, and the rules are for tables with a fault.
        if values is not None and not _ordinary(values, 0.0 if suffix else -LARGEST):
            columns |= {element_name(k) + suffix: values[:, k] for k in range(touches.n_elements)}
    if fault := _first_fault(columns):
        index, name, message = fault
        raise InputError(f"{message} (rows counted from 0)", file=file, row=index, column=name)


def _ordinary(values: FloatArray, lowest: float) -> bool:
    """Whether all values are in a range up to `LARGEST`, or NaN."""
    low, high = np.fmin.reduce(values, axis=None, initial=0.0), np.fmax.reduce(values, axis=None, initial=0.0)
    return bool(low >= lowest and high <= LARGEST)


def _first_fault(columns: Mapping[str, FloatArray]) -> tuple[int, str, str] | None:
    """Row, column and message of the first value that is not allowed in its column; None if there is none."""
    faults = []
    for name, values in columns.items():
        for allowed, expected in _rules(name):
            if len(bad := np.flatnonzero(~allowed(values))):
                faults.append((int(bad[0]), name, expected))
    if not faults:
        return None
    index, name, expected = min(faults)
    value = columns[name][index]
    got = "nothing" if np.isnan(value) else repr(float(value)).removesuffix(".0")
    return index, name, f"expected {expected}, got {got}"


def _check_samples(columns: Mapping[str, FloatArray], lines: npt.NDArray[np.int64], file: str | Path) -> None:
    if "sample" not in columns:
        return
    touch, sample = columns["touch"], columns["sample"]
    order = np.lexsort((np.arange(len(touch)), sample, touch))
    again = (np.diff(touch[order]) == 0) & (np.diff(sample[order]) == 0)
    if again.any():
        at = int(np.flatnonzero(again)[np.argmin(order[1:][again])])
        first, second = order[at], order[at + 1]
        message = f"touch {touch[second]:.0f} has sample {sample[second]:.0f} twice, before in row {lines[first]}"
        raise InputError(message, file=file, row=int(lines[second]), column="sample")


def _check_indenters(columns: Mapping[str, FloatArray], lines: npt.NDArray[np.int64], file: str | Path) -> None:
    if "indenter_radius_mm" not in columns:
        return
    known = np.flatnonzero(~np.isnan(columns["indenter_radius_mm"]))
    touch, radius = columns["touch"][known], columns["indenter_radius_mm"][known]
    _, first, inverse = np.unique(touch, return_index=True, return_inverse=True)
    if len(other := np.flatnonzero(radius != radius[first][inverse])):
        at = int(other[0])
        message = f"touch {touch[at]:.0f} is made with one indenter: expected {radius[first][inverse][at]:g} mm"
        message += f" as in row {lines[known[first[inverse[at]]]]}, got {radius[at]:g}"
        raise InputError(message, file=file, row=int(lines[known[at]]), column="indenter_radius_mm")


Rule = tuple[Callable[[FloatArray], BoolArray], str]


def _integer(lowest: float) -> Callable[[FloatArray], BoolArray]:
    return lambda v: (v >= lowest) & (v > -MAX_ID) & (v < MAX_ID) & (v == np.floor(v))


def _or_nothing(allowed: Callable[[FloatArray], BoolArray]) -> Callable[[FloatArray], BoolArray]:
    return lambda v: np.isnan(v) | allowed(v)


_NUMBER: Rule = (lambda v: ~np.isinf(v), "a finite number or nothing")
_NOT_NEGATIVE: Rule = (_or_nothing(lambda v: (v >= 0) & np.isfinite(v)), "a number from 0 up or nothing")
_RULES: Mapping[str, Rule] = {
    "touch": (_integer(-np.inf), "an integer below 2^53"),
    "sample": (_integer(0), "an integer from 0 up"),
    "indenter_radius_mm": (
        _or_nothing(lambda v: v >= 0),
        "a radius from 0 (a knife edge) to inf (a flat) or nothing",
    ),
    "depth_mm": _NOT_NEGATIVE,
    "contact": (_or_nothing(lambda v: (v == 0) | (v == 1)), "0, 1 or nothing"),
    "reads": (_or_nothing(_integer(1)), "an integer from 1 up or nothing"),
}


def _up_to(largest: float) -> Rule:
    # An infinite value is not allowed by the other rule of its column, or is the radius of a flat.
    allowed = _or_nothing(lambda v: (np.abs(v) <= largest) | np.isinf(v))
    return allowed, f"a number from {-largest:.0e} to {largest:.0e}".replace("e+", "e")


_SIZE, _SIZE_OF_TIME = _up_to(LARGEST), _up_to(LARGEST_TIME)


def _rules(name: str) -> tuple[Rule, ...]:
    rule = _RULES.get(name, _NOT_NEGATIVE if name.endswith("_sd") else _NUMBER)
    return (rule,) if name in _COUNTS else (rule, _SIZE_OF_TIME if name == "time_s" else _SIZE)


def has_meaning(name: str, sensor: Sensor) -> bool:
    """Return True if a column of this name has a meaning for this sensor."""
    sd = _ELEMENT_SD.fullmatch(name)
    return bool(
        name in (*COMMON, sensor.body.load_column, *sensor.body.location_columns)
        or _ELEMENT.fullmatch(name)
        or (sd and 1 <= int(sd[1]) <= sensor.n_elements)
    )
