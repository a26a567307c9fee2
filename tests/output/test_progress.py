"""Progress of stages within a task, and the bar that names them."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from bayestouch.output.progress import Bar, staged


class Drawn:
    """What a bar of tqdm is told."""

    def __init__(self) -> None:
        self.n = 0.0
        self.told: list[tuple[str, float]] = []
        self.text = ""

    def set_description_str(self, text: str, refresh: bool) -> None:
        self.text = text

    def update(self, more: float) -> None:
        self.n += more
        self.told.append((self.text, round(self.n, 9)))


def test_a_stage_within_a_stage_is_named_and_takes_its_share() -> None:
    drawn = Drawn()
    bar = Bar("report", drawn)
    first = staged(bar, 0.0, 0.5, "calibrate")
    assert first is not None
    first(0.5)
    outer = staged(bar, 0.5, 1.0, "diagnose")
    inner = staged(outer, 0.2, 0.6, "round 1")
    assert inner is not None
    inner(1.0)
    bar(0.7)  # never backwards
    assert drawn.told == [
        ("report: calibrate", 0.0),
        ("report: calibrate", 0.25),
        ("report: diagnose", 0.5),
        ("report: diagnose, round 1", 0.6),
        ("report: diagnose, round 1", 0.8),
        ("report", 0.8),
    ]


@pytest.mark.parametrize(
    ("stages", "text"),
    [
        ("search, round 2, refit crosstalk", "diagnose: search, round 2, refit crosstalk"),
        ("search, round 2, refit prober_eccentricity", "diagnose: round 2, refit prober_eccentricity"),
        ("search, start 2, round 2, refit aperture", "diagnose: start 2, round 2, refit aperture"),
        ("search, round 2, refit " + 40 * "x", "diagnose: refit " + 29 * "x" + "…"),
    ],
)
def test_the_text_of_a_bar_leaves_room_in_80_columns(stages: str, text: str) -> None:
    """Percentage, times and a bar of one character take 33; outer stages go first."""
    drawn = Drawn()
    Bar("diagnose", drawn).tell(0.5, stages)
    assert drawn.text == text and len(text) + 33 < 80


def test_a_function_of_a_user_is_told_fractions_alone() -> None:
    told: list[float] = []
    stage = staged(staged(told.append, 0.5, 1.0, "diagnose"), 0.0, 0.5, "round 1")
    assert stage is not None
    stage(1.0)
    assert told == [0.5, 0.5, 0.75]
    assert staged(None, 0.0, 1.0, "calibrate") is None


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals on this system")
def test_a_terminal_shows_the_stage_and_the_time_left() -> None:
    program = (
        "import time; from bayestouch.output.progress import progress_bar, staged\n"
        "with progress_bar('report', False) as bar:\n"
        "    stage = staged(bar, 0.0, 0.5, 'calibrate')\n"
        "    time.sleep(2.2); stage(0.4)\n"
        "    time.sleep(0.2); staged(bar, 0.5, 1.0, 'read touches')\n"
    )
    import termios

    ours, theirs = os.openpty()
    termios.tcsetwinsize(theirs, (24, 100))  # a bar needs a width
    with subprocess.Popen([sys.executable, "-c", program], stderr=theirs) as process:
        process.wait(60)
    os.close(theirs)
    text = os.read(ours, 100_000).decode().replace("\r", "\n")
    os.close(ours)
    assert "report: read touches  50%" in text
    # a fifth took 2.2 s or a little more, so that at least 8.8 s are left
    shown = text.partition("report: calibrate  20%")[2].partition(" left")[0]
    minutes, seconds = map(int, shown.rsplit(" ", 1)[-1].split(":"))
    assert 60 * minutes + seconds >= 8
