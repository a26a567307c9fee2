"""netCDF files of several groups: written whole or not at all, read with nothing taken on trust."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from bayestouch.draws_on_file import DrawsOnFile, stamp_of
from bayestouch.errors import InputError
from bayestouch.files import reading, replacing

if TYPE_CHECKING:
    import xarray as xr

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
# Arrays may be this much larger than the file (compressed by whoever saved it again), beyond the first so many bytes.
_LARGEST_RATIO, _FREE_BYTES = 200, 1 << 26
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
        import h5py  # type: ignore[import-untyped, unused-ignore]
        import xarray as xr

        try:
            # A file that h5py refuses never gets to h5netcdf, which would refuse it with noise on the terminal.
            with h5py.File(file, "r") as root:
                attributes = {str(key): value for key, value in root.attrs.items() if isinstance(value, str)}
            with xr.open_datatree(file, engine="h5netcdf", phony_dims="access") as tree:
                draws = _left_on_file(tree, file)
                declared = sum(node.dataset.nbytes for node in tree.subtree)
                if declared > _FREE_BYTES + _LARGEST_RATIO * file.stat().st_size:
                    raise InputError(f"declares {declared} bytes of arrays, more than it can hold", file=file)
                groups = {
                    name: child.to_dataset().load()
                    for name, child in tree.children.items()
                    if only in (None, name) and (draws is None or name != "posterior")
                }
        except (InputError, MemoryError):
            raise
        # A damaged file makes the HDF5 libraries raise whatever it led them to.
        except Exception as error:
            why = " ".join(str(error).split())[:120] or type(error).__name__
            raise InputError(f"is damaged or no netCDF file ({why})", file=file) from None
    return groups, attributes, draws


def _left_on_file(tree: xr.DataTree, file: Path) -> DrawsOnFile | None:
    """Draws of touches that would fill the memory."""
    if "posterior" not in tree.children:
        return None
    variables = tree["posterior"].data_vars
    if sum(variable.nbytes for variable in variables.values()) <= LARGEST_IN_MEMORY:
        return None
    if any(v.dims != ("chain", "draw", "touch") or v.dtype.kind != "f" for v in variables.values()):
        return None
    shapes = {str(name): variable.shape for name, variable in variables.items()}
    return DrawsOnFile(file.absolute(), shapes, stamp_of(file))
