"""Posterior files: calibrations and posteriors of touches, saved in the ArviZ schema and read back.

`az.from_netcdf` and `xarray.open_datatree` open the files; see `bayestouch.posterior_groups` for what is in them.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bayestouch.arrays import quantiles
from bayestouch.errors import InputError, shown
from bayestouch.posterior_arrays import FloatArray, arrays_of, group_of
from bayestouch.posterior_file import read_groups, write_groups
from bayestouch.posterior_groups import (
    FORMAT,
    Attributes,
    Groups,
    calibration_from_groups,
    calibration_groups,
    notes_of,
    touch_groups,
    touches_of,
)
from bayestouch.results import Calibration, TouchPosteriors
from bayestouch.summaries import PROBABILITIES

if TYPE_CHECKING:
    import pandas as pd


def save_calibration(calibration: Calibration, path: str | Path) -> None:
    """Save a calibration as netCDF; the file is there whole or not at all.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    write_groups(path, *calibration_groups(calibration))


def save_touches(result: TouchPosteriors, path: str | Path) -> None:
    """Save posteriors of touches as netCDF; as `save_calibration`."""
    write_groups(path, *touch_groups(result))


def load(path: str | Path) -> Calibration | TouchPosteriors:
    """Read a posterior file, whichever of the two it holds.

    Draws of touches beyond 1 GB stay on file and are read when asked for.

    Raises
    ------
    InputError
        The file is missing, is no posterior file of bayestouch, is damaged, or was written by a later version.
    """
    groups, attributes, draws = read_groups(path)
    kind, form = attributes.get("bayestouch"), attributes.get("bayestouch_format", "")
    if kind not in ("calibration", "touches"):
        raise InputError("expected a posterior file that bayestouch wrote, got another netCDF file", file=path)
    if form != FORMAT:
        raise InputError(
            f"expected format {FORMAT}, got {shown(form)}: another version of bayestouch wrote it", file=path
        )
    try:
        if kind == "calibration":
            return calibration_from_groups(groups, attributes)
        return touches_of(groups, attributes, draws)
    except InputError as error:
        raise InputError(error.message, file=path, column=error.column) from None


def load_calibration(path: str | Path) -> Calibration:
    """Read a calibration; raises as `load`, and where the file holds posteriors of touches."""
    result = load(path)
    if not isinstance(result, Calibration):
        raise InputError("expected a calibration, found posteriors of touches", file=path)
    return result


def load_touches(path: str | Path) -> TouchPosteriors:
    """Read posteriors of touches; raises as `load`, and where the file holds a calibration."""
    result = load(path)
    if not isinstance(result, TouchPosteriors):
        raise InputError("expected posteriors of touches, found a calibration", file=path)
    return result


def load_grades(path: str | Path) -> tuple[dict[str, FloatArray], tuple[str, ...]]:
    """Read how good each touch of a file is, `TouchPosteriors.sample_stats`, and the notes; nothing else."""
    groups, attributes, _ = read_groups(path, only="sample_stats")
    return arrays_of(group_of(groups, "sample_stats"), "touch"), notes_of(attributes)


def to_arviz(result: Calibration | TouchPosteriors) -> Any:
    """Give a result to ArviZ: `InferenceData` before ArviZ 1.0, `xarray.DataTree` from there on."""
    import arviz

    groups, attributes = _groups(result)
    # Asking the module itself for what it no longer has makes ArviZ 1 warn.
    if "InferenceData" in vars(arviz):
        content: dict[str, Any] = dict(groups)
        return arviz.InferenceData(attrs=attributes, **content)
    import xarray as xr

    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=attributes), **groups})


def to_dataframe(
    result: Calibration | TouchPosteriors, probabilities: Sequence[float] = (0.05, 0.5, 0.95)
) -> pd.DataFrame:
    """Summarise the draws of every parameter.

    Parameters
    ----------
    result : Calibration or TouchPosteriors
        What to summarise.
    probabilities : sequence of float
        Probabilities of the quantiles.

    Returns
    -------
    pandas.DataFrame
        One row for each parameter and touch, in the order of the touches, or element: ``parameter``, ``touch`` or
        ``element`` (counted from 1 as in ``e01``; missing for what the elements share), ``unit``, ``mean``, ``sd``
        and the quantiles, ``q5``, ``q50``, ``q95`` by default. Posteriors of touches have a last column ``reference``.
    """
    import pandas as pd

    touches = isinstance(result, TouchPosteriors)
    summary = result.summary if isinstance(result, TouchPosteriors) and tuple(probabilities) == PROBABILITIES else {}
    # Draws that lie on file stay there where the summary serves.
    groups, _ = _groups(replace(result, posterior={}) if isinstance(result, TouchPosteriors) and summary else result)
    source = groups["summary" if summary else "posterior"]
    parts = []
    for name, variable in source.data_vars.items():
        if summary:
            statistics = summary[str(name)]
        else:
            draws = np.asarray(variable.values).reshape(variable.sizes["chain"] * variable.sizes["draw"], -1)
            with np.errstate(invalid="ignore"):  # a flat tip's r_c is infinite
                sd = draws.std(axis=0)
            statistics = np.stack([draws.mean(axis=0), sd, *quantiles(draws, probabilities, axis=0)])
        count = statistics.shape[1]
        place = source["touch"].values if touches else _elements(variable.dims, count)
        columns = {
            "parameter": np.full(count, str(name), dtype=object),
            "touch" if touches else "element": place,
            "unit": np.full(count, variable.attrs["units"], dtype=object),
        }
        names = ("mean", "sd", *(f"q{100 * p:g}" for p in probabilities))
        columns |= dict(zip(names, statistics, strict=True))
        if touches:
            reference = groups["constant_data"]
            columns["reference"] = reference[name].values if name in reference else np.full(count, np.nan)
        parts.append(pd.DataFrame(columns))
    return pd.concat(parts, ignore_index=True)


def _groups(result: Calibration | TouchPosteriors) -> tuple[Groups, Attributes]:
    return calibration_groups(result) if isinstance(result, Calibration) else touch_groups(result)


def _elements(dims: tuple[Hashable, ...], count: int) -> pd.api.extensions.ExtensionArray:
    import pandas as pd

    if dims == ("chain", "draw"):
        return pd.array([pd.NA] * count, dtype="Int64")
    return pd.array(np.arange(1, count + 1), dtype="Int64")
