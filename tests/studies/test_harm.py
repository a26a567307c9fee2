"""The list of harm, and the tables of `places_and_times`, by hand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from study_modules import study

harm = study("harm")
places = study("places_and_times")
import _place_time_tables as placed  # noqa: E402  # beside the study, which puts its folder on the path


def of_place(kind: str, seed: int, before: float, after: float, spread: float, **more: Any) -> dict[str, Any]:
    """A made-up result of `places_and_times`."""
    case = {"kind": kind, "rubber": "soft", "order": "scan", "seed": seed, "percent": 2.0, "version": "1"}
    said = {"said": "place", "verdict": "unattributed", "effects": [], "key": json.dumps([kind, seed])}
    errors = {
        "before": {"R_rms_mm": before, "lack_of_fit": 4.0},
        "after": {"R_rms_mm": after, "lack_of_fit": 1.0},
        "after_against_stated": {"R_rms_mm": after, "lack_of_fit": 1.0},
        "change_against_stated_se": {"R_rms_mm": spread, "lack_of_fit": 0.1},
    }
    return {**case, **said, **errors, **more}


SOME = [
    of_place("place", 1, 0.50, 0.22, 0.05),
    of_place("place", 2, 0.50, 0.59, 0.05),  # worse, within two standard errors
    of_place("place", 3, 0.50, 0.61, 0.05),  # worse beyond them
    of_place("none", 1, 0.20, 0.20, 0.0, said="nothing"),
    of_place("none", 2, 0.60, 0.60, 0.0, said="nothing"),
    {"kind": "place", "rubber": "soft", "order": "scan", "seed": 4, "version": "1", "key": "x", "error": "E: no"},
]


def test_fingers_of_a_place_are_counted_and_listed() -> None:
    """0.22 over 0.2 is 1.1, as well as without the error; 0.59 over 0.6 is better; finger 3 has no other beside it."""
    text = placed.tables(SOME)
    row = next(line for line in text.splitlines() if line.startswith("| place, soft rubber, scan | 3 |"))
    assert row.endswith("| 0 | 3 | 0 | 0 | 0 | 0.50 → 0.59 | 2 | 1 | 2 of 2 | 4.0 → 1.00 |")
    assert "| place 2 %, soft, scan, 3 | place | 0.500 → 0.610 | +0.110 ± 0.050 |  |" in text
    assert "| place 2 %, soft, scan, 1 | place | 0.500 → 0.220 | -0.280 ± 0.050 | 1.10 |" in text
    assert "Diagnoses that failed: 1." in text and "E: no" in text


def test_forty_fingers_have_no_error_and_seeds_are_fresh() -> None:
    every = places.cases(places.FRESH, places.KINDS)
    plain = [each for each in every if each.kind == "none"]
    assert {each.seed for each in every} == set(range(7400, 7410))
    assert len(plain) == 40 and {(each.rubber, each.order) for each in plain} == {
        (rubber, order) for rubber in ("soft", "stiff") for order in ("scan", "random")
    }
    assert len(every) == 120 and len({each.key for each in every}) == 120


def test_a_cause_of_no_place_and_no_time_is_not_counted_as_nothing() -> None:
    """What is said of each finding is written out by the rules of the table."""

    def found(*effects: str, in_place: dict[str, Any] | None = None, undecided: tuple[str, ...] = ()) -> dict[str, Any]:
        pairs = [[name, "something in place"] for name in undecided]
        return {
            "effects": [{"name": name} for name in effects],
            "not_distinguishable": pairs,
            "in_place": in_place,
        }

    assert places.said(found("crosstalk")) == "other"
    assert places.said(found("crosstalk", in_place={"removed": 0.9})) == "place"
    assert places.said(found("crosstalk", "gain_drift")) == "drift"
    assert places.said(found()) == "nothing"


def test_a_finger_without_an_error_is_the_same_but_for_it() -> None:
    """The error of 2 % of the peak alone is between them; times, tips and noise are the same."""
    import numpy as np

    plain, placed_error = (places.Case(kind, "soft", "scan", 1).data() for kind in ("none", "place"))
    difference = placed_error.touches.readings - plain.touches.readings
    np.testing.assert_array_equal(placed_error.touches.time_s, plain.touches.time_s)
    peak = np.abs(plain.touches.readings).max()
    # smooth over places: what samples of one touch differ by is the noise of both, which cancels
    first = plain.touches.touch == plain.touches.touch[0]
    assert np.ptp(difference[first], axis=0).max() < 1e-9 * peak
    assert 0.002 * peak < np.abs(difference).max() < 0.15 * peak


def test_the_list_has_each_reading_that_is_worse_beyond_two_standard_errors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    exam = {
        "R": {"before": 0.5, "after": 0.75, "change": 0.3, "standard_error": 0.1},
        "theta_c": {"before": 0.1, "after": 0.1, "change": 0.0, "standard_error": 0.0},
        "P": {"before": 2.0, "after": 2.1, "change": 0.41, "standard_error": 0.21},
    }
    common = {"kind": "one", "seed": 5, "design": "small", "version": "1", "effects": [["creep: power", 2.0]]}
    of_exam = {**common, "rubber": "soft", "order": "scan", "key": "a", "exam": exam, "before": {}, "after": {}}
    numbers = {
        "before": {"R_rms_mm": 0.5, "R_bias_mm": -0.1, "P_rms_N_per_m": None},
        "after": {"R_rms_mm": 0.4, "R_bias_mm": 0.1, "P_rms_N_per_m": None},
        "after_against_stated": {"R_rms_mm": 0.7, "R_bias_mm": 0.1, "P_rms_N_per_m": None},
        "change_against_stated_se": {"R_rms_mm": 0.05, "R_bias_mm": 0.01, "P_rms_N_per_m": None},
    }
    of_rates = {**common, "key": "b", "diagnosis": numbers}
    of_causes = {**common, "key": "c", "causes": []}
    files = {"blind": [of_exam], "places": SOME, "rates": [of_rates], "causes": [of_causes]}
    paths = [tmp_path / name for name in files]
    for path, results in zip(paths, files.values(), strict=True):
        path.write_text("".join(json.dumps(each) + "\n" for each in results))
    found = harm.main([str(path) for path in paths])
    counts = {Path(name).name: (len(some), sum(each.worse for each in some)) for name, some in found.items()}
    assert counts == {"blind": (3, 1), "places": (5, 1), "rates": (2, 1), "causes": (0, 0)}
    text = capsys.readouterr().out
    assert "| one, creep: power 2, soft, scan, small, seed 5 | R | 0.5 → 0.75 mm | 3.0 |  |" in text
    assert "| place, soft, scan, 2 %, seed 3 | R_rms_mm | 0.5 → 0.61 mm | 2.2 |  |" in text
    assert "| one, creep: power 2, small, seed 5 | R_rms_mm | 0.5 → 0.7 mm | 4.0 | 0.4 mm |" in text
    assert "1 of 1 results have no errors of readings" in text


def test_a_change_without_a_standard_error_counts() -> None:
    assert harm.in_errors(0.1, 0.0) == float("inf") and harm.in_errors(-0.1, 0.0) == -float("inf")
    assert harm.in_errors(0.0, 0.0) == 0.0
