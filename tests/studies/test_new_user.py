"""The walk of a new user: its commands are on one page, few, and its limits can be missed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from study_modules import study

MODULE = study("new_user")


def test_each_goal_takes_at_most_three_commands_of_one_page() -> None:
    for goal in MODULE.GOALS:
        assert MODULE.not_on_a_page(goal) == []
        assert MODULE.Walk(goal, "any", MODULE.MOST_MINUTES, "").within_limits
        assert not MODULE.Walk(goal, "any", MODULE.MOST_MINUTES + 0.1, "").within_limits
        more = replace(goal, commands=(*goal.commands, *["bayestouch check"] * 3))
        assert not MODULE.Walk(more, "any", 0.0, "").within_limits


def test_a_command_that_the_page_does_not_show_ends_the_walk(tmp_path: Path) -> None:
    hidden = replace(MODULE.GOALS[0], commands=("bayestouch check my-pad --plot pad.png",))
    with pytest.raises(LookupError, match=r"quickstart\.md does not show: bayestouch check my-pad"):
        MODULE.walk(hidden, "any", tmp_path)


def test_arviz_itself_has_to_show_the_posterior(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The line of `infer` has the word posterior, too: it says nothing of what ArviZ shows."""
    goal = next(each for each in MODULE.GOALS if each.answer is MODULE.opened)
    printed = {"calibrate": "calibration.nc\n", "infer": "posterior.nc: 45 touches\n"}
    shown = "Inference data with groups:\n\t> sample_stats\n"

    def run(command: list[str], **_: object) -> SimpleNamespace:
        return SimpleNamespace(stdout=next((text for verb, text in printed.items() if verb in command), shown))

    monkeypatch.setattr(MODULE.subprocess, "run", run)
    monkeypatch.setattr(MODULE.bayestouch, "load", lambda _: range(45))
    with pytest.raises(ValueError, match="ArviZ shows no posterior"):
        MODULE.walk(goal, "any", tmp_path)
    shown = "Inference data with groups:\n\t> posterior\n"
    assert MODULE.walk(goal, "any", tmp_path).answer == "posteriors of 45 touches"


def test_table_of_the_page_is_within_the_limits() -> None:
    text = MODULE.QUICK_START.read_text("utf-8")
    table = text.partition("<!-- table of studies/new_user.py -->")[2].partition("<!-- end of")[0]
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in table.split("\n") if line.startswith("| ")
    ]
    assert len(rows) == 2 + len(MODULE.GOALS) * len(MODULE.EXAMPLES)
    for wish, _, commands, minutes, pages, answer in rows[2:]:
        assert wish in {goal.wish for goal in MODULE.GOALS} and answer
        assert int(commands) <= 3 and float(minutes) <= 5 and int(pages) <= 1
