"""The study of measured pads that nobody had looked at: what it makes of the files of others, and of their results."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from study_modules import study

import bayestouch


def test_an_array_is_written_as_a_data_set(tmp_path: Path) -> None:
    module = study("other_pads")
    clone, folder = tmp_path / "clone", tmp_path / "array"
    (clone / "train_data").mkdir(parents=True)
    folder.mkdir()
    values = np.random.default_rng(0).normal(size=(5, 10))
    np.savetxt(clone / "train_data" / "DS10_atm_8.75_10-samples_train.csv", values, delimiter=",")
    array = next(each for each in module.ARRAYS if each.folder != ".")
    array.write(clone, folder)
    found = bayestouch.load_dataset(folder)
    np.testing.assert_allclose(found.touches.readings, values[:, 2:], atol=5e-6)
    np.testing.assert_allclose(found.touches.y_mm, values[:, 1], atol=5e-3)
    # The elements go down one column and up the other.
    assert found.sensor.body.element_y_mm[3:5] == pytest.approx([26.25, 26.25])
    assert found.sensor.body.element_x_mm[3:5] == pytest.approx([8.75, 0.0])


def test_channels_have_their_licence_and_arrays_are_left_out_with_a_reason(capsys: pytest.CaptureFixture[str]) -> None:
    module = study("other_pads")
    found = dict(module.data_sets(None, (), set()))
    assert len(found) == 8
    assert all(each.sensor.source["licence"] == "CC BY 4.0" for each in found.values())
    assert "arrays are left out" in capsys.readouterr().out
    assert not dict(module.data_sets(None, (), set(found)))


@pytest.mark.slow
def test_a_channel_is_read_better_after_the_diagnosis(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    module = study("other_pads")
    ((name, dataset),) = module.data_sets(None, ["fluid-air-2.0"], set())
    # Every third of its 18 depths: 41 touches each, one after the other.
    some = dataset.touches.select(np.arange(dataset.touches.n_rows) // 41 % 3 == 0)
    found = module.result(name, replace(dataset, touches=some), kernel="gaussian")
    before, after = (found["ways"][way] for way in ("before: kernel and map", "after"))
    assert "load_nonlinearity" in found["effects"]
    # What every element lacks in common is load scatter before: it is wrong in the load more than in the place.
    assert after["readings_percent"] < 0.3 * before["readings_percent"]
    assert after["load_rms_N"] < 0.5 * before["load_rms_N"]
    assert after["median_mm"] < 0.7 * before["median_mm"] and after["rms_mm"] < 0.9 * before["rms_mm"]
    assert "fluid-air-2.0" in module.as_page([found]) and "Errors of the program:** none" in module.as_page([found])
    capsys.readouterr()


def test_an_error_is_a_result(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    module = study("other_pads")
    ((name, dataset),) = module.data_sets(None, ["fluid-air-2.0"], set())
    none = dataset.touches.select(np.zeros(dataset.touches.n_rows, dtype=bool))
    found = module.result(name, replace(dataset, touches=none))
    assert "InputError" in found["error"]
    assert "fluid-air-2.0" in module.summary([found]).splitlines()[-1]
    # A pad with a result is not run again.
    (tmp_path / "results.jsonl").write_text(json.dumps(found) + "\n", "utf-8")
    assert module.main(tmp_path, only=[name]) == [found]
    assert "| fluid-air-2.0 | – | – | error |" in capsys.readouterr().out


def test_errors_that_runs_share() -> None:
    """Two runs that are wrong by their own amounts, and two whose touches are wrong in turn."""
    module = study("other_pads")
    run = np.array([0, 0, 1, 1])
    assert module.shared_by_runs(np.array([2.0, 2.0, -1.0, -1.0]), run) == pytest.approx(1)
    assert module.shared_by_runs(np.array([2.0, -2.0, -1.0, 1.0]), run) == pytest.approx(0)
    assert module.shared_by_runs(np.array([3.0, 1.0, 0.0, 0.0]), run) == pytest.approx(0.8)


def test_the_page_says_how_well_a_share_is_known() -> None:
    module = study("other_pads")
    way = {"rms_mm": 1.0, "coverage": 0.8, "load_coverage": None, "load_rms_N": None, "load_error_of_runs": None}
    after = {**way, "coverage_low": 0.7, "coverage_high": 0.95}
    compared = {"regression": "polynomial", "difference": 0.0, "low": -1.0, "high": 1.0}
    found = {
        **{"name": "a", "version": "0", "commit": "c", "seconds": 1.0, "touches": 40, "held_out": 10, "effects": []},
        "verdict": "adequate",
        "ways": {"before: kernel and map": way, "polynomial": way, "after": after},
        "after_minus_best": {"distance_mm": compared, "load_error_N": None},
    }
    assert "0.80 → 0.80 (0.70 to 0.95)" in module.as_page([found])
    assert "on 1 of 1 pads" in module.summary([found])
    assert "on 0 of 1 pads" in module.summary(
        [{**found, "ways": {**found["ways"], "after": {**after, "coverage_high": 0.85}}}]
    )
