"""Reports on pads search for effects: simulated pads with an effect and without, and a pad with one table."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from report_cases import Page, strict_json

import bayestouch
from bayestouch.reporting import Report
from bayestouch.simulation import PadDesign, simulate

DESIGN = PadDesign(
    element_x_mm=(0.0, 6.0, 12.0, 18.0),
    element_y_mm=None,
    margin_mm=3.0,
    calibration_step_mm=0.75,
    n_touches=60,
    samples_per_touch=4,
)
CREEP = 0.2


def reported(folder: Path, **effects: float) -> Report:
    return bayestouch.report(simulate(DESIGN, effects=effects, seed=7).dataset, folder, draws=64)


# each report is a diagnosis
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> tuple[Report, Report]:
    """Without an effect, and with creep; the same noise in both."""
    parent = tmp_path_factory.mktemp("pads")
    return reported(parent / "plain"), reported(parent / "creep", creep=CREEP)


def text_of(report: Report) -> str:
    return "".join(Page((report.path / "index.html").read_text("utf-8")).text)


def fix_of(report: Report) -> dict[str, str]:
    (row,) = (row for row in report.numbers["answer"]["verdict"] if row["question"] == "What to fix?")
    return row


def test_a_pad_without_an_effect_is_adequate(reports: tuple[Report, Report]) -> None:
    report = reports[0]
    found = strict_json(report.path / "report.json")["diagnosis"]
    assert found["verdict"] == "adequate" and found["effects"] == []
    assert found["data"]["held_out_touches"] == DESIGN.n_touches / 2
    assert len(found["candidates"]) > 5
    assert fix_of(report)["short"] == "Nothing in the model"
    text = text_of(report)
    assert "Adequate: the model predicts held-out touches" in text
    assert found["notes"] and all(note in text for note in found["notes"])
    more = strict_json(report.path / "report.json")["next_touches"]
    assert "Calibration touches to add" in text and len(more["touches"]) == 3
    assert all(each["touch"] in text for each in more["touches"])


def test_a_pad_with_an_effect_is_told_of_it(reports: tuple[Report, Report]) -> None:
    report = reports[1]
    found = strict_json(report.path / "report.json")["diagnosis"]
    assert found["verdict"] == "explained"
    assert [effect["name"] for effect in found["effects"]] == ["creep"]
    share = found["effects"][0]["parameters"]["creep_share"]
    # Four sd of the normal approximation.
    assert abs(share["mean"] - CREEP) < 4 * share["sd"]
    assert fix_of(report)["short"] == "Creep"
    assert {figure["section"] for figure in report.numbers["figures"]} >= {"diagnosis"}
    (step,) = (step for step in report.numbers["next"] if "what was found" in step["what"])
    # A pad is not calibrated with model.toml.
    assert "calibration_after.nc" in step["what"] and "--model" not in text_of(report)
    assert "errors of R" not in text_of(report)


def test_errors_of_samples_and_of_touch_means_are_both_named(reports: tuple[Report, Report]) -> None:
    """Creep moves samples about the mean of their touch: the error of samples falls, that of means hardly."""
    found = reports[1].numbers["diagnosis"]
    samples, means = (
        [found[stand][f"{key}_percent_peak"] for stand in ("before", "after")]
        for key in ("prediction_error", "touch_error")
    )
    assert samples[1] < 0.9 * samples[0]
    assert means[1] == pytest.approx(means[0], rel=0.1)
    # A mean of four samples has half their noise; errors of the load and of the fit add to both.
    assert means[1] < 0.75 * samples[1]
    page = text_of(reports[1])
    assert "prediction error of samples" in page and "prediction error of touch means" in page
    reason = fix_of(reports[1])["reason"]
    assert "of samples: " in reason and "of touch means: " in reason


def test_what_creep_does_to_samples_is_no_noise(reports: tuple[Report, Report]) -> None:
    """The noise is the same with creep and without, and so is the floor."""
    plain, creep = (report.numbers["diagnosis"] for report in reports)
    # Peaks differ by what creep does to them.
    assert creep["noise_floor_percent_peak"] == pytest.approx(plain["noise_floor_percent_peak"], rel=0.1)
    assert creep["after"]["prediction_error_percent_peak"] > 0.85 * creep["noise_floor_percent_peak"]


def test_a_pad_with_one_table_is_searched_as_diagnose_does(tmp_path: Path) -> None:
    """Blocks in time are held out, whichever touches the report calibrates with."""
    touches = simulate(replace(DESIGN, n_touches=64), effects={"creep": CREEP}, seed=8).dataset
    dataset = replace(touches, calibration=None)
    found = bayestouch.report(dataset, tmp_path / "out", draws=64, seed=2).numbers["diagnosis"]
    alone = bayestouch.diagnose(dataset, sample=False, draws=100, seed=2).numbers
    assert found["data"] == alone["data"] and found["data"]["touches"] == 64
    assert found["verdict"] == alone["verdict"]
    assert found["notes"] == alone["notes"]
    for stand in ("before", "after"):
        errors = [numbers[stand]["prediction_error_percent_peak"] for numbers in (found, alone)]
        np.testing.assert_allclose(*errors, rtol=1e-9)
