"""Figures of a saved diagnosis: those of effects are read, and none of another folder."""

from __future__ import annotations

from pathlib import Path

import pytest

import bayestouch
from bayestouch.reporting.diagnosed import saved_diagnosis
from bayestouch.reporting.diagnosis_file import read_figure


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
