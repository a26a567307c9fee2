"""A posterior file that grows block by block of touches, in memory for one block.

The file is laid out in full size at once and its numbers are then put straight in their places, so that a process
that is killed leaves the layout whole. Until it is finished it lacks the first bytes by which HDF5 files are known: no
program opens it, and nothing takes it for a result.
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

if TYPE_CHECKING:
    import xarray as xr

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_HIDDEN = b"\0" * len(_SIGNATURE)


@dataclass(frozen=True)
class Place:
    """Where the numbers of one variable lie.

    Attributes
    ----------
    offset : int
        First byte.
    shape : tuple of int
        Of the whole variable.
    axis : int
        Which of its axes is the touch.
    dtype : str
        As numpy writes it.
    """

    offset: int
    shape: tuple[int, ...]
    axis: int
    dtype: str


@dataclass(frozen=True)
class GrowingFile:
    """A posterior file in the making.

    Attributes
    ----------
    path : Path
        The file.
    places : mapping of str to Place
        By ``group/variable``, of everything that has a touch.
    """

    path: Path
    places: Mapping[str, Place]

    @classmethod
    def create(
        cls, path: Path, groups: Mapping[str, xr.Dataset], attributes: Mapping[str, str], n_touches: int
    ) -> GrowingFile:
        """Lay out a file for `n_touches`, after the groups of some of them; what has no touch is written."""
        import h5netcdf
        import h5py  # type: ignore[import-untyped, unused-ignore]  # stubs are in newer ones only

        _check_room(path, groups, n_touches)
        properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        # Room for the numbers is made now, not when they come: later nothing but numbers changes.
        properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
        properties.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        with h5netcdf.File(path, "w") as file:
            file.attrs.update(attributes)
            for group_name, dataset in groups.items():
                group = file.create_group(group_name)
                group.dimensions = {
                    str(name): n_touches if name == "touch" else size for name, size in dataset.sizes.items()
                }
                for name, variable in dataset.variables.items():
                    _create(group, str(name), variable, properties, h5py.string_dtype())
        with h5py.File(path, "r") as root:
            places = {
                f"{group_name}/{name}": _place(root[group_name][name], variable.dims.index("touch"))
                for group_name, dataset in groups.items()
                for name, variable in dataset.variables.items()
                if "touch" in variable.dims
            }
        grown = cls(path, places)
        grown._mark(_HIDDEN)
        return grown

    def write(self, groups: Mapping[str, xr.Dataset], first: int) -> None:
        """Put the numbers of some touches in place, of which the first is the `first` of all; on disk when done."""
        with self.path.open("r+b", buffering=0) as stream:
            for key, place in self.places.items():
                group_name, name = key.split("/")
                values = np.asarray(groups[group_name].variables[name].values)
                _write(stream, place, values.astype(place.dtype, order="C", copy=False), first)
            os.fsync(stream.fileno())

    def finish(self) -> None:
        """Make it a file that opens."""
        self._mark(_SIGNATURE)

    def to_json(self) -> str:
        """Text from which `from_json` gives it back."""
        return json.dumps({name: asdict(place) for name, place in self.places.items()})

    @classmethod
    def from_json(cls, path: Path, text: str) -> GrowingFile:
        """The file at `path`, laid out by another process."""
        places = {
            name: Place(place["offset"], tuple(place["shape"]), place["axis"], place["dtype"])
            for name, place in json.loads(text).items()
        }
        return cls(path, places)

    def _mark(self, start: bytes) -> None:
        with self.path.open("r+b", buffering=0) as stream:
            stream.write(start)
            os.fsync(stream.fileno())


def _check_room(path: Path, groups: Mapping[str, xr.Dataset], n_touches: int) -> None:
    """Raise `OSError` where the numbers of so many touches have no room, before hours of work and in one line."""
    size = sum(
        variable.nbytes // max(1, dataset.sizes["touch"]) * n_touches
        for dataset in groups.values()
        for variable in dataset.variables.values()
        if "touch" in variable.dims
    )
    with path.open("wb") as stream:
        if hasattr(os, "posix_fallocate") and size:
            os.posix_fallocate(stream.fileno(), 0, size)
    path.unlink()


def _create(group: Any, name: str, variable: xr.Variable, properties: Any, text: Any) -> None:
    dims = tuple(map(str, variable.dims))
    if "touch" in dims:
        made = group.create_variable(name, dims, variable.dtype, dcpl=properties)
    else:
        made = group.create_variable(name, dims, text if variable.dtype.kind in "OUT" else variable.dtype)
        made[...] = variable.values
    made.attrs.update({str(key): value for key, value in variable.attrs.items()})


def _place(dataset: Any, axis: int) -> Place:
    return Place(int(dataset.id.get_offset()), tuple(map(int, dataset.shape)), axis, dataset.dtype.str)


def _write(stream: FileIO, place: Place, values: NDArray[Any], first: int) -> None:
    """Write the rows of a block, each where it belongs; rows are what lies together in the file."""
    row = int(np.prod(place.shape[place.axis :], dtype=np.int64))
    inner = int(np.prod(place.shape[place.axis + 1 :], dtype=np.int64))
    size = np.dtype(place.dtype).itemsize
    for number, piece in enumerate(values.reshape(-1, values.shape[place.axis] * inner)):
        stream.seek(place.offset + size * (number * row + first * inner))
        left = piece.data.cast("B")
        while left:
            left = left[stream.write(left) :]
