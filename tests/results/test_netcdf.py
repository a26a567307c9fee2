"""Groups of a netCDF file: a damaged file is refused in words."""

from __future__ import annotations

import resource
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from bayestouch.errors import InputError
from bayestouch.results.netcdf import read_groups, write_groups


def test_a_file_that_ends_after_its_signature_is_called_damaged(tmp_path: Path) -> None:
    """Whatever the library of the format makes of it, the user reads which file it is and that it is damaged."""
    path = tmp_path / "cut.nc"
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(50))
    with pytest.raises(InputError, match=r"cut\.nc: is damaged or no netCDF file \(.+\)"):
        read_groups(path)


def test_a_disk_without_room_is_one_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A limit of the size of files stands for the disk. Without it the same file is written."""
    numbers = np.random.default_rng(1).standard_normal(40_000)
    group = {"posterior": xr.Dataset({"mu": ("draw", numbers), "name": ("draw", np.full(40_000, "touch"))})}
    path, limits = tmp_path / "c.nc", resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        with pytest.raises(InputError) as caught:
            write_groups(path, group, {})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert str(caught.value) == f"{path}: cannot be written: File too large"
    assert capfd.readouterr().err == "" and list(tmp_path.iterdir()) == []
    write_groups(path, group, {})
    np.testing.assert_array_equal(read_groups(path)[0]["posterior"]["mu"], numbers)
