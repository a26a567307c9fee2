"""Files that grow: each number of a block lands in its place, by the layout of arrays in memory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bayestouch.results import growing_file
from bayestouch.results.growing_file import GrowingFile, Place


@pytest.mark.parametrize(("shape", "axis"), [((7,), 0), ((2, 3, 7), 2), ((7, 4), 0), ((2, 7, 4), 1)])
def test_blocks_in_their_places(tmp_path: Path, shape: tuple[int, ...], axis: int) -> None:
    """The touch is the first axis, one between, or the last; numbers begin at byte 16."""
    whole = np.arange(np.prod(shape), dtype=">f4").reshape(shape)
    path = tmp_path / "numbers"
    path.write_bytes(b"." * (16 + whole.nbytes + 3))
    place = Place(16, shape, axis, whole.dtype.str)
    with path.open("r+b", buffering=0) as stream:
        for first, last in ((3, 7), (0, 1), (1, 3)):
            block = np.ascontiguousarray(np.take(whole, range(first, last), axis=axis))
            growing_file._write(stream, place, block, first)
    found = path.read_bytes()
    assert found[:16] == b"." * 16 and found[-3:] == b"..."
    np.testing.assert_array_equal(np.frombuffer(found[16:-3], dtype=">f4").reshape(shape), whole)


def groups(first: int, last: int) -> dict[str, Any]:
    import xarray as xr

    touch = np.arange(first, last)
    return {
        "posterior": xr.Dataset(
            {
                "R": (("draw", "touch"), np.stack([touch, 100.0 + touch]), {"units": "mm"}),
                "all": (("draw",), np.array([7.0, 8.0])),
                "few": (("touch", "kind"), np.stack([touch, -touch, 3 * touch], axis=1).astype(np.int32)),
            },
            coords={"touch": touch},
        ),
        "rows": xr.Dataset({"name": (("kind",), np.array(["a", "bc"], dtype=object)), "t": (("touch",), 0.5 * touch)}),
    }


def test_a_file_of_blocks_is_that_of_all(tmp_path: Path) -> None:
    """Laid out after the first block; it opens only when it is finished, also by what its text gives back."""
    import xarray as xr

    path = tmp_path / "grown.nc"
    made = GrowingFile.create(path, groups(0, 2), {"made": "here"}, 5)
    assert path.read_bytes()[:8] == bytes(8)
    made.write(groups(0, 2), 0)
    again = GrowingFile.from_json(path, made.to_json())
    assert again == made and sorted(made.places) == ["posterior/R", "posterior/few", "posterior/touch", "rows/t"]
    again.write(groups(4, 5), 4)
    again.write(groups(2, 4), 2)
    with pytest.raises(OSError):
        xr.open_dataset(path, group="posterior", engine="h5netcdf")
    again.finish()
    for name, wanted in groups(0, 5).items():
        with xr.open_dataset(path, group=name, engine="h5netcdf") as found:
            for variable in wanted.variables:
                np.testing.assert_array_equal(found[variable].values, wanted[variable].values)
                assert found[variable].dims == wanted[variable].dims
    with xr.open_dataset(path, group="posterior", engine="h5netcdf") as found:
        assert found["R"].attrs["units"] == "mm" and found.sizes["touch"] == 5
    with xr.open_dataset(path, engine="h5netcdf") as root:
        assert root.attrs["made"] == "here"


def test_a_file_that_is_laid_out_opens_at_no_moment(tmp_path: Path) -> None:
    """A process may be killed anywhere: whatever is called, the file on disk has no signature."""
    import sys

    path, starts = tmp_path / "grown.nc", set[bytes]()

    def look(*_: Any) -> None:
        if path.is_file():
            with path.open("rb", buffering=0) as stream:
                starts.add(stream.read(8))

    sys.setprofile(look)
    try:
        GrowingFile.create(path, groups(0, 2), {"made": "here"}, 5)
    finally:
        sys.setprofile(None)
    assert starts == {b"", bytes(8)}


def test_room_that_is_asked_for() -> None:
    """Of a thousand touches: 2 · 8 bytes of R, 3 · 4 of few, 8 of t and the touch's own 8; nothing of what has none."""
    for last in (1, 4):
        assert growing_file._room_for(groups(0, last), 1000) == 1000 * (16 + 12 + 8 + 8)
