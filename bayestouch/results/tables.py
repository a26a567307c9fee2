"""Short tables of results, as data frames: a row a touch, or a row a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bayestouch.results.selection import coordinates_of
from bayestouch.results.units import units_of

if TYPE_CHECKING:
    from pandas import DataFrame

    from bayestouch.results.data import CalibrationData, PosteriorsData


def touch_table(posteriors: PosteriorsData) -> DataFrame:
    """Return the mean and sd of every parameter, one row a touch, see `bayestouch.TouchPosteriors.summary`."""
    import pandas as pd

    from bayestouch.results.summary_table import SummaryTable

    columns = {name: values for name, values in coordinates_of(posteriors.rows).items() if name != "touch"}
    units = {parameter.name: parameter.unit for parameter in posteriors.parameters}
    known = {*posteriors.posterior, *posteriors.estimates}
    for name in units:
        if name in known:
            columns |= {name: posteriors.mean(name), f"{name}_sd": posteriors.sd(name)}
    columns["grade"] = posteriors.sample_stats["grade"].astype(int)
    table = SummaryTable(columns, index=pd.Index(posteriors.rows.touch, name="touch"))
    table.attrs["units"] = {name: units[name] for name in units if name in known}
    return table


def parameter_table(calibration: CalibrationData) -> DataFrame:
    """Return the posterior of every parameter, one row each, see `bayestouch.Calibration.summary`."""
    from bayestouch.results.summary_table import SummaryTable

    rows = {}
    for name, (symbol, unit, meaning, prior) in described(calibration).items():
        draws = np.asarray(calibration.posterior[name])
        mean, sd = (calibration.of_elements_read(each) for each in (draws.mean(axis=(0, 1)), draws.std(axis=(0, 1))))
        by_element = bool(mean.ndim)
        rows[name] = {
            "symbol": symbol,
            "unit": unit,
            "mean": float(mean.mean()),
            "sd": float(np.median(sd)),
            "lowest": float(mean.min()) if by_element else np.nan,
            "highest": float(mean.max()) if by_element else np.nan,
            "prior": prior,
            "meaning": meaning,
        }
    table = SummaryTable.from_dict(rows, orient="index")
    table.index.name = "parameter"
    return table


def described(calibration: CalibrationData) -> dict[str, tuple[str, str, str, str]]:
    """Return symbol, unit, meaning and prior of each parameter of the posterior, and of a finger's derived gain."""
    found = {
        each.name: (each.symbol, each.unit, each.description, str(each.prior))
        for each in calibration.parameters
        if each.name in calibration.posterior
    }
    if "gain" in calibration.posterior and "gain" not in found:
        unit = units_of(calibration)["gain"]
        found["gain"] = ("1/G", unit, "reading per unit of compressive strain (follows from the others)", "")
    return found
