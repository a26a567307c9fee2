"""Data sets of named arrays with units: functions that make them, and functions that check and read them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


def dataset(variables: Mapping[str, tuple[tuple[str, ...], Any]], units: Mapping[str, str]) -> xr.Dataset:
    """Data set of variables (dimensions and values), each with its unit as an attribute.

    Chains and draws are numbered from 0. Elements have the names of the touch table, ``e01`` ...
    """
    import xarray as xr

    named = xr.Dataset(
        {name: (dims, np.asarray(values), {"units": units.get(name, "")}) for name, (dims, values) in variables.items()}
    )
    labels: dict[str, Any] = {name: np.arange(named.sizes[name]) for name in ("chain", "draw") if name in named.sizes}
    if "element" in named.sizes:
        labels["element"] = np.array([f"e{n + 1:02d}" for n in range(named.sizes["element"])], dtype=object)
    return named.assign_coords(labels)


def by_touch(values: Mapping[str, FloatArray], units: Mapping[str, str]) -> xr.Dataset:
    """Data set of (t,) arrays."""
    return dataset({name: (("touch",), array) for name, array in values.items()}, units)


def own_dims(name: str, count: int) -> tuple[str, ...]:
    """Names of `count` dimensions of the variable `name`, in the style of ArviZ's defaults."""
    return tuple(f"{name}_dim_{i}" for i in range(count))


def group_of(groups: Mapping[str, xr.Dataset], name: str) -> xr.Dataset:
    """Return the group with this name.

    Raises
    ------
    InputError
        If the group is missing.
    """
    if name not in groups:
        raise InputError(f"the group {name} is missing from the posterior file")
    return groups[name]


def array_of(group: xr.Dataset, name: str, shape: tuple[int, ...], kinds: str = "fiub") -> Any:
    """Values of a variable or coordinate, with shape and kind checked.

    Parameters
    ----------
    group : xarray.Dataset
        Group that contains the variable.
    name : str
        Name of the variable.
    shape : tuple of int
        Expected shape; -1 means any length.
    kinds : str
        Allowed kinds of values, as in `numpy.dtype.kind`.

    Raises
    ------
    InputError
        If the variable is missing, or has another shape or another kind.
    """
    if name not in group.variables:
        raise InputError("missing from the posterior file", column=name)
    values = group[name].values
    fits = len(values.shape) == len(shape) and all(e in (-1, n) for e, n in zip(shape, values.shape, strict=True))
    if not fits:
        raise InputError(f"expected an array of shape {shape}, got {values.shape}", column=name)
    if values.dtype.kind not in kinds:
        raise InputError(f"expected numbers, got {values.dtype}", column=name)
    return values


def arrays_of(group: xr.Dataset, *leading: str) -> dict[str, FloatArray]:
    """Every variable of a group by name; the first dimensions of each must be `leading`.

    Raises
    ------
    InputError
        If a variable has other dimensions or is not numeric.
    """
    arrays = {}
    for name, variable in group.data_vars.items():
        if tuple(map(str, variable.dims[: len(leading)])) != leading or variable.dtype.kind not in "fiub":
            found = f"{variable.dtype} by ({', '.join(map(str, variable.dims))})"
            raise InputError(f"expected numbers by ({', '.join(leading)} ...), got {found}", column=str(name))
        arrays[str(name)] = variable.values
    return arrays
