"""Sentences of single parts of the page: of each body, of one touch or many, and where nothing was held out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from report_cases import Page

from bayestouch.reporting.about import _notes
from bayestouch.reporting.page import new_environment


def words(template: str, numbers: dict[str, Any], body: str = "finger") -> str:
    """Text of a part of the page, with single spaces."""
    environment = new_environment(numbers, ())
    before = '{% import "macros.html" as show with context %}{% set simulated_note = "" %}'
    whole = before + f'{{% import "{body}/words.html" as own %}}{{% include "{template}" %}}'
    return " ".join(" ".join(Page(environment.from_string(whole).render()).text).split())


@pytest.mark.parametrize(("body", "offered"), [("finger", True), ("pad", False)])
def test_only_a_finger_has_another_prior_of_the_radius(body: str, offered: bool) -> None:
    """`bayestouch infer --indenter` refuses pads."""
    found = {"noticeable": 0.05, "parameters": []}
    said = words("checks.html", {"checks": {"predictive": None, "others_read": True, "prior_sensitivity": found}}, body)
    assert "Touches have uniform priors, which no power changes" in said
    assert ("--indenter" in said) == offered


READ, READINGS = {"R_rms_mm": 0.5, "lack_of_fit": 1.0}, {"R_rms_mm": None, "lack_of_fit": 1.0}
FULL = "makes a full one, with errors of R and coverage before and after."


@pytest.mark.parametrize(
    ("errors", "held_out", "table", "full"),
    [(READ, 10, True, False), (READINGS, 10, True, True), (dict.fromkeys(READ), 0, False, False)],
)
def test_without_held_out_touches_nothing_is_said_of_them(
    errors: dict[str, float | None], held_out: int, table: bool, full: bool
) -> None:
    """No table without rows, and no promise of errors that no command can give."""
    diagnosis = {
        "verdict": "adequate",
        "data": {"held_out_touches": held_out},
        "sentences": [],
        "made": "made with this report",
        "before": errors,
        "after": errors,
        "effects": [],
        "correction": None,
        "noise_floor_percent_peak": None,
        "candidates": [],
        "causes": [],
    }
    residuals = {"readings": 1, "rms": 1.0, "beyond_3_percent": 0.0, "prediction": None}
    said = words("diagnosis.html", {"diagnosis": diagnosis, "residuals": residuals, "figures": []})
    assert ("Before and after, on touches held out of every fit" in said) == table
    assert (FULL in said) == full
    assert "A diagnosis made with this report." in said


def grades(touches: int, **few: int) -> dict[str, Any]:
    found = {"touches": touches, "missed": 0, "beyond": 0, "second_round": 0, "grades": [], **few}
    return {"trust": {"calibration_convergence": None, "convergence": found}}


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (grades(1), ("the touch meets the targets", "Convergence of the sampler over 1 touch")),
        (grades(21), ("all 21 touches meet the targets", "Convergence of the sampler over 21 touches")),
        (grades(30, missed=1), ("a target was not reached at 1 of 30 touches", "R-hat was not reached at 1 touch.")),
        (grades(30, missed=2), ("a target was not reached at 2 of 30 touches", "R-hat was not reached at 2 touches.")),
        (grades(30, beyond=1), ("1 of 30 touches is beyond the calibration", "1 touch is beyond the loads or")),
        (grades(30, beyond=2), ("2 of 30 touches are beyond the calibration", "2 touches are beyond the loads or")),
        (grades(30, second_round=1), ("1 touch was given a second round.",)),
        (grades(30, second_round=3), ("3 touches were given a second round.",)),
    ],
)
def test_one_touch_is_not_many(found: dict[str, Any], said: tuple[str, ...]) -> None:
    text = words("convergence.html", found)
    for sentence in said:
        assert sentence in text


@pytest.mark.parametrize(
    ("count", "copied", "said"),
    [
        (1, 0.0, "1 touch not calibrated with"),
        (9, 0.0, "9 touches not calibrated with"),
        (9, 10.0, "9 touches to be read (some were calibrated with)"),
    ],
)
def test_predicted_touches_are_counted(count: int, copied: float, said: str) -> None:
    peak = {"average": 1.0, "minimum": 0.5, "maximum": 2.0}
    prediction = {"touches": count, "percent_peak": peak}
    residuals = {"readings": 1, "rms": 1.0, "beyond_3_percent": 0.0, "prediction": prediction}
    numbers = {"residuals": residuals, "data": {"copied_percent": copied}, "figures": []}
    assert f"readings of {said} are predicted to 1 %" in words("residuals.html", numbers)


ERRORS = {"n": 4, "bias": 0.1, "sd": 0.1, "rms": 0.1, "median_abs": 0.1, "abs_90": 0.1}
OF_ALL = {"where": "all", "touches": 4, "distance": ERRORS, "axes": {"x": ERRORS}, "posterior_sd_median_mm": 0.1}


@pytest.mark.parametrize(
    ("copied", "said"),
    [(0.0, "Touches not calibrated with."), (100.0, "Touches to be read (all were calibrated with).")],
)
def test_the_table_of_a_pad_says_which_touches_it_has(copied: float, said: str) -> None:
    assert said in words("pad/estimates.html", of_pad({"n": 0, "unit": "N"}, copied, OF_ALL), "pad")


@pytest.mark.parametrize(
    ("unit", "said"),
    [
        ("N", "No load was measured, so nothing can be said of its error."),
        ("", "No load was measured in the calibration: loads are relative to its usual load, so"),
    ],
)
def test_loads_that_were_not_in_the_calibration_may_be_measured(unit: str, said: str) -> None:
    """A calibration without loads reads them without a unit, whether the touches have loads or not."""
    text = words("pad/estimates.html", of_pad({"n": 0, "unit": unit}), "pad")
    assert said in text and text.count("No load was measured") == 1


def of_pad(load: dict[str, Any], copied: float = 0.0, *rows: dict[str, Any]) -> dict[str, Any]:
    """Numbers of a report on a line of elements, with these errors of load and location."""
    errors = [{**row, "several_modes_percent": 0.0} for row in rows]
    estimates = {"errors": errors, "load": load, "axes": ["x"], "posterior_sd_mm": 0.1, "spacing_mm": None}
    return {"estimates": estimates, "data": {"copied_percent": copied}, "figures": []}


REST = "no reading without contact: readings are taken as they are"
OF_FINGER = f"{REST}; a finger has no offset, so they must be zero without touch (a diagnosis looks for an offset)"


@pytest.mark.parametrize(
    ("calibration", "told"),
    [(REST, ["No reading without contact: readings are taken as they are."]), (OF_FINGER, [f"N{OF_FINGER[1:]}."])],
)
def test_a_note_that_another_begins_with_is_said_once(calibration: str, told: list[str]) -> None:
    parts = {"calibration": calibration, "posteriors": REST}
    evidence: Any = SimpleNamespace(
        dataset=SimpleNamespace(notes=()), **{name: SimpleNamespace(notes=(note,)) for name, note in parts.items()}
    )
    assert _notes(evidence) == told
