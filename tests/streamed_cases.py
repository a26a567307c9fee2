"""Touches that are read block by block."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from known_fingers import dataset, known_touches

from bayestouch.calibration import calibrate
from bayestouch.data.dataset import save_dataset
from bayestouch.data.touches import Touches
from bayestouch.reading import driver as run_module
from bayestouch.results.objects import Calibration, TouchPosteriors

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


def same(mine: TouchPosteriors, other: TouchPosteriors) -> None:
    """Posteriors, grades, references, rows, settings and notes are the same to the bit."""
    for name in ("posterior", "sample_stats", "reference"):
        first, second = getattr(mine, name), getattr(other, name)
        assert set(first) == set(second)
        for key in first:
            np.testing.assert_array_equal(first[key], second[key], err_msg=f"{name} {key}")
    for name in ("touch", "observed", "predicted", "sd", "counts", "samples", "load", "load_reads", "radius_mm"):
        np.testing.assert_array_equal(getattr(mine.rows, name), getattr(other.rows, name))
    assert mine.settings == other.settings
    assert mine.notes == other.notes
