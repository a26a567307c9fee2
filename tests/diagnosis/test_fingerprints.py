"""Fingerprints of a data set: those of values, whatever files and folder hold them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import bayestouch
from bayestouch.diagnosis.fingerprints import data_fingerprints

DESIGN = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
DATASET = bayestouch.simulate(DESIGN, seed=3).dataset


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_files_and_folder_do_not_change_them(tmp_path: Path, form: Literal["csv", "parquet"]) -> None:
    nameless = replace(DATASET, sensor=replace(DATASET.sensor, name="", source={"note": "other"}))
    bayestouch.save_dataset(nameless, tmp_path / form, form)
    text = (tmp_path / form / "sensor.toml").read_text(encoding="utf-8").replace('name = ""', "")
    (tmp_path / form / "sensor.toml").write_text(text, encoding="utf-8")
    read = bayestouch.load_dataset(tmp_path / form)
    assert read.sensor.name == form
    assert data_fingerprints(read) == data_fingerprints(DATASET)


def test_each_changes_with_its_own_data_alone() -> None:
    touches, calibration = DATASET.touches, DATASET.calibration
    assert calibration is not None
    readings = np.array(touches.readings)
    readings[0, 0] += 1e-9
    changed = {
        "sensor": replace(DATASET, sensor=replace(DATASET.sensor, force_noise_sd=2.0)),
        "calibration": replace(DATASET, calibration=calibration.select(slice(40))),
        "touches": replace(DATASET, touches=touches.with_(readings=readings)),
    }
    known = data_fingerprints(DATASET)
    for name, dataset in changed.items():
        assert {each for each, value in data_fingerprints(dataset).items() if value != known[each]} == {name}
    remarked = touches.with_(extra={"remark": np.full(touches.n_rows, "x", dtype=object)}, notes=("a note",))
    assert data_fingerprints(replace(DATASET, touches=remarked)) == known
