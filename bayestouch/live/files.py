"""File of a live reader: a calibration file with one more group, the tables of the reader."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.results.groups import calibration_groups
from bayestouch.results.netcdf import read_groups, write_groups
from bayestouch.results.objects import Calibration
from bayestouch.results.reading import load_calibration

GROUP = "live"


def save_setup(path: str | Path, calibration: Calibration, arrays: Mapping[str, FloatArray]) -> None:
    """Write a calibration with the tables of its live reader.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    import xarray as xr

    groups, attributes = calibration_groups(calibration)
    variables = {
        name: (tuple(f"{name}_{axis}" for axis in range(np.ndim(values))), values) for name, values in arrays.items()
    }
    write_groups(path, {**groups, GROUP: xr.Dataset(variables)}, attributes)


def load_setup(path: str | Path) -> tuple[Calibration, dict[str, FloatArray] | None]:
    """Calibration and tables from a file of `save_setup`; no tables if it is a mere calibration file.

    Raises
    ------
    InputError
        If the file is missing or damaged, or holds no calibration.
    """
    calibration = load_calibration(path)
    groups, _, _, _ = read_groups(path, only=GROUP)
    if GROUP not in groups:
        return calibration, None
    return calibration, {str(name): np.asarray(each.values) for name, each in groups[GROUP].data_vars.items()}
