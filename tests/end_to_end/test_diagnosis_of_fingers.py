"""Diagnosis of fingers: what it finds, what it writes, and what it refuses."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bayestouch
from bayestouch.commands.cli import main
from bayestouch.data.dataset import DataSet
from bayestouch.effects import StatedModel, read_model
from bayestouch.simulation import FingerDesign, save_simulated, simulate

KEYS = {
    "prediction_error_percent_peak",
    "lack_of_fit",
    "R_bias_mm",
    "R_rms_mm",
    "theta_rms_deg",
    "P_rms_N_per_m",
    "coverage_90",
}


Once = Callable[[str, Callable[[Path], object]], Path]


@pytest.fixture(scope="module")
def crossed(made_once: Once) -> Path:
    """A finger of eight elements whose neighbours leak 6 %, on disk."""
    design = FingerDesign(n_elements=8, samples_per_touch=3, edge_step_deg=3.0, flat_step_deg=6.0, touch_step_deg=4.0)
    made = simulate(design, effects={"crosstalk": 0.06}, seed=5)
    return made_once("crossed", lambda folder: save_simulated(made, folder))


@pytest.fixture(scope="module")
def written(crossed: Path, made_once: Once) -> Path:
    """Its diagnosis, made by the command line."""

    def write(folder: Path) -> None:
        assert main(["diagnose", str(crossed), "-o", str(folder), "--quiet"]) == 0

    return made_once("diagnosis of crossed", write)


def numbers_of(folder: Path) -> dict:
    return json.loads((folder / "diagnosis.json").read_text("utf-8"))


def test_json_is_as_the_data_format_says(written: Path) -> None:
    numbers = numbers_of(written)
    about = {"touches", "elements", "held_out_touches", "unreferenced", "elements_left_out", "fingerprints"}
    assert set(numbers["data"]) == about
    assert set(numbers["before"]) == set(numbers["after"]) == KEYS
    assert numbers["verdict"] in ("adequate", "explained", "partly explained", "unattributed")
    assert {"fraction", "p_value", "where"} <= set(numbers["unexplained"])
    for effect in numbers["effects"]:
        assert {"name", "stage", "parameters", "elpd_gain", "elpd_gain_se", "explained_fraction"} <= set(effect)
        assert all(set(each) == {"mean", "sd", "unit"} for each in effect["parameters"].values())
    for candidate in numbers["candidates"]:
        assert {"name", "stage", "score_z", "elpd_gain", "explained_fraction"} <= set(candidate)
    assert len({each["name"] for each in numbers["candidates"]}) == len(numbers["candidates"])


def test_the_effect_is_found_and_removes_the_error(written: Path) -> None:
    numbers = numbers_of(written)
    assert numbers["verdict"] == "explained"
    assert [each["name"] for each in numbers["effects"]] == ["crosstalk"]
    share = numbers["effects"][0]["parameters"]["crosstalk_share"]
    # Four standard deviations: one wrong failure in 16 000 seeds, and the seed is fixed.
    assert abs(share["mean"] - 0.06) < 4 * share["sd"]
    assert numbers["after"]["lack_of_fit"] < 1.1 < numbers["before"]["lack_of_fit"]
    assert numbers["after"]["R_rms_mm"] < numbers["before"]["R_rms_mm"]


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # what Dask warns of, such as a port that is taken, is not ours
def test_a_cluster_writes_the_same_files(written: Path, crossed: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="distributed is not installed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        scheduler = ["--scheduler", cluster.scheduler_address]
        assert main(["diagnose", str(crossed), "-o", str(tmp_path / "shared"), "--quiet", *scheduler]) == 0
    files = [path.relative_to(written) for path in written.rglob("*") if path.is_file()]
    assert len(files) > 5
    for file in files:
        assert (tmp_path / "shared" / file).read_bytes() == (written / file).read_bytes(), file


def test_calibrations_are_read_by_infer(written: Path, crossed: Path) -> None:
    after = bayestouch.load(written / "calibration_after.nc")
    before = bayestouch.load(written / "calibration_before.nc")
    assert "crosstalk_share" in after.posterior and "crosstalk_share" not in before.posterior
    touches = bayestouch.load_dataset(crossed).touches
    some = touches.select(touches.touch < 30)
    error = {}
    for name, calibration in (("before", before), ("after", after)):
        read = bayestouch.infer(some, calibration, method="importance", draws=256, seed=1)
        error[name] = np.sqrt(np.mean((read.mean("R") - read.reference["R"]) ** 2))
    assert error["after"] < error["before"]


def practice(finger: str) -> tuple[Path, dict]:
    """A practice finger's folder, and what is true of it."""
    shared = Path(os.environ.get("BAYESTOUCH_SHARED", Path(__file__).resolve().parents[3] / "shared"))
    folder = shared / "practice" / f"finger-{finger}"
    if not folder.is_dir():
        pytest.skip(f"no {folder}")
    truth = json.loads((folder.parent / "truth" / folder.name / "truth.json").read_text("utf-8"))
    return folder, truth["effects"]


def half_of(dataset: DataSet) -> DataSet:
    """Every other touch of both tables: a diagnosis takes half of the time."""
    assert dataset.calibration is not None
    calibration, touches = (t.select(t.touch % 2 == 0) for t in (dataset.calibration, dataset.touches))
    return replace(dataset, calibration=calibration, touches=touches)


@pytest.mark.parametrize("finger", ["a", *(pytest.param(finger, marks=pytest.mark.slow) for finger in "bc")])
def test_practice_fingers_whose_effects_have_the_same_names(finger: str) -> None:
    folder, truth = practice(finger)
    dataset = bayestouch.load_dataset(folder)
    if finger == "c":
        dataset = half_of(dataset)
    diagnosis = bayestouch.diagnose(dataset, sample=False, draws=64)
    assert diagnosis.effects == tuple(truth)
    assert diagnosis.verdict == ("explained" if truth else "adequate")
    # Drifts leave a little of their own uncertainty between the touches that were fitted.
    assert diagnosis.numbers["after"]["lack_of_fit"] < (1.15 if "baseline_drift" in truth else 1.1)


@pytest.mark.slow
def test_practice_finger_whose_gain_expands() -> None:
    """It is made in another functional form than the catalogue's; two values follow it, and the draws mix."""
    folder, truth = practice("d")
    assert set(truth) == {"expansion"}
    diagnosis = bayestouch.diagnose(bayestouch.load_dataset(folder), draws=1000)
    assert diagnosis.effects == ("gain_nonlinearity",) and diagnosis.verdict == "explained"
    assert diagnosis.numbers["after"]["lack_of_fit"] < 1.1
    found = diagnosis.numbers["effects"][0]["parameters"]
    assert set(found) == {"gain_nonlinearity_share", "gain_nonlinearity_power"}
    share = found["gain_nonlinearity_share"]
    assert abs(share["mean"] - truth["expansion"]) < 3 * share["sd"]
    assert diagnosis.calibration_after.statistics["ess_bulk"] >= 400


@pytest.mark.slow
def test_practice_finger_with_an_effect_that_is_not_in_the_catalogue() -> None:
    """No cause is named, and a correction takes away at least half of what is beyond the noise."""
    folder, truth = practice("e")
    assert set(truth) == {"far_lobe"}
    diagnosis = bayestouch.diagnose(half_of(bayestouch.load_dataset(folder)), sample=False, draws=64)
    assert diagnosis.effects == () and diagnosis.verdict == "unattributed"
    floor = diagnosis.numbers["noise_floor_percent_peak"]
    before, after = (diagnosis.numbers[each]["prediction_error_percent_peak"] - floor for each in ("before", "after"))
    assert after < 0.5 * before


@pytest.mark.slow
def test_model_toml_calibrates_again(written: Path, crossed: Path, tmp_path: Path) -> None:
    """Round trip of model.toml, and a calibration with the effect from the calibration touches alone."""
    model = read_model(written / "model.toml")
    assert StatedModel.from_toml(model.to_toml()) == model
    assert [name for name, _ in model.effects] == ["crosstalk"]
    out = tmp_path / "c.nc"
    assert main(["calibrate", str(crossed), "-o", str(out), "--model", str(written / "model.toml"), "--quiet"]) == 0
    again = bayestouch.load(out)
    draws = again.posterior["crosstalk_share"]
    assert abs(draws.mean() - 0.06) < 4 * draws.std()


@pytest.mark.parametrize(
    "text, complaint",
    [
        ("effect = 3", "expected tables"),
        ('[[effect]]\nname = "magic"', "unknown effect 'magic'"),
        ('[[effect]]\nname = "crosstalk"\nstart = {share = "much"}', "expected numbers"),
        ('[[effect]]\nname = "crosstalk"\nstart = {size = 0.1}', "parameter of effect crosstalk"),
        ("effects = []", "not known here"),
        ('contact = "magic"', "unknown contact model 'magic'"),
        ('body = "pad"', "the model is that of a pad"),
        ("= 3", "expected TOML"),
    ],
)
def test_bad_model_is_one_line(
    crossed: Path, tmp_path: Path, text: str, complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "model.toml"
    path.write_text(text)
    assert main(["calibrate", str(crossed), "-o", str(tmp_path / "c.nc"), "--model", str(path), "--quiet"]) == 2
    err = capsys.readouterr().err
    assert complaint in err and err.count("\n") == 1 and f"{path}" in err


def test_all_files_are_written(written: Path) -> None:
    figures = numbers_of(written)["figures"]
    assert figures[0]["file"] == "figures/effect-1-crosstalk.png"
    assert {each["file"] for each in figures} == {f"figures/{p.name}" for p in (written / "figures").iterdir()}
    assert all((written / each["file"]).read_bytes().startswith(b"\x89PNG") for each in figures)
    assert not [path for path in written.parent.iterdir() if path.suffix == ".tmp"]


@pytest.mark.slow
def test_the_script_repeats_the_diagnosis(written: Path, crossed: Path, tmp_path: Path) -> None:
    command = [sys.executable, str(written / "repeat.py"), str(crossed), str(tmp_path / "again")]
    subprocess.run(command, check=True, capture_output=True)
    assert numbers_of(tmp_path / "again") == numbers_of(written)
