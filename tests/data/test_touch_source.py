"""Sources of touches: notes on copies in a file that is given by its path."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import bayestouch
from bayestouch.data import tables, touch_source
from bayestouch.data.touch_source import joined_touches
from bayestouch.data.touch_table import write_touches

NOTE = (
    "twice.csv, row 182: the readings, loads and places of this touch are those of twice.csv, row 2; "
    "1 of 10 touches is a copy, which count twice"
)


@pytest.mark.parametrize(
    ("small", "room", "noted"),
    [
        (touch_source.READ_WHOLE, touch_source.ROOM, True),
        (0, touch_source.ROOM, True),
        (0, 0, False),  # too large for the memory: only a piece at a time is known
    ],
)
def test_copies_in_a_table_that_is_read_by_its_path(
    small: int, room: int, noted: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    design = bayestouch.FingerDesign(n_elements=4, edge_step_deg=10.0, flat_step_deg=20.0, touch_step_deg=20.0)
    data = bayestouch.simulate(design, seed=3).dataset
    calibration = bayestouch.calibrate(data, draws=64, discrepancy="touch")
    some = data.touches.select(np.isin(data.touches.touch, np.unique(data.touches.touch)[:9]))
    again = some.select(some.touch == some.touch[0])
    path = tmp_path / "twice.csv"
    write_touches(joined_touches([some, again.with_(touch=again.touch + 1000)]), path, data.sensor)
    monkeypatch.setattr(touch_source, "READ_WHOLE", small)
    monkeypatch.setattr(touch_source, "ROOM", room)
    monkeypatch.setattr(tables, "CHUNK", 53)
    read = bayestouch.infer(path, calibration, draws=64)
    assert [note for note in read.notes if "is a copy" in note] == [NOTE] * noted
    once = tmp_path / "once.csv"
    write_touches(some, once, data.sensor)
    assert not any("is a copy" in note for note in bayestouch.infer(once, calibration, draws=64).notes)
