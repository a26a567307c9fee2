"""netCDF files with several groups: written completely or not at all; content that is read is always checked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from bayestouch.data.files import check_room, reading, replacing
from bayestouch.errors import InputError
from bayestouch.results.draws_on_file import DrawsOnFile, stamp_of
from bayestouch.results.hdf5_heaps import check_heaps
from bayestouch.results.schema import TOUCH_COORDINATES, schema_attributes

if TYPE_CHECKING:
    import xarray as xr

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_DRAW_AXES = ("chain", "draw", "touch")
#: If the draws of touches are larger than this (bytes), they stay on file.
LARGEST_IN_MEMORY = 1 << 30
#: Bytes that a file has at most for a short text, and for a variable beside its numbers (2,700 in calibrations).
_BYTES_OF_TEXT, _BYTES_OF_VARIABLE = 64, 4096


def write_groups(path: str | Path, groups: Mapping[str, xr.Dataset], attributes: Mapping[str, str]) -> None:
    """Write data sets as groups of one netCDF file, and text as attributes of its root.

    The root and every group have the attributes of `schema_attributes` too.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    import xarray as xr

    schema = schema_attributes()
    with replacing(path) as temporary:
        check_room(temporary, _about_bytes(groups, attributes))
        xr.Dataset(attrs={**attributes, **schema}).to_netcdf(temporary, engine="h5netcdf")
        for name, group in groups.items():
            group.assign_attrs(schema).to_netcdf(temporary, mode="a", group=name, engine="h5netcdf")


def _about_bytes(groups: Mapping[str, xr.Dataset], attributes: Mapping[str, str]) -> int:
    """Bytes of a file, rather too many."""
    size = sum(len(text.encode()) for text in attributes.values())
    for group in groups.values():
        for variable in group.variables.values():
            size += _BYTES_OF_TEXT * variable.size if variable.dtype.kind in "OUT" else variable.nbytes
            size += _BYTES_OF_VARIABLE
    return size


def read_groups(
    path: str | Path, *, only: str | None = None
) -> tuple[dict[str, xr.Dataset], dict[str, str], DrawsOnFile | None, tuple[str, ...]]:
    """Every group of a netCDF file, text attributes of its root, draws that stay on file, and names of groups left out.

    Draws of touches that are larger than `LARGEST_IN_MEMORY` are not read into memory: the third value returned gives
    access to them. Groups that are written on request are left out if they are larger. If `only` is given, no other
    group is read.

    Raises
    ------
    InputError
        If the file is missing, is not a netCDF-4 file, is damaged, or declares more than it holds.
    """
    with reading(path) as file:
        with file.open("rb") as stream:
            start = stream.read(len(_SIGNATURE))
        if start != _SIGNATURE:
            raise InputError("expected a posterior file (netCDF) as `calibrate` and `infer` write it", file=file)
        check_heaps(file)
        import xarray as xr

        from bayestouch.results.hdf5_reading import read_hdf5

        try:
            arrays, attributes, left, unread = read_hdf5(
                file, "posterior", _DRAW_AXES, TOUCH_COORDINATES, LARGEST_IN_MEMORY, only
            )
            draws = None if left is None else DrawsOnFile(file.absolute(), left, stamp_of(file))
            groups = {
                name: xr.Dataset(
                    {key: (array.axes, array.values) for key, array in group.items() if not _labels(key, array.axes)}
                )
                for name, group in arrays.items()
            }
        except InputError as error:
            raise InputError(error.message, file=file, column=error.column) from None
        except MemoryError:
            raise InputError("needs more memory than there is", file=file) from None
        # The HDF5 library raises exceptions of any kind for a damaged file.
        except Exception as error:
            why = " ".join(str(error).split())[:120] or type(error).__name__
            raise InputError(f"is damaged or no netCDF file ({why})", file=file) from None
    return groups, attributes, draws, unread


def _labels(name: str, axes: tuple[str, ...]) -> bool:
    """True for coordinates that label touches: they are made again from the rows."""
    return name in TOUCH_COORDINATES and axes == ("touch",)
