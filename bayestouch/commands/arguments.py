"""Arguments that name a data set, a touch table, a calibration or a diagnosis; errors say which command makes them."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from bayestouch.commands.folders import workplace
from bayestouch.errors import InputError, few

if TYPE_CHECKING:
    from bayestouch.data.dataset import DataSet
    from bayestouch.results.objects import Calibration


def dataset_at(path: Path) -> DataSet:
    """Return the data set in a folder.

    Raises
    ------
    InputError
        If there is none, with what to do; or as `bayestouch.load_dataset`.
    """
    import bayestouch

    if not path.exists():
        raise InputError(f"no such folder; start a data set with: {_typed('init', path)}", file=path)
    if path.is_file():
        beside = f"; did you mean {path.parent}?" if (path.parent / "sensor.toml").is_file() else ""
        raise InputError(f"expected the folder of a data set, this is a file{beside}", file=path)
    if not (path / "sensor.toml").exists():
        inside = workplace(path).datasets
        hint = f"data sets in it: {few(inside)}" if inside else f"start one with: {_typed('init', path)}"
        raise InputError(f"has no sensor.toml, so it is no data set; {hint}", file=path)
    return bayestouch.load_dataset(path)


def table_at(path: Path) -> Path:
    """Return the path of a touch table.

    Raises
    ------
    InputError
        If there is no such file, or it is a folder, with what to do.
    """
    if path.is_dir():
        tables = [path / name for name in ("touches.csv", "touches.parquet") if (path / name).is_file()]
        hint = f"; did you mean {tables[0]}?" if tables else ""
        raise InputError(f"expected a table of touches, this is a folder{hint}", file=path)
    if not path.exists():
        raise InputError("no such file; expected a table of touches, such as touches.csv of a data set", file=path)
    return path


def calibration_at(path: Path, table: Path | None = None) -> Calibration:
    """Return the calibration in a file; `table` holds the touches that it is for.

    Raises
    ------
    InputError
        If there is none, with what to do; or as `bayestouch.load`.
    """
    import bayestouch

    if not path.exists() or path.is_dir():
        what = "expected a file, this is a folder" if path.is_dir() else "no such file"
        raise InputError(f"{what}; {_calibrations_near(path, table)}", file=path)
    found = bayestouch.load(path)
    if not isinstance(found, bayestouch.Calibration):
        raise InputError(
            f"expected a calibration, found posteriors of touches; {_calibrations_near(path, table)}", file=path
        )
    return found


def diagnosis_at(path: Path, dataset: Path | None = None) -> Path:
    """Return the folder of a diagnosis.

    Raises
    ------
    InputError
        If it has none, with what to do.
    """
    if not (path / "diagnosis.json").is_file():
        command = _typed("diagnose", dataset or "my-finger", "-o", path)
        raise InputError(f"has no diagnosis.json; make a diagnosis with: {command}", file=path)
    return path


def model_at(path: Path, dataset: Path) -> Path:
    """Return the path of a model.toml, or of the one in the folder of a diagnosis.

    Raises
    ------
    InputError
        If there is none, with what to do.
    """
    file = path / "model.toml" if path.is_dir() else path
    if not file.exists():
        folder = path if path.is_dir() or not path.suffix else path.parent
        raise InputError(f"no such file; make it with: {_typed('diagnose', dataset, '-o', folder)}", file=file)
    return file


def _calibrations_near(path: Path, table: Path | None) -> str:
    """What to do without this calibration: take one beside it, or make one."""
    folder = path if path.is_dir() else path.parent
    near = [name for name in workplace(folder).calibrations if folder / name != path]
    if near:
        return f"did you mean {folder / near[0]}?"
    data = table.parent if table is not None and (table.parent / "sensor.toml").is_file() else "my-finger"
    target = path / "calibration.nc" if path.is_dir() else path if not path.exists() else "calibration.nc"
    return f"make one with: {_typed('calibrate', data, '-o', target)}"


def _typed(*words: str | Path) -> str:
    return shlex.join(("bayestouch", *map(str, words)))
