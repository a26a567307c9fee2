"""Arguments that name a data set, a touch table, a calibration or a diagnosis; errors say which command makes them."""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from bayestouch.commands.folders import workplace
from bayestouch.errors import InputError, few, similar

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
        fix = _similar(path, workplace(path.parent).datasets) or f"; start a data set with: {_typed('init', path)}"
        raise InputError(f"no such folder{fix}", file=path)
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
        names = (each.name for each in _files(path.parent) if each.suffix in (".csv", ".parquet"))
        fix = _similar(path, names) or "; expected a table of touches, such as touches.csv of a data set"
        raise InputError(f"no such file{fix}", file=path)
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
        fix = _similar(path, workplace(path.parent).diagnoses) or f"; make a diagnosis with: {command}"
        raise InputError(f"has no diagnosis.json{fix}", file=path)
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
        made_with = f"; make it with: {_typed('diagnose', dataset, '-o', folder)}"
        made = workplace(folder.parent).diagnoses
        models = [each.name for each in _files(path.parent) if each.suffix == ".toml" and each.name != "sensor.toml"]
        fix = _similar(path, models) or _similar(folder, made) or (_question(folder, made[0]) if made else "")
        raise InputError(f"no such file{fix or made_with}", file=file)
    return file


def _calibrations_near(path: Path, table: Path | None) -> str:
    """What to do without this calibration: take one beside it, or make one."""
    folder = path if path.is_dir() else path.parent
    near = [name for name in workplace(folder).calibrations if folder / name != path]
    if near:
        return (_similar(path, near) or _question(path, near[0])).removeprefix("; ")
    data = table.parent if table is not None and (table.parent / "sensor.toml").is_file() else "my-finger"
    target = path / "calibration.nc" if path.is_dir() else path if not path.exists() else "calibration.nc"
    return f"make one with: {_typed('calibrate', data, '-o', target)}"


def _similar(path: Path, names: Iterable[str]) -> str:
    """Question if one of the names beside a path is meant, empty if none is similar."""
    found = similar(path.name, (name for name in names if name != "."))
    return _question(path, found[0]) if found else ""


def _question(path: Path, name: str) -> str:
    """Question if the name beside a path is meant; ``.`` is the folder of the path."""
    return f"; did you mean {path.parent / name}?"


def _files(folder: Path) -> list[Path]:
    """Files and folders in a folder; none if it cannot be read."""
    try:
        return sorted(folder.iterdir())
    except OSError:
        return []


def _typed(*words: str | Path) -> str:
    return shlex.join(("bayestouch", *map(str, words)))
