"""Check for a kind of damage that makes the HDF5 library run for ever; done on the bytes, without the library.

Texts and references of varying length are stored in "global heaps": blocks of objects, one after the other (HDF5 File
Format Specification 3.0, section III.E). The library goes through a heap by the size that each object declares. The
free space at the end is an object too. If damage sets a size to zero, the library never gets further (seen in HDF5
2.0; found by `studies/fuzz_readers.py`).
"""

from __future__ import annotations

import mmap
import struct
from pathlib import Path

from bayestouch.errors import InputError

_SIGNATURE = b"GCOL\x01"
_HEADER, _OBJECT = 16, struct.Struct("<HHIQ")
# Number of bytes that are searched at a time, whole pages.
_WINDOW = 1 << 24


def check_heaps(file: Path) -> None:
    """Refuse a file with a heap that the library could not get through.

    Raises
    ------
    InputError
        If there is such a heap.
    """
    with file.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        for low in range(0, len(data), _WINDOW):
            high = low + _WINDOW + len(_SIGNATURE) - 1
            at = data.find(_SIGNATURE, low, high)
            while at >= 0:
                if not _can_be_traversed(data, at):
                    raise InputError("is damaged: a heap of texts has no end", file=file)
                at = data.find(_SIGNATURE, at + 1, high)
            if hasattr(mmap, "MADV_DONTNEED"):  # otherwise the whole file counts as memory of this process
                data.madvise(mmap.MADV_DONTNEED, low, min(_WINDOW, len(data) - low))


def _can_be_traversed(data: mmap.mmap, start: int) -> bool:
    """True if the library gets through a heap: to its end, or to an object that the library itself refuses.

    The steps are those of the library: free space includes its own header, an object is padded to a multiple of 8
    bytes, and sizes are taken modulo 2⁶⁴, so that a step may go backwards.
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
