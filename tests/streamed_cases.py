"""Touches that are read block by block."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from known_fingers import dataset, known_touches

from bayestouch.calibration import calibrate
from bayestouch.data.dataset import save_dataset
from bayestouch.data.touches import Touches
from bayestouch.reading import driver as run_module
from bayestouch.results.objects import Calibration

DRAWS = 128


@cache
def calibrated() -> tuple[Touches, Calibration]:
    """Touches of one finger, and its calibration."""
    data = dataset(known_touches(1, step=3.0))
    return data.touches, calibrate(data, draws=40)


def saved(folder: Path) -> tuple[Path, Path]:
    """The same in files: data set and calibration."""
    save_dataset(dataset(known_touches(1, step=3.0)), folder / "finger")
    calibrated()[1].save(folder / "calibration.nc")
    return folder / "finger", folder / "calibration.nc"


def blocks_of_seven(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where thousands are the rule."""
    monkeypatch.setattr(run_module, "BLOCK_DRAWS", 1)
    monkeypatch.setattr(run_module, "BLOCK_UNIT", 7)
