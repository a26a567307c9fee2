"""Sentences of single parts of the page: of each body, of one touch or many, and where nothing was held out."""

from __future__ import annotations

from typing import Any

import pytest
from report_cases import Page

from bayestouch.reporting.page import new_environment


def words(template: str, numbers: dict[str, Any]) -> str:
    """Text of a part of the page, with single spaces."""
    environment = new_environment(numbers, ())
    before = '{% import "macros.html" as show with context %}{% import "finger/words.html" as own %}'
    whole = before + f'{{% set simulated_note = "" %}}{{% include "{template}" %}}'
    return " ".join(" ".join(Page(environment.from_string(whole).render()).text).split())


@pytest.mark.parametrize(("body", "offered"), [("finger", True), ("pad", False)])
def test_only_a_finger_has_another_prior_of_the_radius(body: str, offered: bool) -> None:
    """`bayestouch infer --indenter` refuses pads."""
    found = {"noticeable": 0.05, "parameters": []}
    numbers = {"checks": {"predictive": None, "prior_sensitivity": found}, "data": {"body": body}}
    said = words("checks.html", numbers)
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
