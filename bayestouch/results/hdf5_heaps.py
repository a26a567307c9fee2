"""A fault of the HDF5 library that a damaged file can set off: looked for in the bytes before the library sees them.

Texts and references of varying length lie in "global heaps", blocks of objects one behind the other (HDF5 File Format
Specification 3.0, section III.E). The library walks through them by the size that each object states. The free space at
the end is an object too, and where damage makes a size zero the walk stands still for ever (seen in HDF5 2.0; found
by `studies/fuzz_readers.py`).
"""

from __future__ import annotations

import mmap
import struct
from pathlib import Path

from bayestouch.errors import InputError

_SIGNATURE = b"GCOL\x01"
_HEADER, _OBJECT = 16, struct.Struct("<HHIQ")
# Bytes that are looked through at a time, whole pages.
_WINDOW = 1 << 24


def check_heaps(file: Path) -> None:
    """Refuse a file with a heap that cannot be walked through.

    Raises
    ------
    InputError
        There is one.
    """
    with file.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        for low in range(0, len(data), _WINDOW):
            high = low + _WINDOW + len(_SIGNATURE) - 1
            at = data.find(_SIGNATURE, low, high)
            while at >= 0:
                if not _walks(data, at):
                    raise InputError("is damaged: a heap of texts has no end", file=file)
                at = data.find(_SIGNATURE, at + 1, high)
            if hasattr(mmap, "MADV_DONTNEED"):  # else the whole file counts as memory of this process
                data.madvise(mmap.MADV_DONTNEED, low, min(_WINDOW, len(data) - low))


def _walks(data: mmap.mmap, start: int) -> bool:
    """Whether every object of a heap leads further, up to its end or to what the library itself refuses.

    The steps are the library's: free space counts its own header, an object is filled up to 8 bytes, and sizes are
    taken modulo 2⁶⁴, so that one may lead backwards.
    """
    if start + _HEADER > len(data):
        return True
    (size,) = struct.unpack_from("<Q", data, start + 8)
    at, end = start + _HEADER, min(start + size, len(data))
    while at + _OBJECT.size <= end:
        index, _, _, length = _OBJECT.unpack_from(data, at)
        step = (length if index == 0 else _OBJECT.size + (length + 7) // 8 * 8) % 2**64
        if step == 0 or step >= 2**63:
            return False
        at += step
    return True
