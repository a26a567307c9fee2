"""Figures of a saved diagnosis: those of effects are read, and none of another folder."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

import bayestouch
from bayestouch.data.dataset import DataSet
from bayestouch.diagnosis.fingerprints import data_fingerprints
from bayestouch.effects.stated import StatedModel
from bayestouch.reporting.diagnosed import saved_diagnosis
from bayestouch.reporting.diagnosis_file import SCHEMA, read_figure


@pytest.mark.slow
def test_a_report_tells_of_a_saved_diagnosis_with_an_effect(tmp_path: Path) -> None:
    """The figure of an effect has its number and name in its own: effect-1-crosstalk."""
    design = bayestouch.FingerDesign(n_elements=8, edge_step_deg=4.0, flat_step_deg=8.0, touch_step_deg=8.0)
    dataset = bayestouch.simulate(design, effects={"crosstalk": 0.06}, seed=3).dataset
    diagnosis = bayestouch.diagnose(dataset, sample=False, draws=64)
    assert diagnosis.effects == ("crosstalk",)
    diagnosis.save(tmp_path / "diagnosis")
    told = saved_diagnosis(tmp_path / "diagnosis", dataset)
    assert told.numbers["effects"][0]["name"] == "crosstalk"
    assert any("crosstalk" in picture.name for picture in told.pictures)


DESIGN = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)


def write_diagnosis_file(folder: Path, of: DataSet | None = None) -> None:
    """A diagnosis.json without effects, made from a data set; without one, as version 0.2.0 wrote it."""
    errors: dict[str, float | None] = {"prediction_error_percent_peak": 1.0, "lack_of_fit": 1.0}
    numbers = {
        "verdict": "adequate",
        "data": {"elements": 4, "held_out_touches": 10}
        | ({} if of is None else {"fingerprints": data_fingerprints(of)}),
        "before": errors,
        "after": errors,
        "noise_floor_percent_peak": 1.0,
        "effects": [],
        "candidates": [],
        "unexplained": {"fraction": 0.0, "where": "nowhere"},
        "correction": None,
        "measure": None,
        "figures": [],
    }
    (folder / "diagnosis.json").write_text(json.dumps(numbers), encoding="utf-8")


def test_a_diagnosis_of_another_sensor_is_refused(tmp_path: Path) -> None:
    """Another sensor has other values in sensor.toml, or other calibration touches. Two fingers of one design differ
    only in the latter."""
    dataset, twin = (bayestouch.simulate(DESIGN, seed=seed).dataset for seed in (3, 4))
    write_diagnosis_file(tmp_path, dataset)
    assert saved_diagnosis(tmp_path, dataset).numbers["notes"] == []
    softer = replace(dataset, sensor=replace(dataset.sensor, rubber=bayestouch.Rubber(0.1, 0.46)))
    for other, said in ((softer, "another sensor.toml"), (twin, "other calibration touches")):
        with pytest.raises(bayestouch.InputError) as caught:
            saved_diagnosis(tmp_path, other)
        file = tmp_path / "diagnosis.json"
        assert str(caught.value) == f"{file}: expected a diagnosis of this sensor, got one made with {said}"


def test_a_diagnosis_from_other_touches_of_the_sensor_is_taken_with_a_note(tmp_path: Path) -> None:
    dataset = bayestouch.simulate(DESIGN, seed=3).dataset
    write_diagnosis_file(tmp_path, dataset)
    fewer = replace(dataset, touches=dataset.touches.select(slice(400)))
    other_touches = ["the diagnosis was made from other touches of this sensor"]
    assert saved_diagnosis(tmp_path, fewer).numbers["notes"] == other_touches
    # Without a calibration table the touches calibrate, and nothing else tells two sensors of one design apart.
    write_diagnosis_file(tmp_path, replace(dataset, calibration=None))
    assert saved_diagnosis(tmp_path, replace(dataset, calibration=None)).numbers["notes"] == []
    with pytest.raises(bayestouch.InputError, match="made with other calibration touches"):
        saved_diagnosis(tmp_path, replace(fewer, calibration=None))


def test_a_diagnosis_that_does_not_say_its_data_is_taken_with_a_note(tmp_path: Path) -> None:
    write_diagnosis_file(tmp_path)
    (note,) = saved_diagnosis(tmp_path, bayestouch.simulate(DESIGN, seed=3).dataset).numbers["notes"]
    assert note.endswith("whether it is of this sensor is not checked")


def test_a_diagnosis_of_another_body_is_refused(tmp_path: Path) -> None:
    """Of the files in the folder only model.toml says what the body is; a pad may have as many elements."""
    write_diagnosis_file(tmp_path)
    dataset = bayestouch.simulate(DESIGN, seed=3).dataset
    for body in ("finger", "pad"):
        (tmp_path / "model.toml").write_text(StatedModel(body, "", ()).to_toml(), encoding="utf-8")
        if body == "finger":
            found = saved_diagnosis(tmp_path, dataset)
            assert found.folder == tmp_path.name and found.numbers["verdict"] == "adequate"
        else:
            with pytest.raises(bayestouch.InputError, match="expected a diagnosis of a finger, got one of a pad"):
                saved_diagnosis(tmp_path, dataset)


@pytest.mark.parametrize("name", ["../effect", "a/b", "", "effect.png", "é"])
def test_figures_of_other_folders_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(bayestouch.InputError, match="expected a figure's name of letters and hyphens"):
        read_figure(tmp_path, name, "png")


def test_the_schema_is_one_and_any_other_object_fails_it() -> None:
    """A keyword in the wrong place would be ignored: the schema would then let anything pass."""
    Draft202012Validator.check_schema(SCHEMA)
    missing = {error.message.split("'")[1] for error in Draft202012Validator(SCHEMA).iter_errors({})}
    assert missing >= {"verdict", "data", "before", "after", "effects", "candidates", "unexplained", "figures"}
