"""Texts of a result that are no UTF-8 are saved all the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from posterior_cases import calibration, touches

import bayestouch


def test_notes_and_settings_name_files_of_any_name(tmp_path: Path) -> None:
    """The name of a file may hold a byte that is no UTF-8, in Python a lone surrogate."""
    notes, settings = ("t\udcff.csv: read µ",), {"table": "t\udcff.csv"}
    for made in (calibration(), touches()):
        made = replace(made, notes=notes, settings=settings)
        made.save(tmp_path / "saved.nc")
        again = bayestouch.load(tmp_path / "saved.nc")
        assert again.notes == ("t?.csv: read µ",) and again.settings["table"] == "t?.csv"
