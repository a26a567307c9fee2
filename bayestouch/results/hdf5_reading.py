"""Arrays from an HDF5 file of unknown origin: sizes are checked before memory is reserved, links are not followed.

netCDF-4 files are HDF5 files whose axes are named by dimension scales. Two things are read: the text attributes of the
root, and the arrays of the groups directly below the root. Links to other files, arrays that are stored in or
assembled from other files, and values that are neither numbers nor text are refused.
"""

from __future__ import annotations

from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from bayestouch.errors import InputError, shown
from bayestouch.results.schema import GROUPS

if TYPE_CHECKING:
    import h5py  # type: ignore[import-untyped, unused-ignore]  # stubs are in newer ones only

#: Limits. A file of this package has seven groups of at most about forty arrays, with a few attributes each.
MOST_GROUPS, MOST_ARRAYS, MOST_AXES, MOST_ATTRIBUTES = 64, 1024, 8, 256
#: Arrays may be this many times larger than the file (which may be compressed), beyond this number of bytes.
LARGEST_RATIO, FREE_BYTES = 200, 1 << 26
#: Smallest memory of a text: its pointer and the text itself, bytes.
_TEXT_BYTES = 64
_LONGEST_NAME = 1000
_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable"


class NamedArray(NamedTuple):
    """An array with the names of its axes."""

    axes: tuple[str, ...]
    values: np.ndarray[Any, np.dtype[Any]]


Groups: TypeAlias = "dict[str, dict[str, NamedArray]]"


def read_hdf5(
    file: Path,
    large: str,
    axes: tuple[str, ...],
    labels: tuple[str, ...],
    largest: int,
    only: str | None = None,
) -> tuple[Groups, dict[str, str], dict[str, tuple[int, ...]] | None, tuple[str, ...]]:
    """Arrays of every group below the root, and text attributes of the root.

    Parameters
    ----------
    file : Path
        File to read.
    large : str
        Group that stays on file if it has more than `largest` bytes and all its arrays have the axes `axes`.
    axes : tuple of str
        Axes of the group `large`.
    labels : tuple of str
        Arrays that may be in that group besides, such as coordinates of touches.
    largest : int
        Limit in bytes, of that group, and of the arrays of draws in all groups that are written on request together;
        where these are larger, they are not read.
    only : str, optional
        Group to read; every group by default.

    Returns
    -------
    mapping, mapping, mapping or None, tuple of str
        Arrays by group and name; attributes; shapes of the arrays of `large`, None if they were read; names of groups
        that were written on request and not read.

    Raises
    ------
    InputError
        If the file declares more than it can hold, or has content that is not allowed.
    Exception
        Any error that the HDF5 library raises for a damaged file.
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
        left_on_file = _shapes_left_on_file(arrays.get(large, {}), axes, labels, largest)
        if left_on_file is not None:
            del arrays[large]
        unread = _large_groups(arrays, axes, largest)
        for group in unread:
            arrays[group] = {name: a for name, a in arrays[group].items() if not _of_draws(a, name, axes)}
        wanted = {name: group for name, group in arrays.items() if only in (None, name)}
        return (
            {name: {k: _read(a, k) for k, a in group.items()} for name, group in wanted.items()},
            attributes,
            left_on_file,
            tuple(name for name in unread if name in GROUPS),
        )


def _shapes_left_on_file(
    group: dict[str, h5py.Dataset], axes: tuple[str, ...], labels: tuple[str, ...], largest: int
) -> dict[str, tuple[int, ...]] | None:
    draws = {name: array for name, array in group.items() if name not in (*axes, *labels)}
    if sum(map(_bytes, draws.values())) <= largest:
        return None
    if any(_axes(array, name) != axes or array.dtype.kind != "f" for name, array in draws.items()):
        return None
    return {name: tuple(map(int, array.shape)) for name, array in draws.items()}


def _large_groups(arrays: dict[str, dict[str, h5py.Dataset]], axes: tuple[str, ...], largest: int) -> list[str]:
    """Groups that were written on request, if their arrays of draws are together too large to be read."""
    names = [name for name in arrays if name in ("sample_stats", *GROUPS)]
    size = sum(_bytes(a) for name in names for key, a in arrays[name].items() if _of_draws(a, key, axes))
    return names if size > largest else []


def _of_draws(array: h5py.Dataset, name: str, axes: tuple[str, ...]) -> bool:
    return _axes(array, name)[:2] == axes[:2]


def _names(group: h5py.Group, most: int) -> list[str]:
    if len(group) > most:
        raise InputError(f"holds {len(group)} things in a group, more than {most}")
    return list(group)


def _is(group: h5py.Group, name: str, kind: int) -> bool:
    """True if an object of the group is of this kind; a link to anything outside the group is refused."""
    import h5py

    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        raise InputError(f"holds a link, {shown(name)}: only what is in the file itself is read")
    return bool(h5py.h5o.get_info(group.id, name.encode()).type == kind)


def _texts(root: h5py.Group, size: int) -> dict[str, str]:
    """Text attributes that are a single text, not longer than the file."""
    if len(root.attrs) > MOST_ATTRIBUTES:
        raise InputError(f"holds more than {MOST_ATTRIBUTES} attributes")
    texts = {str(name): _text(root, name, size) for name in root.attrs}
    return {name: text for name, text in texts.items() if text is not None}


def _text(owner: h5py.Group | h5py.Dataset, name: str, size: int) -> str | None:
    """An attribute that is a single text; None for any other attribute."""
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
    """Arrays of a group, checked for kind, size and number of axes, not read."""
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
    """Memory that reading an array needs: that of the array, or of one chunk if that is larger."""
    each = _TEXT_BYTES if array.dtype.kind == "O" else max(array.dtype.itemsize, 1)
    return each * max(prod(map(int, array.shape)), prod(map(int, array.chunks or ())))


def _only_an_axis(array: h5py.Dataset) -> bool:
    """True if an array only names an axis and contains no data."""
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
