"""Reading and writing of touch tables: `calibration.csv`, `touches.csv`, or the same in Parquet."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import read_only
from bayestouch.data.files import write_together
from bayestouch.data.parquet import read_parquet, write_parquet
from bayestouch.data.remarks import Tally, remarks
from bayestouch.data.sensor import Sensor
from bayestouch.data.table_writing import write_csv
from bayestouch.data.tables import Header, RawTable, read_csv
from bayestouch.data.touch_columns import (
    Columns,
    check_values,
    element_name,
    has_meaning,
    load_columns,
    understand,
)
from bayestouch.data.touches import Touches, numbered
from bayestouch.errors import InputError


def read_touches(path: str | Path, sensor: Sensor, *, location: bool = False) -> Touches:
    """Return the touches of a touch table.

    Parameters
    ----------
    path : str or Path
        CSV, or Parquet if the name ends in ``.parquet``.
    sensor : Sensor
        Determines the names of the columns and the number of elements.
    location : bool
        Whether the reference location is required (calibration needs it, inference does not).

    Returns
    -------
    Touches
        `notes` lists the irregularities that were corrected.

    Raises
    ------
    InputError
        One line with file, row and column.
    """
    found: list[Columns] = []

    def schema(header: Header) -> frozenset[str]:
        found.append(understand(header, sensor, location=location))
        return found[0].numeric

    read = read_parquet if Path(path).suffix == ".parquet" else read_csv
    table = read(path, schema)
    check_values(table.numbers, file=table.header.file, line=table.line)
    touches = touches_of_table(table, found[0], sensor)
    return touches.with_(notes=(*touches.notes, *notes_on(table.header, found[0], Tally.of(touches))))


def write_touches(touches: Touches, path: str | Path, sensor: Sensor) -> None:
    """Write a touch table: Parquet if the name ends in ``.parquet``, CSV otherwise.

    The file is written completely or not at all. `read_touches` returns the same touches.

    Raises
    ------
    InputError
        The touches do not fit the sensor, contain a value that the format does not allow, or cannot be written.
    """
    write_together({Path(path): touches_writer(touches, Path(path), sensor)})


def touches_writer(touches: Touches, path: Path, sensor: Sensor) -> Callable[[Path], None]:
    """Return a function that writes these touches to a path (see `bayestouch.data.files.write_together`).

    Parameters
    ----------
    path : Path
        Final path of the file: its suffix determines the format, and error messages name it.

    Raises
    ------
    InputError
        The touches do not fit the sensor or contain a value that the format does not allow.
    """
    columns = table_columns(touches, sensor, path)
    numbers = {name: values for name, values in columns.items() if has_meaning(name, sensor)}
    check_values({name: np.asarray(v, dtype=np.float64) for name, v in numbers.items()}, file=path)
    write = write_parquet if path.suffix == ".parquet" else write_csv
    return lambda temporary: write(temporary, columns)


def check_fit(touches: Touches, sensor: Sensor, *, file: str | Path | None = None) -> None:
    """Raise an error if touches do not fit a sensor.

    Raises
    ------
    InputError
        They are no touches, or the number of elements or the location columns differ from the sensor's.
    """
    if not isinstance(touches, Touches):
        raise InputError(f"expected touches, got {type(touches).__name__}; read_touches reads their file", file=file)
    if touches.n_elements != sensor.n_elements:
        message = f"expected readings of {sensor.n_elements} elements, got {touches.n_elements}"
        raise InputError(message, file=file)
    here = {name for name in ("angle_deg", "x_mm", "y_mm") if getattr(touches, name) is not None}
    if here and here != set(sensor.body.location_columns):
        expected = " and ".join(sensor.body.location_columns)
        raise InputError(f"expected the location in {expected}, got {', '.join(sorted(here))}", file=file)


def touches_of_table(table: RawTable, columns: Columns, sensor: Sensor) -> Touches:
    """Return the touches of a checked table, or of a piece of it with complete touches."""
    n = len(table.line)
    touch = table.numbers["touch"].astype(np.int64)
    # The arrays belong to this table alone: those that cannot be written to are not copied.
    unknown = read_only(np.full(n, np.nan))
    numbers = {name: read_only(values) for name, values in table.numbers.items()}

    def maybe(name: str) -> FloatArray | None:
        return numbers.get(name)

    def column(name: str) -> FloatArray:
        return numbers.get(name, unknown)

    sample = maybe("sample")
    sds = [unknown if name is None else numbers[name] for name in columns.readings_sd]
    locations = {name: maybe(name) for name in sensor.body.location_columns}
    return Touches(
        touch=touch,
        sample=numbered(touch) if sample is None else sample.astype(np.int64),
        time_s=column("time_s"),
        indenter_radius_mm=column("indenter_radius_mm"),
        angle_deg=locations.get("angle_deg"),
        x_mm=locations.get("x_mm"),
        y_mm=locations.get("y_mm"),
        load=column(sensor.body.load_column),
        depth_mm=column("depth_mm"),
        contact=column("contact"),
        readings=read_only(np.stack([numbers[name] for name in columns.readings], axis=1)),
        readings_sd=read_only(np.stack(sds, axis=1)) if any(columns.readings_sd) else None,
        reads=maybe("reads"),
        extra={name: read_only(values) for name, values in table.texts.items()},
        notes=table.notes,
    )


def notes_on(header: Header, columns: Columns, tally: Tally) -> tuple[str, ...]:
    """Return the notes on a whole table.

    Raises
    ------
    InputError
        The table has no reading at all.
    """
    file, notes = header.file, []
    if not tally.there.any():
        raise InputError("no reading in any row of any element", file=file, column=columns.readings[0])
    if "sample" not in columns.numeric and tally.touches < tally.rows:
        notes.append(f"{file.name}: no column sample, rows of the same touch are numbered in order")
    if unknown := columns.unknown_among(header.names):
        notes.append(f"{file.name}: columns not known here, kept and not used: {unknown}")
    return (*notes, *(f"{file.name}: {remark}" for remark in remarks(tally)))


def table_columns(touches: Touches, sensor: Sensor, file: str | Path) -> dict[str, npt.NDArray[Any]]:
    """Return the columns of a touch table by name, in the order of the format, without those unknown in every row."""
    check_fit(touches, sensor, file=file)
    if touches.n_rows == 0:
        raise InputError("expected at least one touch to write, got none", file=file)
    columns: dict[str, npt.NDArray[Any]] = {"touch": touches.touch, "sample": touches.sample}
    optional = {
        "time_s": touches.time_s,
        "indenter_radius_mm": touches.indenter_radius_mm,
        sensor.body.load_column: touches.load,
        "depth_mm": touches.depth_mm,
        "contact": touches.contact,
    }
    # If the further columns contain the load of the other body, the load is written even if unknown:
    # otherwise that column would look like a load in the wrong unit.
    needed = {sensor.body.load_column} if touches.extra.keys() & load_columns() else set()
    known = {name: v for name, v in optional.items() if name in needed or not np.isnan(v).all()}
    for name in sensor.body.location_columns:
        if (location := getattr(touches, name)) is not None:
            known[name] = location
    order = (
        "time_s",
        "indenter_radius_mm",
        *sensor.body.location_columns,
        sensor.body.load_column,
        "depth_mm",
    )
    columns |= {name: known[name] for name in (*order, "contact") if name in known}
    if touches.reads is not None:
        columns["reads"] = touches.reads
    columns |= {element_name(k): touches.readings[:, k] for k in range(touches.n_elements)}
    if touches.readings_sd is not None:
        columns |= {f"{element_name(k)}_sd": touches.readings_sd[:, k] for k in range(touches.n_elements)}
    for name, values in touches.extra.items():
        if has_meaning(name, sensor) or name != name.strip() or not name:
            raise InputError("a further column cannot be called this", file=file, column=repr(name))
        columns[name] = values
    return columns
