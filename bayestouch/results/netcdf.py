"""netCDF files of several groups: written whole or not at all, read with nothing taken on trust."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from bayestouch.data.files import reading, replacing
from bayestouch.errors import InputError
from bayestouch.results.draws_on_file import DrawsOnFile, stamp_of
from bayestouch.results.hdf5_heaps import check_heaps

if TYPE_CHECKING:
    import xarray as xr

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_DRAW_AXES = ("chain", "draw", "touch")
#: Draws of touches beyond so many bytes are left on file.
LARGEST_IN_MEMORY = 1 << 30


def write_groups(path: str | Path, groups: Mapping[str, xr.Dataset], attributes: Mapping[str, str]) -> None:
    """Write data sets as groups of one netCDF file, and text attributes at its root.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    import xarray as xr

    with replacing(path) as temporary:
        xr.Dataset(attrs=dict(attributes)).to_netcdf(temporary, engine="h5netcdf")
        for name, group in groups.items():
            group.to_netcdf(temporary, mode="a", group=name, engine="h5netcdf")


def read_groups(
    path: str | Path, *, only: str | None = None
) -> tuple[dict[str, xr.Dataset], dict[str, str], DrawsOnFile | None]:
    """Read every group of a netCDF file into memory, and the text attributes of its root.

    Draws of touches that are larger than `LARGEST_IN_MEMORY` stay on file; they are given last. With `only`, every
    group but that one does.

    Raises
    ------
    InputError
        The file is missing, is no netCDF-4 file, is damaged, or declares more than it holds.
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
            arrays, attributes, left = read_hdf5(file, "posterior", _DRAW_AXES, LARGEST_IN_MEMORY, only)
            draws = None if left is None else DrawsOnFile(file.absolute(), left, stamp_of(file))
            groups = {
                name: xr.Dataset({key: (array.axes, array.values) for key, array in group.items()})
                for name, group in arrays.items()
            }
        except InputError as error:
            raise InputError(error.message, file=file, column=error.column) from None
        except MemoryError:
            raise InputError("needs more memory than there is", file=file) from None
        # A damaged file makes the HDF5 library raise whatever it led it to.
        except Exception as error:
            why = " ".join(str(error).split())[:120] or type(error).__name__
            raise InputError(f"is damaged or no netCDF file ({why})", file=file) from None
    return groups, attributes, draws
