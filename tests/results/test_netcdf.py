"""Groups of a netCDF file: a damaged file is refused in words."""

from __future__ import annotations

from pathlib import Path

import pytest

from bayestouch.errors import InputError
from bayestouch.results.netcdf import read_groups


def test_a_file_that_ends_after_its_signature_is_called_damaged(tmp_path: Path) -> None:
    """Whatever the library of the format makes of it, the user reads which file it is and that it is damaged."""
    path = tmp_path / "cut.nc"
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(50))
    with pytest.raises(InputError, match=r"cut\.nc: is damaged or no netCDF file \(.+\)"):
        read_groups(path)
