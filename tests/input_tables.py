"""A small good data set that tests change, and what loading it gives."""

from __future__ import annotations

from pathlib import Path

import pytest

from bayestouch.data.dataset import load_dataset
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError

SENSOR = 'body = "pad"\n[geometry]\nelement_x_mm = [0, 6]\n'
FINGER = "[geometry]\ncore_radius_mm=1\nouter_radius_mm=3\nsensing_radius_mm=2\n"
GOOD = "touch,sample,x_mm,load_N,e01,e02\n0,0,1.5,2,10,20\n0,1,1.5,2,11,21\n1,0,2.5,2,12,22\n"


def put(folder: Path, touches: str | bytes, sensor: str = SENSOR) -> Path:
    """Write the data set; give its folder."""
    (folder / "sensor.toml").write_text(sensor)
    (folder / "touches.csv").write_bytes(touches if isinstance(touches, bytes) else touches.encode())
    return folder


def error(path: Path) -> str:
    """Load what must not load; give the one line less the folder."""
    with pytest.raises(InputError) as caught:
        load_dataset(path)
    line = str(caught.value)
    assert len(line.splitlines()) == 1 and len(line) < 500
    return line.removeprefix(f"{path}/")


def good(path: Path) -> Touches:
    return load_dataset(path).touches


def notes(path: Path) -> list[str]:
    return [note.removeprefix("touches.csv: ") for note in good(path).notes]
