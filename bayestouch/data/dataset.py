"""A data set: a folder with `sensor.toml`, `touches.csv` and, optionally, `calibration.csv`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal

from bayestouch.data.copies import notes_on_copies
from bayestouch.data.files import path_of, write_together
from bayestouch.data.sensor import Sensor
from bayestouch.data.sensor_toml import read_sensor, sensor_writer
from bayestouch.data.touch_columns import check_in_memory
from bayestouch.data.touch_table import check_fit, read_touches, table_columns, touches_writer
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError, not_a
from bayestouch.output.summary import Summarised, notes_line, path_in_short, span
from bayestouch.output.text import plural

if TYPE_CHECKING:
    from pandas import DataFrame

_TABLES, _FORMATS = ("touches", "calibration"), ("csv", "parquet")


@dataclass(frozen=True, eq=False, repr=False)
class DataSet(Summarised):
    """A sensor, its calibration touches and the touches to be read.

    Attributes
    ----------
    sensor : Sensor
    calibration : Touches or None
        Touches for calibration; None if the folder has none (see `bayestouch.data.splits.with_calibration`).
    touches : Touches
        Touches to be read.
    path : Path or None
        Folder from which the data set was read.
    notes : tuple of str
        Irregularities that were corrected while reading, for the report.

    Raises
    ------
    InputError
        The touches do not fit the sensor, or have a value that files may not have, such as an infinite reading.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> dataset
    DataSet of 'simulated finger': a finger of 4 elements
      calibration: 54 touches, 1080 rows, load from 159 to 239 N/m
      touches: 45 touches, 900 rows, load from 158 to 241 N/m
    >>> dataset.touches.readings.shape  # samples, elements
    (900, 4)
    """

    internal: ClassVar[frozenset[str]] = frozenset({"tables_in_short"})

    sensor: Sensor
    calibration: Touches | None
    touches: Touches
    path: Path | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in _TABLES:
            if (table := getattr(self, name)) is not None or name == "touches":
                check_fit(table, self.sensor, file=name)
                check_in_memory(table, file=name)

    def to_dataframe(self) -> DataFrame:
        """Return both tables as one data frame, one row per sample; column ``table`` names the table.

        A further column of the tables that is called ``table`` is left out.
        """
        import pandas as pd

        tables = {"calibration": self.calibration, "touches": self.touches}
        frames = [
            pd.DataFrame({"table": name} | table_columns(table, self.sensor, name) | {"table": name})
            for name, table in tables.items()
            if table is not None and table.n_rows
        ]
        return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=["table"])

    def summary_lines(self) -> list[str]:
        """Lines of the ``repr``."""
        return [f"DataSet of {self.sensor.in_short}", *self.tables_in_short()]

    def tables_in_short(self) -> list[str]:
        """Return one line for each table, one for the notes and one for the folder."""
        lines = []
        for name, table in (("calibration", self.calibration), ("touches", self.touches)):
            if table is None:
                lines.append(f"{name}: none")
            else:
                load = f", load{known} {self.sensor.body.load_unit}" if (known := span(table.load)) else ""
                lines.append(f"{name}: {plural(table.n_touches, 'touch')}, {plural(table.n_rows, 'row')}{load}")
        return [*lines, *notes_line(self.notes), *([] if self.path is None else [f"from {path_in_short(self.path)}"])]


def require_dataset(value: object) -> None:
    """Raise an error with the way to a data set if `value` is none.

    Raises
    ------
    InputError
        It is a path, a simulated data set with its truth, a table of touches or something else.
    """
    if isinstance(value, DataSet):
        return
    how = "use its attribute dataset" if hasattr(value, "dataset") else "read one: bayestouch.load_dataset(folder)"
    if isinstance(value, str | Path):
        how = f"read it: bayestouch.load_dataset({str(value)!r})"
    raise not_a("a data set", value, how)


def load_dataset(path: str | Path) -> DataSet:
    """Return the data set that a folder contains.

    Parameters
    ----------
    path : str or Path
        Folder with `sensor.toml`, `touches.csv` and optionally `calibration.csv`; either table may be
        `.parquet` instead.

    Returns
    -------
    DataSet
        Sensor, calibration touches and touches to be read.

    Raises
    ------
    InputError
        The folder or a file is missing, or a value is not allowed; one line names file, row and column.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> bayestouch.save_dataset(dataset, "my-finger")
    >>> bayestouch.load_dataset("my-finger").touches.n_touches
    45
    >>> bayestouch.load_dataset("your-finger")
    Traceback (most recent call last):
        ...
    bayestouch.errors.InputError: your-finger: no such folder
    """
    folder = path_of(path)
    try:
        there = folder.exists()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", file=folder) from error
    if not there:
        raise InputError("no such folder", file=folder)
    if not folder.is_dir():
        raise InputError("expected a folder with sensor.toml and touches.csv, got a file", file=folder)
    sensor = read_sensor(folder / "sensor.toml")
    calibration_file = _table(folder, "calibration")
    touches_file = _table(folder, "touches") or folder / "touches.csv"
    calibration = None
    if calibration_file is not None:
        calibration = read_touches(calibration_file, sensor, location=True)
    # Without a calibration table the touches are used for calibration, which needs their reference location.
    touches = read_touches(touches_file, sensor, location=calibration is None)
    names = "" if calibration_file is None else calibration_file.name, touches_file.name
    return DataSet(
        sensor=sensor,
        calibration=calibration,
        touches=touches,
        path=folder,
        notes=(
            *sensor.notes,
            *(calibration.notes if calibration else ()),
            *touches.notes,
            *notes_on_copies(calibration, touches, names),
        ),
    )


def save_dataset(dataset: DataSet, path: str | Path, format: Literal["csv", "parquet"] = "csv") -> None:
    """Write a data set to a folder (created if necessary); `load_dataset` returns the same data.

    After all new files are written, they replace those of a data set that was in the folder before; old tables
    that the new data set does not have are removed. Other files remain. If a file cannot be written, or has the name of
    a folder, nothing changes.

    Parameters
    ----------
    dataset : DataSet
        Data set to write.
    path : str or Path
        Folder to write; it is created if necessary.
    format : {"csv", "parquet"}
        Format of the two tables.

    Raises
    ------
    InputError
        It is no data set, the data do not fit the format, or the folder cannot be written to.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> bayestouch.save_dataset(dataset, "my-finger")
    >>> bayestouch.load_dataset("my-finger").touches.n_touches
    45
    """
    require_dataset(dataset)
    if format not in _FORMATS:
        raise InputError(f"expected the format csv or parquet, got {format!r}")
    folder = path_of(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make this folder: {error.strerror or error}", file=folder) from error
    tables = {"touches": dataset.touches, "calibration": dataset.calibration}
    writers = {folder / "sensor.toml": sensor_writer(dataset.sensor)}
    for name, touches in tables.items():
        if touches is not None:
            target = folder / f"{name}.{format}"
            writers[target] = touches_writer(touches, target, dataset.sensor)
    old = [file for file in dataset_files(folder) if file not in writers]
    for file in old:
        if file.is_dir():
            raise InputError("expected no folder of this name beside the tables of a data set", file=file)
    write_together(writers)
    _remove(old)


def dataset_files(folder: Path) -> list[Path]:
    """Return the paths that files of a data set can have."""
    return [folder / "sensor.toml", *(folder / f"{name}.{f}" for name in _TABLES for f in _FORMATS)]


def _table(folder: Path, name: str) -> Path | None:
    found = [folder / f"{name}.{format}" for format in _FORMATS if (folder / f"{name}.{format}").exists()]
    if len(found) > 1:
        raise InputError(f"expected {name}.csv or {name}.parquet, found both", file=folder)
    return found[0] if found else None


def _remove(files: Sequence[Path]) -> None:
    for file in files:
        try:
            file.unlink(missing_ok=True)
        except OSError as error:
            raise InputError(f"cannot be removed: {error.strerror or error}", file=file) from error
