"""Groups of arrays out of an HDF5 file from anyone: looked at before memory is asked for, and nothing is followed.

netCDF-4 files are HDF5 files whose axes are named by dimension scales. What is read: the text attributes of the root
and the arrays of the groups directly below it. Links to other files, arrays that are kept in other files or put
together from them, and anything but numbers and text are refused.
"""

from __future__ import annotations

from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from bayestouch.errors import InputError, shown

if TYPE_CHECKING:
    import h5py  # type: ignore[import-untyped, unused-ignore]  # stubs are in newer ones only

#: A file of ours has seven groups of at most some forty arrays, with a few attributes each.
MOST_GROUPS, MOST_ARRAYS, MOST_AXES, MOST_ATTRIBUTES = 64, 1024, 8, 256
#: Arrays may be this much larger than the file (compressed by whoever saved it again), beyond the first so many bytes.
LARGEST_RATIO, FREE_BYTES = 200, 1 << 26
#: What a text takes at least: the pointer to it, and itself.
_TEXT_BYTES = 64
_LONGEST_NAME = 1000
_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable"


class NamedArray(NamedTuple):
    """An array with the names of its axes."""

    axes: tuple[str, ...]
    values: np.ndarray[Any, np.dtype[Any]]


Groups: TypeAlias = "dict[str, dict[str, NamedArray]]"


def read_hdf5(
    file: Path, large: str, axes: tuple[str, ...], largest: int, only: str | None = None
) -> tuple[Groups, dict[str, str], dict[str, tuple[int, ...]] | None]:
    """Read the arrays of every group below the root, and the root's text attributes.

    Parameters
    ----------
    file : Path
        The file.
    large : str
        Group that is not read where it has more than `largest` bytes and nothing but arrays over `axes`.
    axes : tuple of str
    largest : int
    only : str, optional
        Group to read; every one where None.

    Returns
    -------
    mapping, mapping, mapping or None
        Arrays by group and name; attributes; shapes of the arrays that were not read, None where all were.

    Raises
    ------
    InputError
        The file declares more than it can hold, or holds what is never needed.
    Exception
        Whatever the HDF5 library makes of a damaged file.
    """
    import h5py

    size = file.stat().st_size
    with h5py.File(file, "r") as root:
        attributes = _texts(root, size)
        groups = {name: root[name] for name in _names(root, MOST_GROUPS) if _is(root, name, h5py.h5o.TYPE_GROUP)}
        arrays = {name: _arrays(group) for name, group in groups.items()}
        declared = sum(_bytes(array) for group in arrays.values() for array in group.values())
        if declared > FREE_BYTES + LARGEST_RATIO * size:
            raise InputError(f"declares {declared:.3g} bytes of arrays, more than it can hold")
        left = _left(arrays.get(large, {}), axes, largest)
        if left is not None:
            del arrays[large]
        wanted = {name: group for name, group in arrays.items() if only in (None, name)}
        return {name: {k: _read(a, k) for k, a in group.items()} for name, group in wanted.items()}, attributes, left


def _left(group: dict[str, h5py.Dataset], axes: tuple[str, ...], largest: int) -> dict[str, tuple[int, ...]] | None:
    draws = {name: array for name, array in group.items() if name not in axes}
    if sum(map(_bytes, draws.values())) <= largest:
        return None
    if any(_axes(array, name) != axes or array.dtype.kind != "f" for name, array in draws.items()):
        return None
    return {name: tuple(map(int, array.shape)) for name, array in draws.items()}


def _names(group: h5py.Group, most: int) -> list[str]:
    if len(group) > most:
        raise InputError(f"holds {len(group)} things in a group, more than {most}")
    return list(group)


def _is(group: h5py.Group, name: str, kind: int) -> bool:
    """Whether a name is of a kind; a link that leads anywhere but into this very group is refused."""
    import h5py

    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        raise InputError(f"holds a link, {shown(name)}: only what is in the file itself is read")
    return bool(h5py.h5o.get_info(group.id, name.encode()).type == kind)


def _texts(root: h5py.Group, size: int) -> dict[str, str]:
    """Text attributes that are one text each, and no longer than the file."""
    if len(root.attrs) > MOST_ATTRIBUTES:
        raise InputError(f"holds more than {MOST_ATTRIBUTES} attributes")
    texts = {str(name): _text(root, name, size) for name in root.attrs}
    return {name: text for name, text in texts.items() if text is not None}


def _text(owner: h5py.Group | h5py.Dataset, name: str, size: int) -> str | None:
    """An attribute that is one text, None if it is anything else."""
    import h5py

    attribute = owner.attrs.get_id(name)
    if attribute.shape != () or h5py.check_string_dtype(attribute.dtype) is None:
        return None
    if attribute.dtype.itemsize > size:
        raise InputError("declares more text than it can hold", column=str(name))
    value = owner.attrs[name]
    text = value.decode("utf-8") if isinstance(value, bytes) else value
    return text if isinstance(text, str) else None


def _arrays(group: h5py.Group) -> dict[str, h5py.Dataset]:
    """Arrays of a group, none of them read, all of a kind and a size that can be."""
    import h5py

    found = {}
    for name in _names(group, MOST_ARRAYS):
        if not _is(group, name, h5py.h5o.TYPE_DATASET):
            continue
        array = group[name]
        if array.is_virtual or array.external:
            raise InputError("is kept in other files: only what is in the file itself is read", column=name)
        if array.shape is None or len(array.shape) > MOST_AXES:
            raise InputError(f"expected an array of at most {MOST_AXES} axes", column=name)
        if array.dtype.kind not in "fiub" and h5py.check_string_dtype(array.dtype) is None:
            raise InputError(f"expected numbers or text, got {shown(str(array.dtype))}", column=name)
        if len(array.attrs) > MOST_ATTRIBUTES or {"scale_factor", "add_offset"} & set(array.attrs):
            raise InputError("expected plain numbers, not packed ones", column=name)
        if not _only_an_axis(array):
            found[name] = array
    return found


def _bytes(array: h5py.Dataset) -> int:
    """Memory that an array takes: its own, or that of one chunk where that is larger."""
    each = _TEXT_BYTES if array.dtype.kind == "O" else max(array.dtype.itemsize, 1)
    return each * max(prod(map(int, array.shape)), prod(map(int, array.chunks or ())))


def _only_an_axis(array: h5py.Dataset) -> bool:
    """Whether an array is there to name an axis and holds nothing."""
    return "NAME" in array.attrs and (_text(array, "NAME", _LONGEST_NAME) or "").startswith(_NO_VARIABLE)


def _axes(array: h5py.Dataset, name: str) -> tuple[str, ...]:
    import h5py

    names = []
    for place, axis in enumerate(array.dims):
        if len(axis):
            names.append(str(axis[0].name).rpartition("/")[2])
        elif h5py.h5ds.is_scale(array.id) and len(array.shape) == 1:
            names.append(name)
        else:
            names.append(f"{name}_dim_{place}")
    return tuple(names)


def _read(array: h5py.Dataset, name: str) -> NamedArray:
    import h5py

    text = h5py.check_string_dtype(array.dtype) is not None
    values = np.asarray(array.asstr()[()] if text else array[()])
    if "dtype" in array.attrs and _text(array, "dtype", _LONGEST_NAME) == "bool":
        values = values.astype(bool)
    return NamedArray(_axes(array, name), values)
