"""Results rebuilt from the groups of a file: what is not as it should be is refused in words."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import arviz
import h5py
import pytest
from posterior_cases import calibration, same

from bayestouch.errors import InputError
from bayestouch.results.from_groups import notes_of
from bayestouch.results.keys import E_MAP, EFFECTS, IDENTIFIED_MAP
from bayestouch.results.reading import load_calibration


def test_notes_of_a_damaged_file_are_refused_in_words() -> None:
    """Text that is no JSON, JSON of another kind and nothing at all are errors of the file, not of the program."""
    assert notes_of({"notes": '["one", "two"]'}) == ("one", "two")
    for damaged in ({"notes": "[broken"}, {"notes": '{"one": 1}'}, {}):
        with pytest.raises(InputError, match="a list"):
            notes_of(damaged)


def test_a_calibration_that_arviz_wrote_again_is_the_same(tmp_path: Path) -> None:
    """A finger has no extra arrays if it has no rest reading; ArviZ does not write their empty group."""
    plain = replace(calibration(), extra={})
    plain.save(tmp_path / "ours.nc")
    arviz.from_netcdf(tmp_path / "ours.nc").to_netcdf(tmp_path / "again.nc")
    plain.to_arviz().to_netcdf(tmp_path / "direct.nc")
    for name in ("ours.nc", "again.nc", "direct.nc"):
        same(load_calibration(tmp_path / name), load_calibration(tmp_path / "ours.nc"))
        assert not load_calibration(tmp_path / name).extra
    with h5py.File(tmp_path / "again.nc") as file:
        assert "extra" not in file


def test_a_calibration_that_needs_extra_arrays_is_refused_without_them(tmp_path: Path) -> None:
    finger = calibration()
    for needing in ({EFFECTS: "{}"}, {E_MAP: IDENTIFIED_MAP}):
        replace(finger, settings=finger.settings | needing).save(tmp_path / "file.nc")
        with h5py.File(tmp_path / "file.nc", "a") as file:
            del file["extra"]
        with pytest.raises(InputError, match="the group extra is missing"):
            load_calibration(tmp_path / "file.nc")
