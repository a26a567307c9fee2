"""Figures of a saved diagnosis: those of effects are read, and none of another folder."""

from __future__ import annotations

import json
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

import bayestouch
from bayestouch.data.dataset import DataSet
from bayestouch.diagnosis.fingerprints import data_fingerprints
from bayestouch.diagnosis.outcome import verdict_sentence
from bayestouch.effects.stated import StatedModel
from bayestouch.reporting.diagnosed import saved_diagnosis
from bayestouch.reporting.diagnosis_file import SCHEMA, read_figure
from bayestouch.reporting.loop_bars import loop_bars


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


def full_diagnosis(verdict: str) -> dict[str, Any]:
    """A diagnosis with everything that a report reads, some of which `diagnose` writes only in rare cases."""
    before, after = {"prediction_error_percent_peak": 1.0, "R_rms_mm": 0.5}, {"prediction_error_percent_peak": 0.8}
    errors = {"before": before | {"lack_of_fit": 1.5}, "after": after | {"lack_of_fit": 1.0, "R_rms_mm": 0.9}}
    limits, gain = {"low": 0.9, "high": 1.1, "expected": 1.0}, {"elpd_gain": 12.0, "elpd_gain_se": 3.0}
    effect = {
        "name": "crosstalk",
        "summary": "leak",
        "parameters": {"share": {"mean": 0.1, "sd": 0.01, "unit": ""}},
        "indistinguishable_from": ["creep"],
    }
    worse = {"R_rms_mm": {"before": 0.5, "after": 0.9, "touches": "beside"}, "log_density": {"before": 9, "after": 8}}
    refused = {"effects": ["crosstalk"], "correction": False, "references_corrected": False, "worse": worse}
    candidate = {"name": "creep", "stage": "readout", "score_z": 1.0, "elpd_gain": None, "explained_fraction": 0.1}
    return {
        "verdict": verdict,
        "data": {"elements": 4, "held_out_touches": 10, "elements_left_out": ["e04"], "unreferenced": False},
        **errors,
        "after_against_stated": errors["after"],
        "change_against_stated_se": {"R_rms_mm": 0.1},
        "lack_of_fit_limits": {"before": limits, "after": limits},
        "noise_floor_percent_peak": 0.7,
        "noise_from_repeats": verdict == "explained",
        "loads_measured": True,
        "effects": [effect],
        "draws": {"ess_bulk": 34.0, "rhat": 1.1, "kept": 64},
        "candidates": [candidate],
        "unexplained": {"fraction": 0.2, "where": "e02", "p_value": 0.3, "test": {"ratio": 0.5, "low": 0.8}},
        "causes": [{"names": ["crosstalk"], "probability": 0.8}, {"names": ["nothing"], "probability": 0.2}],
        "in_place": {"times": gain, "places": gain},
        "not_distinguishable": [["drift", "something in place"]],
        "calibration_after": {"effects": [], "correction": False},
        "not_used": [refused],
        "correction": {"before": errors["before"]},
        "measure": {"advice": "Measure."},
        "notes": ["a note"],
        "figures": [],
    }


def damaged(whole: dict[str, Any]) -> Iterator[tuple[tuple[Any, ...], dict[str, Any]]]:
    """A file for every value that is absent or another one, with the place of the value."""

    def places(of: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
        for key, value in of.items() if isinstance(of, dict) else enumerate(of) if isinstance(of, list) else ():
            yield (*above, key)
            yield from places(value, (*above, key))

    for place in places(whole):
        for value in (None, 0, -1.5, "", "x", [], [None], {}, True, ...):
            made = deepcopy(whole)
            inner: Any = made
            for key in place[:-1]:
                inner = inner[key]
            if value is ...:
                del inner[place[-1]]
            else:
                inner[place[-1]] = value
            yield place, made


@pytest.mark.parametrize("verdict", ["explained", "unattributed", "adequate"])
def test_a_damaged_diagnosis_is_refused_in_one_line_or_read(tmp_path: Path, verdict: str) -> None:
    dataset, file = bayestouch.simulate(DESIGN, seed=3).dataset, tmp_path / "diagnosis.json"
    whole = full_diagnosis(verdict)
    file.write_text(json.dumps(whole), encoding="utf-8")
    said = " ".join(saved_diagnosis(tmp_path, dataset).numbers["sentences"])
    assert "12 ± 3 across times" in str(said).replace("+", "") and "drift and something in place are not" in said
    refused = set()
    for place, made in damaged(whole):
        file.write_text(json.dumps(made), encoding="utf-8")
        try:
            found = saved_diagnosis(tmp_path, dataset).numbers
        except bayestouch.InputError as error:
            assert str(error).startswith(f"{file}: expected ") and "\n" not in str(error)
            refused.add(place)
        else:
            verdict_sentence(found)
            loop_bars(found)
    assert refused >= {("not_distinguishable",), ("in_place", "times"), ("draws", "kept"), ("causes", 0, "names")}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"not_distinguishable": None}, "a list at 'not_distinguishable', got 'None'"),
        ({"not_distinguishable": [["drift"]]}, "a list of two names at 'not_distinguishable[0]', got \"['drift']\""),
        ({"in_place": []}, "an object at 'in_place', got '[]'"),
        ({"draws": {"kept": 0}}, "a number of draws, at least 1, or null at 'draws.kept', got '0'"),
        ({"causes": [{"names": [], "probability": 1}]}, "a list of at least one name at 'causes[0].names', got '[]'"),
        ({"not_used": []}, "an object with 'calibration_after' at 'the top'"),
    ],
)
def test_the_line_on_a_damaged_diagnosis_names_the_place(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    write_diagnosis_file(tmp_path)
    file = tmp_path / "diagnosis.json"
    file.write_text(json.dumps(json.loads(file.read_text("utf-8")) | changes), encoding="utf-8")
    with pytest.raises(bayestouch.InputError) as caught:
        saved_diagnosis(tmp_path, bayestouch.simulate(DESIGN, seed=3).dataset)
    assert f"expected {said}" in str(caught.value)


def test_prediction_errors_that_are_known_only_before_are_not_compared_with_the_noise(tmp_path: Path) -> None:
    numbers = full_diagnosis("explained")
    numbers["after"]["prediction_error_percent_peak"] = numbers["lack_of_fit_limits"]["after"]["low"] = None
    (tmp_path / "diagnosis.json").write_text(json.dumps(numbers), encoding="utf-8")
    said = saved_diagnosis(tmp_path, bayestouch.simulate(DESIGN, seed=3).dataset).numbers["sentences"]
    assert any(line.startswith("On 10 held-out touches: lack of fit 1.50 → 1.00, rms error of R") for line in said)
