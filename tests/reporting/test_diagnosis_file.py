"""Figures of a saved diagnosis: those of effects are read, and none of another folder."""

from __future__ import annotations

from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

import bayestouch
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


@pytest.mark.parametrize("name", ["../effect", "a/b", "", "effect.png", "é"])
def test_figures_of_other_folders_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(bayestouch.InputError, match="expected a figure's name of letters and hyphens"):
        read_figure(tmp_path, name, "png")


def test_the_schema_is_one_and_any_other_object_fails_it() -> None:
    """A keyword in the wrong place would be ignored: the schema would then let anything pass."""
    Draft202012Validator.check_schema(SCHEMA)
    missing = {error.message.split("'")[1] for error in Draft202012Validator(SCHEMA).iter_errors({})}
    assert missing >= {"verdict", "data", "before", "after", "effects", "candidates", "unexplained", "figures"}
