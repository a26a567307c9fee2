"""Figures of a saved diagnosis: those of effects are read, and none of another folder."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

import bayestouch
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


def test_a_diagnosis_of_another_body_is_refused(tmp_path: Path) -> None:
    """Of the files in the folder only model.toml says what the body is; a pad may have as many elements."""
    errors: dict[str, float | None] = {"prediction_error_percent_peak": 1.0, "lack_of_fit": 1.0}
    numbers = {
        "verdict": "adequate",
        "data": {"elements": 4, "held_out_touches": 10},
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
    (tmp_path / "diagnosis.json").write_text(json.dumps(numbers), encoding="utf-8")
    design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    dataset = bayestouch.simulate(design, seed=3).dataset
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
