"""Example data sets of the package, as the command writes them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bayestouch.commands.cli import main
from bayestouch.data.dataset import load_dataset
from bayestouch.simulation import embedded_design, simulate
from bayestouch.simulation.examples import EXAMPLES, HIDDEN, SEED


def test_the_measured_example_is_what_was_published(tmp_path: Path, shared_folder: Path) -> None:
    assert main(["example", "fluid-oil-1.5", "-o", str(tmp_path / "channel"), "--quiet"]) == 0
    made = load_dataset(tmp_path / "channel")
    source = made.sensor.source
    assert source["licence"] == "CC BY 4.0" and "SDU Soft Robotics" in source["attribution"]
    original = shared_folder / "measured" / "fluid-oil-1.5"
    if not original.is_dir():
        pytest.skip("the shared data have no folder `measured`")
    given = load_dataset(original).touches
    np.testing.assert_array_equal(made.touches.readings, given.readings)
    np.testing.assert_array_equal(made.touches.load, given.load)
    np.testing.assert_array_equal(made.touches.x_mm, given.x_mm)


def test_the_simulated_example_has_an_effect_that_only_its_truth_states(tmp_path: Path) -> None:
    assert main(["example", "finger", "-o", str(tmp_path), "--quiet"]) == 0
    made = load_dataset(tmp_path)
    assert json.loads((tmp_path / "truth.json").read_text("utf-8"))["effects"] == HIDDEN
    for file in ("sensor.toml", "touches.csv", "calibration.csv"):
        assert not any(name in (tmp_path / file).read_text("utf-8") for name in HIDDEN)
    without = simulate(embedded_design(), seed=SEED).dataset
    # 4 % of the reading on either side, beside noise of about 1 %.
    moved = np.abs(made.touches.readings - without.touches.readings).max(axis=0)
    assert (moved > 0.02 * np.nanmax(without.touches.readings, axis=0)).all()


def test_a_measured_example_has_no_truth_of_a_simulated_one(tmp_path: Path) -> None:
    for name in EXAMPLES:
        assert main(["example", name, "-o", str(tmp_path), "--quiet"]) == 0
    assert load_dataset(tmp_path).sensor.body.kind == "pad"
    assert not (tmp_path / "truth.json").exists()


def test_an_example_that_there_is_not_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["example", "glove", "-o", str(tmp_path / "no")]) == 2
    error = capsys.readouterr().err
    assert "glove" in error and all(name in error for name in EXAMPLES)
    assert not (tmp_path / "no").exists()


def test_examples_are_small() -> None:
    import bayestouch

    folder = Path(bayestouch.__file__).parent / "data" / "examples"
    assert sum(file.stat().st_size for file in folder.rglob("*") if file.is_file()) < 2_000_000
