"""The tutorial on measured data: what its page shows is what its commands print."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from study_modules import study

MODULE = study("tutorial")
TEXT = MODULE.PAGE.read_text("utf-8")
STEPS = list(MODULE.STEP.finditer(TEXT))
#: Steps that take seconds: the example, its table, the check. The slow tests run all of them on fewer touches
#: (`test_study_commands.py`).
QUICK = 3


def test_quick_outputs_are_those_of_the_page(tmp_path: Path) -> None:
    for step in STEPS[:QUICK]:
        assert MODULE.printed(step[1], step[2], tmp_path, {}) == step[3], step[2]
    assert "bayestouch check" in STEPS[QUICK - 1][2]


def test_every_verb_of_the_loop_is_shown_with_its_output() -> None:
    commands = [line for step in STEPS for line in re.findall(r"^\$ bayestouch (\w+)", step[2], re.MULTILINE)]
    assert commands == ["example", "check", "report", "diagnose", "infer"]
    silent = [step[2] for step in STEPS if not (step[3] or "").strip()]
    assert [re.findall(r"bayestouch (\w+)", each) for each in silent] in ([], [["report"]])


def test_numbers_of_the_text_are_printed_by_a_step() -> None:
    """The sentences repeat verdicts and effects; where the outputs change, this fails until the sentences do."""
    printed = "".join(step[3] or "" for step in STEPS)
    prose = re.sub(r"```.*?```", "", TEXT, flags=re.DOTALL)
    assert "`load_nonlinearity`" in prose and "Found load_nonlinearity" in printed
    assert "`gain_drift`" in prose and "gain_drift" in printed
    assert '"partly explained"' in prose and "Partly explained:" in printed
    assert "**Can its readings be trusted?** Yes, though the model has an error." in prose
    assert "Can its readings be trusted? Yes, though the model has an error." in printed
    size = re.search(r"did not reach its targets for the calibration \(effective sample size (\d+)", printed)
    assert (
        size
        and "**The sampler did not reach its targets**" in prose
        and f"count as {size[1]} independent ones" in prose
    )
    before, after = map(float, re.search(r"location_rms_mm: ([\d.]+) -> ([\d.]+)", printed).groups())  # type: ignore[union-attr]
    assert "falls to about a third" in prose and 0.25 < after / before < 0.4
    before, after = map(float, re.search(r"P_rms_N: ([\d.]+) -> ([\d.]+)", printed).groups())  # type: ignore[union-attr]
    assert "that of the load to about a half" in prose and 0.4 < after / before < 0.6
    error = float(re.search(r"location inside the array: rms error ([\d.]+) mm", printed)[1])  # type: ignore[index]
    assert f"is about {error} mm" in prose
    below = [int(share) for share in re.findall(r"N: median sd .*?(\d+)% below 1 mm", printed)]
    assert "above 2 N: there nearly every touch" in prose and below[0] < 75 and min(below[1:]) > 95


def test_long_lines_are_broken_and_a_failure_ends_the_run(tmp_path: Path) -> None:
    assert all(len(line) <= MODULE.WIDTH for line in MODULE.wrapped("word " * 100).splitlines())
    with pytest.raises(subprocess.CalledProcessError):
        MODULE.run("```console\n$ bayestouch check absent\n```\n", tmp_path)
    page = "```python\nprint(6 * 7)\n```\n\n```text\n41\n```\n"
    assert MODULE.run(page, tmp_path) == page.replace("41", "42")
