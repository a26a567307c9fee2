"""A posterior file that is written block by block of touches; only one block is in memory.

The file is created with its full size, and the numbers are later written to their final places. A process that is
killed therefore leaves the layout intact. Until the file is complete, the first bytes (the HDF5 signature) are missing
on disk, from the first moment on, so that no program can mistake it for a result.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.data.files import check_room

if TYPE_CHECKING:
    import xarray as xr

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_SIGNED = len(_SIGNATURE)


@dataclass(frozen=True)
class Place:
    """Position of the numbers of one variable in the file.

    Attributes
    ----------
    offset : int
        Position of the first byte.
    shape : tuple of int
        Shape of the whole variable.
    axis : int
        Number of the axis that counts touches.
    dtype : str
        Type of the numbers, as numpy writes it.
    """

    offset: int
    shape: tuple[int, ...]
    axis: int
    dtype: str


@dataclass(frozen=True)
class GrowingFile:
    """A posterior file that is not complete yet.

    Attributes
    ----------
    path : Path
        Path of the file.
    places : mapping of str to Place
        Position of every variable that has a touch axis, by ``group/variable``.
    """

    path: Path
    places: Mapping[str, Place]

    @classmethod
    def create(
        cls, path: Path, groups: Mapping[str, xr.Dataset], attributes: Mapping[str, str], n_touches: int
    ) -> GrowingFile:
        """New file for `n_touches`, laid out like `groups` of some of them; variables without touches are written."""
        import h5netcdf
        import h5py  # type: ignore[import-untyped, unused-ignore]  # stubs are in newer ones only

        check_room(path, _room_for(groups, n_touches))
        properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        # Reserve space for the numbers now, so that later writing does not change the structure of the file.
        properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
        properties.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        with _Unsigned(path, "w+") as unsigned, h5netcdf.File(unsigned, "w") as file:
            file.attrs.update(attributes)
            for group_name, dataset in groups.items():
                group = file.create_group(group_name)
                group.attrs.update({str(key): value for key, value in dataset.attrs.items()})
                group.dimensions = {
                    str(name): n_touches if name == "touch" else size for name, size in dataset.sizes.items()
                }
                for name, variable in dataset.variables.items():
                    made = _create(group, str(name), variable, properties, h5py.string_dtype())
                    if labels := _labels(dataset, str(name)):
                        made.attrs["coordinates"] = labels
        with _Unsigned(path, "r") as unsigned, h5py.File(unsigned, "r") as root:
            places = {
                f"{group_name}/{name}": _place(root[group_name][name], variable.dims.index("touch"))
                for group_name, dataset in groups.items()
                for name, variable in dataset.variables.items()
                if "touch" in variable.dims
            }
        return cls(path, places)

    def write(self, groups: Mapping[str, xr.Dataset], first: int) -> None:
        """Write the numbers of a block of touches to disk; `first` is the number of its first touch."""
        with self.path.open("r+b", buffering=0) as stream:
            for key, place in self.places.items():
                group_name, name = key.split("/")
                values = np.asarray(groups[group_name].variables[name].values)
                _write(stream, place, values.astype(place.dtype, order="C", copy=False), first)
            os.fsync(stream.fileno())

    def finish(self) -> None:
        """Write the HDF5 signature, so that the file can be opened."""
        with self.path.open("r+b", buffering=0) as stream:
            stream.write(_SIGNATURE)
            os.fsync(stream.fileno())

    def to_json(self) -> str:
        """Positions of all variables as text for `from_json`."""
        return json.dumps({name: asdict(place) for name, place in self.places.items()})

    @classmethod
    def from_json(cls, path: Path, text: str) -> GrowingFile:
        """File at `path` that another process laid out, from the text of `to_json`."""
        places = {
            name: Place(place["offset"], tuple(place["shape"]), place["axis"], place["dtype"])
            for name, place in json.loads(text).items()
        }
        return cls(path, places)


class _Unsigned(FileIO):
    """A file whose first bytes are zeros on disk, and the HDF5 signature for the library that works with it."""

    def write(self, data: Any, /) -> int:
        """Write all of `data`; zeros where the signature belongs."""
        here, piece = self.tell(), bytearray(data)
        signed = max(0, min(len(piece), _SIGNED - here))
        piece[:signed] = bytes(signed)
        left = memoryview(piece)
        while left:
            left = left[super().write(left) :]
        return len(piece)

    def readinto(self, buffer: Any, /) -> int:
        """Read into `buffer`; the signature where it belongs."""
        here = self.tell()
        count = super().readinto(buffer)
        signed = max(0, min(count, _SIGNED - here))
        memoryview(buffer).cast("B")[:signed] = _SIGNATURE[here : here + signed]
        return count


def _room_for(groups: Mapping[str, xr.Dataset], n_touches: int) -> int:
    """Bytes of the numbers of all touches, which are asked for before hours of work."""
    return sum(
        variable.nbytes // max(1, dataset.sizes["touch"]) * n_touches
        for dataset in groups.values()
        for variable in dataset.variables.values()
        if "touch" in variable.dims
    )


def _create(group: Any, name: str, variable: xr.Variable, properties: Any, text: Any) -> Any:
    dims = tuple(map(str, variable.dims))
    if "touch" in dims:
        made = group.create_variable(name, dims, variable.dtype, dcpl=properties)
    else:
        made = group.create_variable(name, dims, text if variable.dtype.kind in "OUT" else variable.dtype)
        made[...] = variable.values
    made.attrs.update({str(key): value for key, value in variable.attrs.items()})
    return made


def _labels(dataset: xr.Dataset, name: str) -> str:
    """Names of a variable's coordinates that are no axes, as netCDF states them; empty for coordinates."""
    if name not in dataset.data_vars:
        return ""
    return " ".join(sorted(str(label) for label in dataset[name].coords if label not in dataset.sizes))


def _place(dataset: Any, axis: int) -> Place:
    return Place(int(dataset.id.get_offset()), tuple(map(int, dataset.shape)), axis, dataset.dtype.str)


def _write(stream: FileIO, place: Place, values: NDArray[Any], first: int) -> None:
    """Write the rows of a block to their positions; a row is a piece that is contiguous in the file."""
    row = int(np.prod(place.shape[place.axis :], dtype=np.int64))
    inner = int(np.prod(place.shape[place.axis + 1 :], dtype=np.int64))
    size = np.dtype(place.dtype).itemsize
    for number, piece in enumerate(values.reshape(-1, values.shape[place.axis] * inner)):
        stream.seek(place.offset + size * (number * row + first * inner))
        left = piece.data.cast("B")
        while left:
            left = left[stream.write(left) :]
