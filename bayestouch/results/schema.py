"""What posterior files have of the ArviZ schema besides numbers: attributes of the library, coordinates of touches.

`GROUPS` are the groups that are written on request, because they are large.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError, nearest, shown
from bayestouch.results.data import TouchRows
from bayestouch.version import __version__

if TYPE_CHECKING:
    import xarray as xr

#: Groups of the ArviZ schema that are written on request. With ``log_likelihood`` comes ``lp`` in ``sample_stats``.
GROUPS = ("log_likelihood", "log_prior", "prior", "prior_predictive", "posterior_predictive")
LOG_DENSITY = "lp"
#: Arrays by group and variable: (chain, draw, ...).
Requested = dict[str, dict[str, FloatArray]]
#: Coordinates of touches besides their number, see `touch_coordinates`.
TOUCH_COORDINATES = ("index", "sample", "tip", "place", "place_x", "place_y")
#: Places are rounded to so many decimals, so that a mean over samples equals the number that the table states.
_DECIMALS = 6


def of_readings(values: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Simulated readings (n, t, m) as groups have them: (*shape, t, m), in single precision."""
    return np.asarray(values.reshape(*shape, *values.shape[1:]), dtype=np.float32)


def chosen_groups(names: str | Iterable[str]) -> tuple[str, ...]:
    """Names of groups in the order of `GROUPS`, from a list or from text such as ``log_likelihood,prior`` or ``all``.

    Raises
    ------
    InputError
        If a name is not among `GROUPS`.
    """
    if not isinstance(names, Iterable):
        raise InputError(f"groups: expected all, or some of {', '.join(GROUPS)}, got {shown(names)}")
    listed = [name.strip() for name in names.split(",") if name.strip()] if isinstance(names, str) else list(names)
    if listed == ["all"]:
        return GROUPS
    for name in listed:
        if name not in GROUPS:
            raise InputError(
                f"groups: expected all, or some of {', '.join(GROUPS)}, got {name!r}{nearest(str(name), GROUPS)}"
            )
    return tuple(name for name in GROUPS if name in listed)


def schema_attributes() -> dict[str, str]:
    """Attributes of the ArviZ schema: which library made the draws and the file, with its version, and when.

    The environment variable ``SOURCE_DATE_EPOCH`` (seconds since 1970) replaces the time, for files that are the same
    to the last byte whenever they are made.
    """
    stated = os.environ.get("SOURCE_DATE_EPOCH", "")
    time = datetime.fromtimestamp(int(stated), UTC) if stated.isdecimal() else datetime.now(UTC)
    return {"created_at": time.isoformat(timespec="seconds"), **_libraries()}


@cache
def _libraries() -> Mapping[str, str]:
    attributes = {
        "inference_library": "bayestouch",
        "inference_library_version": __version__,
        "creation_library": "bayestouch",
        "creation_library_version": __version__,
        "creation_library_language": "Python",
    }
    try:
        return attributes | {"arviz_version": version("arviz")}
    except PackageNotFoundError:
        return attributes


def touch_coordinates(rows: TouchRows, first: int = 0) -> dict[str, xr.Variable]:
    """Coordinates along ``touch``: what a touch is called, and with which tip and where it was made.

    Parameters
    ----------
    rows : TouchRows
        t touches.
    first : int
        Position of the first of them in the table.

    Returns
    -------
    dict of (t,) variables
        ``touch``, the number in the table; ``index``, the position in this result, from 0; ``sample``, the number
        within the touch, if each sample was read by itself; ``tip``, reference radius r_c of the indenter in mm (0
        knife edge, inf flat, NaN unknown); ``place``, reference location in degrees or mm,
        on a pad in two dimensions ``place_x`` and ``place_y``, rounded to six decimals, NaN unknown.
    """
    import xarray as xr

    def along(values: object, unit: str, meaning: str) -> xr.Variable:
        return xr.Variable(("touch",), np.asarray(values), {"units": unit, "long_name": meaning})

    places = {}
    for axis, values in rows.location.items():
        name = "place" if len(rows.location) == 1 else f"place_{axis}"
        unit = "degree" if axis == "theta_c" else "mm"
        places[name] = along(np.round(values, _DECIMALS), unit, f"reference location {axis}")
    sample = {} if rows.sample is None else {"sample": along(rows.sample, "", "number of the sample within the touch")}
    return {
        "touch": xr.Variable(("touch",), rows.touch),
        "index": along(first + np.arange(len(rows.touch)), "", "position in this result"),
        **sample,
        "tip": along(rows.radius_mm, "mm", "reference radius of the indenter"),
        **places,
    }
