"""Posterior files: calibrations and posteriors of touches, saved in the ArviZ schema.

`az.from_netcdf` and `xarray.open_datatree` open the files; `bayestouch.results.groups` describes their content.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from bayestouch.data.arrays import nearest_turn, quantiles
from bayestouch.data.files import check_not_read
from bayestouch.results.data import CalibrationData, PosteriorsData
from bayestouch.results.draws_on_file import DrawsOnFile
from bayestouch.results.groups import Attributes, Groups, calibration_groups, touch_groups
from bayestouch.results.netcdf import write_groups
from bayestouch.results.schema import GROUPS, schema_attributes
from bayestouch.results.summaries import PROBABILITIES

if TYPE_CHECKING:
    import pandas as pd

AnyResult = TypeVar("AnyResult", CalibrationData, PosteriorsData)


def save_calibration(calibration: CalibrationData, path: str | Path) -> None:
    """Save a calibration as netCDF; the file is written completely or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    write_groups(path, *calibration_groups(calibration))


def save_touches(result: PosteriorsData, path: str | Path) -> None:
    """Save posteriors of touches as netCDF; raises as `save_calibration`, and if the file holds their draws."""
    if isinstance(result.posterior, DrawsOnFile):
        check_not_read(path, [result.posterior.path])
    write_groups(path, *touch_groups(result))


def without_requested(result: AnyResult) -> AnyResult:
    """Result without the groups that are written on request."""
    return replace(result, groups={name: group for name, group in result.groups.items() if name not in GROUPS})


def to_arviz(result: CalibrationData | PosteriorsData) -> Any:
    """Result as an ArviZ object: `InferenceData` before ArviZ 1.0, `xarray.DataTree` since then."""
    import arviz

    schema = schema_attributes()
    groups, attributes = _groups(result)
    groups = {name: group.assign_attrs(schema) for name, group in groups.items()}
    attributes |= schema
    # ArviZ 1 warns if the removed name is looked up as an attribute, so look into the module's dictionary.
    if "InferenceData" in vars(arviz):
        content: dict[str, Any] = dict(groups)
        return arviz.InferenceData(attrs=attributes, **content)
    import xarray as xr

    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=attributes), **groups})


def to_dataframe(
    result: CalibrationData | PosteriorsData, probabilities: Sequence[float] = (0.05, 0.5, 0.95)
) -> pd.DataFrame:
    """Table of mean, standard deviation and quantiles of every parameter.

    Parameters
    ----------
    result : Calibration or TouchPosteriors
        Result to summarise.
    probabilities : sequence of float
        Probabilities of the quantiles.

    Returns
    -------
    pandas.DataFrame
        One row for each parameter and each touch (or each element), in order: ``parameter``, ``touch`` or
        ``element`` (from 1 as in ``e01``; missing for a parameter that all elements share), ``unit``, ``mean``, ``sd``
        and the quantiles, by default ``q5``, ``q50``, ``q95``. Posteriors of touches have a last column ``reference``,
        and those of single samples a column ``sample`` after ``touch``.
    """
    import pandas as pd

    touches = isinstance(result, PosteriorsData)
    summary = result.estimates if isinstance(result, PosteriorsData) and tuple(probabilities) == PROBABILITIES else {}
    # If the summary is enough, draws that are on file are not read.
    groups, _ = _groups(replace(result, posterior={}) if isinstance(result, PosteriorsData) and summary else result)
    source = groups["summary" if summary else "posterior"]
    parts = []
    for name, variable in source.data_vars.items():
        if summary:
            statistics = summary[str(name)]
        else:
            draws = np.asarray(variable.values).reshape(variable.sizes["chain"] * variable.sizes["draw"], -1)
            with np.errstate(invalid="ignore"):  # r_c of a flat tip is infinite
                sd = draws.std(axis=0)
            statistics = np.stack([draws.mean(axis=0), sd, *quantiles(draws, probabilities, axis=0)])
        count = statistics.shape[1]
        place = source["touch"].values if touches else _elements(variable.dims, count)
        columns = {
            "parameter": np.full(count, str(name), dtype=object),
            "touch" if touches else "element": place,
            **({"sample": source["sample"].values} if "sample" in source.coords else {}),
            "unit": np.full(count, variable.attrs["units"], dtype=object),
        }
        names = ("mean", "sd", *(f"q{100 * p:g}" for p in probabilities))
        columns |= dict(zip(names, statistics, strict=True))
        if touches:
            reference = groups["constant_data"]
            stated = reference[name].values if name in reference else np.full(count, np.nan)
            # An angle may be stated from 0 to 360.
            columns["reference"] = nearest_turn(stated, statistics[0]) if name == "theta_c" else stated
        parts.append(pd.DataFrame(columns))
    return pd.concat(parts, ignore_index=True)


def _groups(result: CalibrationData | PosteriorsData) -> tuple[Groups, Attributes]:
    return calibration_groups(result) if isinstance(result, CalibrationData) else touch_groups(result)


def _elements(dims: tuple[Hashable, ...], count: int) -> pd.api.extensions.ExtensionArray:
    import pandas as pd

    if dims == ("chain", "draw"):
        return pd.array([pd.NA] * count, dtype="Int64")
    return pd.array(np.arange(1, count + 1), dtype="Int64")
