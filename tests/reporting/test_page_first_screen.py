"""First screen of a report: what is said where there is no diagnosis, and where there are no references."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from report_cases import Page

from bayestouch.reporting.page import new_environment

SKETCH = SimpleNamespace(view="0 0 1 1", alt="", shapes=[], low="", high="", scale="", title="")
ROW = {"question": "What to fix?", "short": "Nothing", "reason": "None"}


def first_screen(
    diagnosis: dict[str, Any] | None = None,
    headline: tuple[dict[str, Any], ...] = (),
    copied: float = 0.0,
    unread: int = 0,
) -> str:
    """Text of the first screen, with single spaces."""
    numbers = {
        "answer": {"verdict": [ROW], "headline": headline},
        "diagnosis": diagnosis,
        "data": {"copied_percent": copied, "without_reading": unread},
    }
    template = new_environment(numbers, ()).get_template("first_screen.html")
    return " ".join(" ".join(Page(template.render(sketch=SKETCH, loops=None)).text).split())


@pytest.mark.parametrize(
    ("diagnosis", "said"),
    [
        (None, "No effect was searched for, so there is no before and after."),
        (
            {"missing": "No effect was searched for: too few touches."},
            "No effect was searched for, so there is no before and after.",
        ),
        ({"verdict": "adequate"}, "No touches were held out, so there is no before and after."),
    ],
)
def test_there_is_a_page_without_before_and_after(diagnosis: dict[str, Any] | None, said: str) -> None:
    assert said in first_screen(diagnosis)


RMS = "Rms errors of touches not calibrated with, and their 90 % intervals (bootstrap over places)."
SD = "Without a reference: median posterior standard deviation, and the range of 90 % of the touches."


@pytest.mark.parametrize(
    ("kinds", "said"),
    [(("rms error",), (RMS,)), (("posterior sd",), (SD,)), (("rms error", "posterior sd"), (RMS, SD))],
)
def test_the_caption_is_that_of_the_figures(kinds: tuple[str, ...], said: tuple[str, ...]) -> None:
    row = {"quantity": "location", "unit": "mm", "value": 0.2, "low": 0.1, "high": 0.3, "touches": 9}
    made = first_screen(headline=tuple({**row, "kind": kind} for kind in kinds))
    assert [each in made for each in (RMS, SD)] == [each in said for each in (RMS, SD)]


def test_copies_of_calibration_touches_were_calibrated_with() -> None:
    row = {"quantity": "location", "unit": "mm", "value": 0.2, "low": 0.1, "high": 0.3, "touches": 9}
    for copied, which in ((10.0, "some"), (100.0, "all")):
        made = first_screen(headline=({**row, "kind": "rms error"},), copied=copied)
        assert f"Rms errors of touches to be read ({which} were calibrated with), and their 90 % intervals" in made


@pytest.mark.parametrize(("touches", "said"), [(1, "(1 touch)"), (2, "(2 touches)")])
def test_one_touch_is_not_many(touches: int, said: str) -> None:
    row = {"quantity": "location", "unit": "mm", "value": 0.2, "low": None, "high": None, "kind": "rms error"}
    assert said in first_screen(headline=({**row, "touches": touches},))


@pytest.mark.parametrize(
    ("unread", "said"),
    [(1, "1 touch without any reading is left out"), (3, "3 touches without any reading are left out")],
)
def test_touches_that_are_left_out_are_counted(unread: int, said: str) -> None:
    assert f"{said} of all errors and figures." in first_screen(unread=unread)
    assert "without any reading" not in first_screen()
