"""Pieces of the report that can be held against a known answer."""

from __future__ import annotations

import html
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bayestouch
from bayestouch.checking.tables import indenter_name
from bayestouch.data.json_values import strict
from bayestouch.errors import InputError
from bayestouch.output.files import new_folder, write_numbers
from bayestouch.output.text import exact, fixed, in_form, listed, number, percent, plural, plus_minus, ranging
from bayestouch.priors.parameters import Parameter, Uniform
from bayestouch.reporting.about import about_data
from bayestouch.reporting.answer import _verdict, answer
from bayestouch.reporting.calibration_tables import element_table, model_rows, statistic_rows, used_model
from bayestouch.reporting.diagnosed import Diagnosed
from bayestouch.reporting.differences import error_summary
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.made import command
from bayestouch.reporting.page import new_environment
from bayestouch.reporting.trust import calibration_uncertainty, convergence, coverage
from bayestouch.results.data import TouchRows
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.simulation import FingerDesign, simulate

DESIGN = FingerDesign(
    n_elements=6,
    calibration_span_deg=40.0,
    edge_step_deg=5.0,
    flat_step_deg=20.0,
    touch_radii_mm=(3.9,),
    touch_span_deg=2.0,
    samples_per_touch=2,
)


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return bayestouch.calibrate(simulate(DESIGN, seed=2).dataset, draws=64)


def posteriors_of(calibration: Calibration, radius: NDArray[np.float64], seed: int) -> TouchPosteriors:
    """Posteriors that are right by construction: reference and draws come from the same normal distribution."""
    rng = np.random.default_rng(seed)
    t, m = len(radius), calibration.sensor.n_elements
    centre = {"R": np.full(t, 6.0), "theta_c": np.full(t, 5.0), "P": np.full(t, 200.0)}
    sd = {"R": 0.5, "theta_c": 0.1, "P": 4.0}
    draws = {name: centre[name] + sd[name] * rng.standard_normal((4, 250, t)) for name in centre}
    reference = {name: centre[name] + sd[name] * rng.standard_normal(t) for name in centre}
    blank = np.zeros((t, m))
    # The force sensor adds its own noise to the load, which its draws do not know of.
    load = reference["P"] + calibration.noise.force_sd * rng.standard_normal(t)
    counts, reads = np.ones((t, m)), np.ones(t)
    rows = TouchRows(
        np.arange(t), {"theta_c": reference["theta_c"]}, radius, load, blank, blank, blank + 1, counts, reads, reads
    )
    parameters = tuple(Parameter(n, n, n, "mm", Uniform(0, 1)) for n in centre)
    return TouchPosteriors(calibration.sensor, parameters, draws, {}, reference, rows, {})


def evidence_of(calibration: Calibration, posteriors: TouchPosteriors) -> Evidence:
    dataset = simulate(DESIGN, seed=2).dataset
    return Evidence(dataset, calibration, posteriors, posteriors, False, {}, seed=1, draws=64, plug_in=False)


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0, 3, "0"),
        (12.7, 3, "12.7"),
        (0.046, 2, "0.046"),
        (-0.4612, 2, "−0.46"),
        (1234.5, 3, "1234"),
        (1e-7, 3, "1.00e−07"),
        (3.0, 3, "3"),
        (float("nan"), 3, "–"),
        (None, 3, "–"),
        ("counts", 3, "counts"),
    ],
)
def test_numbers_as_text(value: Any, digits: int, text: str) -> None:
    assert number(value, digits) == text


def test_other_text() -> None:
    assert plus_minus(9.962, 0.0141) == "9.962 ± 0.014"
    assert plus_minus(12437.2, 171.0) == "12437 ± 171"
    assert plus_minus(1.0, 0.0) == "1"
    assert plus_minus(None, 1.0) == "–"
    assert (percent(9.96), percent(86.4), percent(0.04)) == ("10.0", "86", "0.0")
    assert (fixed(-0.001, 1), fixed(-0.26, 1)) == ("0.0", "−0.3")
    assert (exact(0.15), exact(-66.0), exact(None)) == ("0.15", "−66", "–")
    assert (ranging(0.46, 0.46), ranging(0.4601, 0.4602, 2), ranging(-1, 0.5)) == ("0.460", "0.46", "from −1 to 0.500")
    assert (plural(1, "touch"), plural(3, "touch"), plural(2, "row")) == ("1 touch", "3 touches", "2 rows")
    assert listed(["a"]) == "a" and listed(["a", "b", "c"]) == "a, b and c"
    assert [indenter_name(r) for r in (0.0, 12.3, np.inf, np.nan)] == ["knife edge", "12.3 mm", "flat", "unknown"]


@pytest.mark.parametrize(
    ("value", "form", "text"),
    [
        (1.074, ".2f", "1.07"),
        (0.104, ".2f", "0.10"),
        (0.0004276, ".2f", "0.000428"),
        (0.05, ".2f", "0.0500"),
        (4.3e-5, ".2f", "4.30e−05"),
        (0.0, ".2f", "0.00"),
        (-0.1, "+z.2f", "-0.10"),
        (0.02, "+z.2f", "+0.02"),
        (0.0012, "+z.2f", "+0.00120"),
        (-0.0012, "+z.2f", "−0.00120"),
        (0.00018, ".3f", "0.000180"),
        (3.3, ".0f", "3"),
        (0.0006, ".2g", "0.000600"),
    ],
)
def test_small_errors_have_digits(value: float, form: str, text: str) -> None:
    """At least two digits of an error, and never zero for what is not."""
    assert in_form(value, form) == text


def test_error_summary() -> None:
    summary = error_summary([1.0, -1.0, 3.0, np.nan, -np.inf])
    assert summary["n"] == 3
    assert summary["bias"] == 1.0
    assert summary["sd"] == pytest.approx(2.0)
    assert summary["rms"] == pytest.approx(np.sqrt(11 / 3))
    assert summary["median_abs"] == 1.0
    assert error_summary([np.nan]) == {"n": 0, **dict.fromkeys(("bias", "sd", "rms", "median_abs", "abs_90"))}


def test_strict_json_has_no_infinity(tmp_path: Path) -> None:
    value = {"a": np.float64(np.inf), "b": [np.nan, 1], "c": np.arange(2), "d": np.bool_(True), "e": (np.int64(3),)}
    assert strict(value) == {"a": None, "b": [None, 1], "c": [0, 1], "d": True, "e": [3]}
    write_numbers(tmp_path / "report.json", strict(value))
    with pytest.raises(ValueError, match="JSON"):
        write_numbers(tmp_path / "bad.json", {"a": float("nan")})


def test_coverage_of_right_posteriors_is_nominal(calibration: Calibration) -> None:
    n = 2000
    radius = np.r_[np.full(n - 200, 12.3), np.zeros(100), np.full(100, np.inf)]
    rows = {row["parameter"]: row for row in coverage(evidence_of(calibration, posteriors_of(calibration, radius, 5)))}
    assert rows["theta_c"]["touches"] == rows["P"]["touches"] == n
    assert rows["R"]["touches"] == n - 200  # edges and flats are left out
    for row in rows.values():
        assert row["se_90"] == pytest.approx(100 * np.sqrt(0.09 / row["touches"]))
        for level, inside in row["percent_inside"].items():
            share = int(level) / 100
            # Four standard errors of a share of n touches.
            assert abs(inside / 100 - share) < 4 * np.sqrt(share * (1 - share) / row["touches"])


def test_coverage_of_the_load_counts_the_force_sensors_noise(calibration: Calibration) -> None:
    """Posteriors far narrower than the force sensor's noise must not look overconfident."""
    posteriors = posteriors_of(calibration, np.full(2000, 12.3), 6)
    narrow = {**posteriors.posterior, "P": np.full((4, 250, 2000), 200.0)}
    load = 200 + calibration.noise.force_sd * np.random.default_rng(7).standard_normal(2000)
    exact_load = replace(posteriors, posterior=narrow, rows=replace(posteriors.rows, load=load))
    rows = {row["parameter"]: row for row in coverage(evidence_of(calibration, exact_load))}
    assert abs(rows["P"]["percent_inside"]["90"] - 90) < 400 * np.sqrt(0.09 / 2000)


def test_calibration_uncertainty_is_of_the_named_quantities(calibration: Calibration) -> None:
    evidence, other = (evidence_of(calibration, posteriors_of(calibration, np.full(50, 12.3), i)) for i in (8, 9))
    rows = calibration_uncertainty(replace(evidence, counterpart=other), ("R", "theta_c"))
    assert rows is not None and [row["parameter"] for row in rows] == ["R", "theta_c"]
    assert rows[0]["propagated"]["posterior_sd"] == np.median(evidence.posteriors.sd("R"))
    assert rows[0]["plug_in"]["posterior_sd"] == np.median(other.posteriors.sd("R"))


def test_the_command_names_a_saved_diagnosis(calibration: Calibration) -> None:
    evidence = evidence_of(calibration, posteriors_of(calibration, np.full(3, 12.3), 0))
    start = "bayestouch report DATASET -o report --seed 1 --draws 64"
    for diagnosed, options in (
        (None, " --no-diagnosis"),
        (Diagnosed({}), ""),
        (Diagnosed({}, folder="my diagnosis"), " --diagnosis 'my diagnosis'"),
    ):
        assert command(replace(evidence, diagnosed=diagnosed)) == start + options


def test_convergence_counts_touches_that_miss(calibration: Calibration) -> None:
    """A touch beyond the priors is counted as such, whatever its draws are."""
    stats = {
        "ess_bulk": np.array([500.0, 300.0, np.nan, 300.0]),
        "rhat": np.array([1.0, 1.0, 1.5, 1.0]),
        "pareto_k": np.array([0.1, np.nan, 0.2, 0.1]),
        "round": np.array([1.0, 2.0, 3.0, 1.0]),
        "beyond_prior": np.array([0.0, 0.0, 0.0, 1.0]),
    }
    found = convergence(replace(posteriors_of(calibration, np.full(4, 12.3), 0), sample_stats=stats))
    grades = {row["name"]: row for row in found["grades"]}
    assert (found["touches"], found["beyond"], found["missed"], found["second_round"]) == (4, 1, 2, 2)
    assert (grades["ess_bulk"]["missed"], grades["ess_bulk"]["worst"]) == (3, 300.0)
    assert (grades["rhat"]["missed"], grades["rhat"]["worst"]) == (1, 1.5)
    assert grades["pareto_k"]["missed"] == 0


@pytest.mark.parametrize(
    ("inside", "touches", "words"),
    [
        (90.5, 2000, "can be trusted"),
        (87.0, 2000, "somewhat too small"),
        (70.0, 2000, "are too small"),
        (97.0, 2000, "or more, so the stated uncertainties can be trusted"),
        (81.0, 30, "as far as 30 touches can show"),
        (0.0, 1, "1 touch cannot show"),
    ],
)
def test_verdict_on_coverage(inside: float, touches: int, words: str) -> None:
    se = 100 * np.sqrt(0.09 / touches)
    row = {"parameter": "R", "touches": touches, "percent_inside": {"90": inside}, "se_90": se}
    assert words in _verdict([row])


def test_one_bad_parameter_is_not_hidden_by_good_ones() -> None:
    rows = [
        {"parameter": name, "touches": 1000, "percent_inside": {"90": inside}, "se_90": 0.95}
        for name, inside in (("theta_c", 91.0), ("R", 60.0), ("P", 99.0))
    ]
    assert "are too small" in _verdict(rows)


def minimal_pad_numbers(**changes: Any) -> dict[str, Any]:
    grades = {"beyond": 0, "missed": 0, "touches": 3, "grades": []}
    linearity = dict.fromkeys(
        ("load_exponent", "error_percent_peak_linear", "error_percent_peak_power", "load_trend_share")
    )
    return {
        "data": {"body": "pad", "simulated": False, "copied_percent": 0.0},
        "estimates": {"errors": [], "posterior_sd_mm": 0.2, "load": {"n": 0}, "spacing_mm": None},
        "trust": {"coverage": [], "convergence": grades, "calibration_convergence": None},
        "calibration": {"lack_of_fit": None, "error_percent_peak": None, "linearity": linearity},
        **changes,
    }


def test_answer_tells_what_went_wrong() -> None:
    assert len(answer(minimal_pad_numbers())["sentences"]) == 1
    bent = {"load_exponent": 0.63, "error_percent_peak_linear": 7.7, "error_percent_peak_power": 4.2}
    text = " ".join(
        answer(
            minimal_pad_numbers(
                calibration={"lack_of_fit": 4.2, "error_percent_peak": 3.0, "linearity": bent},
                trust={
                    "coverage": [],
                    "convergence": {"beyond": 1, "missed": 2, "touches": 3, "grades": []},
                    "calibration_convergence": {"met": False, "ess_bulk": 42.0, "rhat": 1.09},
                },
            )
        )["sentences"]
    )
    for words in (
        "lack of fit 4.2",
        "power 0.63",
        "effective sample size 42",
        "at 2 of 3 touches",
        "1 of 3 touches are harder or farther outside",
    ):
        assert words in text
    # what the page says beside the calibration: all but the errors
    only_errors = answer(minimal_pad_numbers())
    assert only_errors["of_model"] == [] and len(only_errors["sentences"]) == 1
    of_model = answer(
        minimal_pad_numbers(calibration={"lack_of_fit": None, "error_percent_peak": None, "linearity": bent})
    )["of_model"]
    assert len(of_model) == 1 and "power 0.63" in of_model[0]
    straight = {**bent, "load_exponent": 1.01}
    assert "Linearity" not in str(
        answer(
            minimal_pad_numbers(calibration={"lack_of_fit": None, "error_percent_peak": None, "linearity": straight})
        )
    )


def test_models_are_told_apart_from_statistics() -> None:
    statistics = {
        "touches": 30.0,
        "log_score": -1.0,
        "log_score_layer": -5.0,
        "error_percent_peak_layer": 2.0,
        "log_score_layer_with_map": -1.0,
        "error_percent_peak_layer_with_map": 1.0,
        "error_percent_peak_power": 4.0,
    }
    # The one with a map is better, but not clearly.
    used = used_model({"kernel": "layer", "empirical_map": "no"})
    assert [(row["model"], row["map"], row["used"]) for row in model_rows(statistics, used)] == [
        ("layer with map", True, False),
        ("layer", False, True),
    ]
    assert used_model({"kernel": "layer-line", "empirical_map": "yes"}) == "layer-line with map"
    # Names of statistics have no hyphens, those of kernels may have.
    hyphens = {
        "log_score_half_space_line": -4.0,
        "log_score_half_space_line_with_map": -1.0,
        "log_score_map_alone": -2.0,
    }
    for with_map, other in (("yes", False), ("no", True)):
        rows = model_rows(hyphens, used_model({"kernel": "half-space-line", "empirical_map": with_map}))
        assert [(row["model"], row["map"], row["used"]) for row in rows] == [
            ("half-space-line with map", True, not other),
            ("map alone", True, False),
            ("half-space-line", False, other),
        ]
    assert used_model({"kernel": "constant", "empirical_map": "yes"}) == "map alone"
    assert [row["value"] for row in statistic_rows(statistics)] == [30.0, -1.0, 4.0]


def test_notes_are_sentences_and_indenters_counted(calibration: Calibration) -> None:
    evidence = evidence_of(calibration, posteriors_of(calibration, np.full(3, 12.3), 0))
    dataset = replace(evidence.dataset, notes=("touches.csv: no load measured", "one touch only", "One touch only."))
    touches = dataset.touches.with_(indenter_radius_mm=np.full(dataset.touches.n_rows, np.nan))
    data = about_data(replace(evidence, dataset=replace(dataset, touches=touches)))
    assert data["notes"][:2] == ["touches.csv: no load measured.", "One touch only."]
    assert len(data["notes"]) == len(set(data["notes"]))
    assert data["touches_by_indenter"] == [
        {"indenter": "knife edge", "to_calibrate": 17, "to_be_read": 0},
        {"indenter": "flat", "to_calibrate": 5, "to_be_read": 0},
        {"indenter": "unknown", "to_calibrate": 0, "to_be_read": 5},
    ]


def write_old_report(folder: Path, numbers: str = "report.json") -> None:
    (folder / "figures").mkdir(parents=True)
    for name in ("kept.svg", "stale.svg", "own.svg"):
        (folder / "figures" / name).write_text("old")
    listed_figures = [{"file": "figures/kept.svg"}, {"file": "figures/stale.svg"}]
    (folder / numbers).write_text(json.dumps({"figures": listed_figures}))
    (folder / "notes.txt").write_text("mine")


def test_a_report_keeps_the_figures_of_a_diagnosis_in_its_folder(tmp_path: Path) -> None:
    output = tmp_path / "both"
    write_old_report(output, "diagnosis.json")
    with new_folder(output) as folder:
        (folder / "report.json").write_text(json.dumps({"figures": []}))
    assert (output / "figures" / "stale.svg").exists() and (output / "diagnosis.json").exists()


@pytest.mark.parametrize("numbers", ["report.json", "comparison.json", "diagnosis.json"])
def test_folder_is_replaced_file_by_file(tmp_path: Path, numbers: str) -> None:
    output = tmp_path / "report"
    write_old_report(output, numbers)
    with new_folder(output) as folder:
        (folder / "figures").mkdir()
        (folder / "figures" / "kept.svg").write_text("new")
        (folder / numbers).write_text(json.dumps({"figures": [{"file": "figures/kept.svg"}]}))
        assert (output / "figures" / "kept.svg").read_text() == "old"
    assert (output / "figures" / "kept.svg").read_text() == "new"
    # The user's own files stay, also among the figures; only figures that the old report listed are removed.
    assert {path.name for path in output.rglob("*") if path.is_file()} == {
        "kept.svg",
        "own.svg",
        numbers,
        "notes.txt",
    }
    assert [path.name for path in tmp_path.iterdir()] == ["report"]


def test_failure_leaves_the_old_report_alone(tmp_path: Path) -> None:
    output = tmp_path / "report"
    write_old_report(output)
    before = {path: path.read_bytes() for path in output.rglob("*") if path.is_file()}
    with pytest.raises(RuntimeError, match="half way"), new_folder(output) as folder:
        (folder / "report.json").write_text("half")
        raise RuntimeError("half way")
    assert before == {path: path.read_bytes() for path in output.rglob("*") if path.is_file()}
    assert [path.name for path in tmp_path.iterdir()] == ["report"]


def test_output_that_cannot_be_written_is_told_before_the_work(tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.write_text("a file")
    data = simulate(DESIGN, seed=2).dataset
    with pytest.raises(InputError, match="taken: expected the name of a folder"):
        bayestouch.report(data, taken)
    with pytest.raises(InputError, match="cannot be written"):
        bayestouch.report(data, taken / "report")
    assert taken.read_text() == "a file"


def test_corner_plots_without_a_home_folder(tmp_path: Path) -> None:
    """arviz, which corner loads, wants to write to the user's cache; where it cannot, corner plots are made without."""
    (tmp_path / "home").write_text("a file, so that nothing can be written below")
    program = (
        "import numpy as np; from bayestouch.reporting.corner_pictures import corner_png; "
        "print(corner_png(np.random.default_rng(0).standard_normal((200, 2)), ['a', 'b'])[1:4].decode())"
    )
    # matplotlib has a place of its own, and says so on standard error where it lacks one.
    environment = {**os.environ, "HOME": str(tmp_path / "home"), "MPLCONFIGDIR": str(tmp_path)}
    environment = {key: value for key, value in environment.items() if not key.startswith("XDG_")}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert done.stdout == "PNG\n", done.stderr


def test_a_page_states_the_peak_of_each_error_of_a_finger(calibration: Calibration) -> None:
    """Of the tables: the largest mean reading. Of the statistics: the reading of a knife edge at the mean load."""
    rows = calibration.rows
    rms = np.sqrt(((rows.observed - rows.predicted) ** 2).mean(axis=0))
    of_edge = np.abs(calibration.mode["response"]) * rows.load.mean()
    shown = 100 * rms / np.abs(rows.observed).max(axis=0)
    stated = 100 * rms / of_edge
    assert calibration.statistics["error_percent_peak"] == pytest.approx(stated.mean(), rel=1e-9)
    assert [row["error_percent_peak"] for row in element_table(calibration)["rows"]] == pytest.approx(shown, rel=1e-9)
    assert abs(shown.mean() / stated.mean() - 1) > 0.01, "two peaks, and so two values"
    numbers: dict[str, Any] = {
        "calibration": {"touches": 7, "models": [], "parameters": [], "settings": [], "statistics": []},
        "answer": {"of_model": []},
        "figures": [],
    }
    numbers["calibration"] |= {
        "peak": {"rows": [], "notes": [], "same_finger_as_paper": False},
        "elements": {"columns": [], "rows": []},
    }
    begin = '{% import "macros.html" as show with context %}{% set data = {"body": body} %}'
    begin += '{% import body ~ "/words.html" as own %}{% include "calibration.html" %}'
    page = {body: new_environment(numbers, ()).from_string(begin).render(body=body) for body in ("finger", "pad")}
    edge = "an element's peak is what the calibrated model reads of a knife edge right above it, at the mean load"
    said = {body: html.unescape(text) for body, text in page.items()}
    assert edge in said["finger"] and edge not in said["pad"]
    assert "its largest mean reading among these touches, except in the statistics below." in said["finger"]
    assert "its largest mean reading less its offset among these touches." in said["pad"]
