"""Regressions without physics in the report of a pad: numbers, table, and what is refused."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from report_cases import FINGER, LINE, Page, small, strict_json
from report_checks import check_page_holds_no_other_numbers, check_page_is_sound_and_needs_nothing_else

import bayestouch
from bayestouch.baselines import (
    HeldOutBaseline,
    RegressionTouches,
    baselines,
    gaussian_process,
    polynomial,
    read_by_regression,
)
from bayestouch.errors import InputError
from bayestouch.model.held_out import rms_percent
from bayestouch.model.observations import Observations
from bayestouch.model.split_data import SplitData
from bayestouch.output.text import number
from bayestouch.reporting.baseline_table import beside_regressions
from bayestouch.reporting.diagnosed import saved_diagnosis
from bayestouch.simulation import simulate

#: With fewer touches to be read, none of these would be held out.
DESIGN = replace(LINE, n_touches=40)


@pytest.mark.slow
def test_numbers_are_those_of_the_held_out_touches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("sklearn", reason="needs the extra `baselines`")
    peaks = []

    def noted(data: SplitData, held_out: Observations, peak: np.ndarray) -> tuple[HeldOutBaseline, ...]:
        peaks.append(peak)
        return baselines(data, held_out, peak)

    monkeypatch.setattr("bayestouch.baselines.baselines", noted)
    # what is noted in another process would not be known here
    monkeypatch.setattr("bayestouch.parallel.beside.cores", lambda workers: 1)
    dataset = simulate(DESIGN, effects={"creep": 0.2}, seed=7).dataset
    report = bayestouch.report(dataset, tmp_path / "out", draws=64, baselines=True)
    check_page_is_sound_and_needs_nothing_else(report)
    check_page_holds_no_other_numbers(report)
    whole = strict_json(report.path / "report.json")
    found = whole["diagnosis"]
    assert whole["bayestouch"]["command"].endswith("--baselines") and "scikit-learn" in whole["bayestouch"]["versions"]

    # By hand: every other touch to be read is held out, the others join the calibration.
    assert dataset.calibration is not None
    rest = dataset.calibration.rest_reading()
    fitted = dataset.calibration.baseline_corrected().averaged()
    table = dataset.touches.baseline_corrected(rest)
    read = table.averaged()
    (peak,) = peaks
    place = np.concatenate([fitted.location, read.location[0::2]])
    load = np.concatenate([fitted.load, read.load[0::2]])
    known = RegressionTouches(place, load, np.concatenate([fitted.readings, read.readings[0::2]]) / peak)
    reads = read.reads_of_load[1::2]
    held = RegressionTouches(read.location[1::2], read.load[1::2], read.readings[1::2] / peak, reads)
    assert held.load is not None and found["data"]["held_out_touches"] == len(held.load) == DESIGN.n_touches // 2
    for way, row in zip((gaussian_process, polynomial), found["baselines"], strict=True):
        regression = way(known)
        posterior = read_by_regression(regression, known, held, dataset.sensor.force_noise_sd)
        distance = np.abs(posterior.location - held.location)[:, 0]
        error = posterior.load - held.load
        low, high = posterior.load_interval.T
        assert row["name"] == regression.name
        assert row["location_median_mm"] == pytest.approx(np.median(distance), rel=1e-6)
        assert row["location_rms_mm"] == pytest.approx(np.sqrt(np.mean(distance**2)), rel=1e-6)
        assert row["P_rms_N"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-6)
        assert row["coverage_90"] == posterior.location_inside.mean()
        assert row["P_coverage_90"] == np.mean((low <= held.load) & (held.load <= high))
        predicted = regression(held.inputs)[0]
        assert row["touch_error_percent_peak"] == pytest.approx(rms_percent(held.readings - predicted), rel=1e-6)
        pressed = table.select(table.in_contact & np.isin(table.touch, read.touch[1::2]))
        of_touch = np.searchsorted(np.unique(pressed.touch), pressed.touch)
        samples = rms_percent(pressed.readings / peak - predicted[of_touch])
        assert row["prediction_error_percent_peak"] == pytest.approx(samples, rel=1e-6)
        # Creep moves samples about the mean of their touch: mean squares add.
        assert samples > row["touch_error_percent_peak"]
    check_page_has_them(report.path / "index.html", found)


def check_page_has_them(page: Path, found: dict[str, Any]) -> None:
    cells = Page(page.read_text("utf-8")).cells
    rows = [found["before"], *found["baselines"], found["after_against_stated"]]
    assert [cells.count(each["name"]) for each in found["baselines"]] == [1, 1]
    for key in ("touch_error_percent_peak", "location_median_mm", "location_rms_mm", "P_rms_N"):
        assert {number(each[key]) for each in rows} <= set(cells)
    # Half of the touches are at least as far off as the median.
    assert all(0 < each["location_median_mm"] <= np.sqrt(2) * each["location_rms_mm"] for each in rows)


def errors(location: float, **more: Any) -> dict[str, Any]:
    base = {"prediction_error_percent_peak": 2.0, "touch_error_percent_peak": 2.0, "P_rms_N": None}
    return {**base, "location_rms_mm": location, "coverage_90": 0.5, "R_rms_mm": None, **more}


def test_rows_are_before_the_regressions_and_after_as_stated() -> None:
    diagnosis = {
        "before": errors(4.0),
        "after": errors(1.0),
        "after_against_stated": errors(2.0),
        "baselines": [errors(3.0, name="Gaussian process"), errors(5.0, name="polynomial")],
    }
    table = beside_regressions(diagnosis)
    assert table is not None
    assert [row["name"] for row in table["rows"]] == ["before", "Gaussian process", "polynomial", "after"]
    assert [row["location_rms_mm"] for row in table["rows"]] == [4.0, 3.0, 5.0, 2.0]
    assert {row["coverage_90"] for row in table["rows"]} == {50.0}
    # One sample a touch, and no load: no column for them.
    assert [key for key, *_ in table["columns"]] == [
        "name",
        "prediction_error_percent_peak",
        "location_rms_mm",
        "coverage_90",
    ]
    assert table["columns"][1][1] == "prediction error"


def test_errors_of_samples_and_of_touch_means_have_a_column_each() -> None:
    one = errors(1.0, touch_error_percent_peak=1.5)
    diagnosis = {"before": one, "after": one, "after_against_stated": one, "baselines": [{**one, "name": "polynomial"}]}
    table = beside_regressions(diagnosis)
    assert table is not None
    assert [header for _, header, *_ in table["columns"]][1:3] == [
        "prediction error of samples",
        "prediction error of touch means",
    ]


@pytest.mark.parametrize("more", [{}, {"baselines": []}])
def test_no_table_without_touches_read_by_regressions(more: dict[str, Any]) -> None:
    one = errors(1.0)
    assert beside_regressions({"before": one, "after": one, "after_against_stated": one, **more}) is None


@pytest.mark.parametrize(
    ("finger", "options", "words"),
    [
        (True, {}, "a report with baselines is offered for pads; this sensor is a finger"),
        (False, {"diagnosis": False}, "expected a diagnosis that is made with the report .*, got none"),
        (False, {"diagnosis": "SAVED"}, "expected a diagnosis that is made with the report .*, got a saved one"),
        (False, {"diagnosis": True}, r"needs scikit-learn.*pip install 'bayestouch\[baselines\]'"),
    ],
)
def test_what_is_refused_is_refused_at_once(
    finger: bool, options: dict[str, Any], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "sklearn", None)
    monkeypatch.setattr("bayestouch.calibration.calibrate", lambda *_, **__: pytest.fail("the refusal came late"))
    dataset = small(FINGER if finger else LINE).dataset
    with pytest.raises(InputError, match=words) as raised:
        bayestouch.report(dataset, tmp_path / "out", baselines=True, **options)
    assert "\n" not in str(raised.value)
    assert not (tmp_path / "out").exists()


def test_a_saved_diagnosis_brings_no_baselines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`bayestouch diagnose` writes none, so what a file says under this name is not shown."""
    numbers = {
        "data": {"elements": 3},
        "figures": [],
        "baselines": "<b>",
    }
    monkeypatch.setattr("bayestouch.reporting.diagnosed.read_diagnosis", lambda file: dict(numbers))
    monkeypatch.setattr("bayestouch.diagnosis.outcome.sentences", lambda numbers, with_causes: [])
    assert "baselines" not in saved_diagnosis(tmp_path, small(LINE).dataset).numbers
