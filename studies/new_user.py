"""The walk of a new user: commands, minutes and pages from a data set to three answers.

    python studies/new_user.py [FOLDER] [--small] [--docs]

The three answers: may the readings be trusted; posteriors that ArviZ has opened; the cause of the error, with errors
before and after. Example data take the place of the user's own. Each command runs as a user types it, in a folder that
holds the data set and what the commands before it wrote, and the documentation page has to show it. ``--docs`` puts the
table into `docs/quickstart.md`, ``--small`` takes a finger of four elements.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from _page import DOCS, markdown_table, put_into_page

import bayestouch
from bayestouch.simulation import save_simulated
from bayestouch.simulation.examples import save_example

QUICK_START = DOCS / "quickstart.md"
#: Folder of the user's data set, as the page names it.
DATA = "my-finger"
#: Examples that stand for the user's data, and what the table calls them.
EXAMPLES = {"finger": "simulated finger", "fluid-oil-1.5": "measured channel"}
#: What a new user must not need more of.
MOST_COMMANDS, MOST_MINUTES, MOST_PAGES = 3, 5.0, 1
ARVIZ = """python -c 'import arviz as az; print(az.from_netcdf("posterior.nc"))'"""


@dataclass(frozen=True)
class Goal:
    """What a user wants, the commands on one page that give it, and how the answer is read.

    `answer` is a function of the folder and of what the last command printed.
    """

    wish: str
    commands: tuple[str, ...]
    pages: tuple[Path, ...]
    answer: Callable[[Path, str], str]


@dataclass(frozen=True)
class Walk:
    """A goal that was reached with some data."""

    goal: Goal
    data: str
    minutes: float
    answer: str

    @property
    def within_limits(self) -> bool:
        """Whether commands, minutes and pages are few enough."""
        goal = self.goal
        few = len(goal.commands) <= MOST_COMMANDS and len(goal.pages) <= MOST_PAGES
        return few and self.minutes <= MOST_MINUTES


def trusted(folder: Path, printed: str) -> str:
    """Answer of the report to the first question."""
    verdict = json.loads((folder / "my-report" / "report.json").read_text("utf-8"))["answer"]["verdict"]
    return str(verdict[0]["short"])


def opened(folder: Path, printed: str) -> str:
    """Number of touches whose posteriors are in the file, once ArviZ has shown its group."""
    if "posterior" not in printed:
        raise ValueError("ArviZ shows no posterior")
    return f"posteriors of {len(bayestouch.load(folder / 'posterior.nc'))} touches"  # type: ignore[arg-type]


def cause(folder: Path, printed: str) -> str:
    """Effects that the diagnosis found, and the error of the location before and after."""
    numbers = json.loads((folder / "my-diagnosis" / "diagnosis.json").read_text("utf-8"))
    found = ", ".join(each["name"] for each in numbers["effects"]) or "no cause"
    before, after = numbers["before"], numbers["after"]
    name, what = ("location_rms_mm", "the location") if before["R_rms_mm"] is None else ("R_rms_mm", "R")
    return f"{found}; rms error of {what} {before[name]:.2f} → {after[name]:.2f} mm"


GOALS = (
    Goal(
        "May I trust the readings?",
        (f"bayestouch check {DATA}", f"bayestouch report {DATA} -o my-report"),
        (QUICK_START,),
        trusted,
    ),
    Goal(
        "Posteriors in ArviZ",
        (
            f"bayestouch calibrate {DATA} -o calibration.nc",
            f"bayestouch infer {DATA}/touches.csv --calibration calibration.nc -o posterior.nc",
            ARVIZ,
        ),
        (QUICK_START,),
        opened,
    ),
    Goal(
        "The cause, before and after",
        (f"bayestouch diagnose {DATA} -o my-diagnosis",),
        (QUICK_START,),
        cause,
    ),
)


def not_on_a_page(goal: Goal) -> list[str]:
    """Commands that the pages of a goal do not show."""
    text = "".join(page.read_text("utf-8") for page in goal.pages)
    return [command for command in goal.commands if command not in text]


def walk(goal: Goal, data: str, folder: Path) -> Walk:
    """Run the commands of a goal in a folder and read the answer.

    Raises
    ------
    LookupError
        The page does not show one of the commands.
    subprocess.CalledProcessError
        A command fails.
    """
    if missing := not_on_a_page(goal):
        raise LookupError(f"{goal.pages[0].name} does not show: {missing[0]}")
    start, printed = perf_counter(), ""
    for command in goal.commands:
        program, *arguments = shlex.split(command)
        began = [sys.executable] if program == "python" else [sys.executable, "-m", "bayestouch"]
        environment = {**os.environ, "PYTHONPATH": str(DOCS.parent)}
        done = subprocess.run(
            [*began, *arguments], cwd=folder, env=environment, stdout=subprocess.PIPE, text=True, check=True
        )
        printed = done.stdout
    return Walk(goal, data, (perf_counter() - start) / 60, goal.answer(folder, printed))


def make_data(name: str, folder: Path, small: bool) -> None:
    """Write the data set that stands for the user's own."""
    if small:
        design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
        save_simulated(bayestouch.simulate(design, effects={"crosstalk": 0.05}, seed=3), folder / DATA)
    else:
        save_example(name, folder / DATA)


def as_table(walks: list[Walk]) -> str:
    """Markdown table of all walks."""
    rows = [
        (
            each.goal.wish,
            each.data,
            str(len(each.goal.commands)),
            f"{each.minutes:.1f}",
            str(len(each.goal.pages)),
            each.answer,
        )
        for each in walks
    ]
    return markdown_table(("you want", "data", "commands", "minutes", "pages", "answer"), rows)


def main(folder: Path, small: bool = False, docs: bool = False) -> list[Walk]:
    """Walk to every goal with each data set; print the table, and write it where asked to."""
    walks = []
    for name, title in [("finger", "small finger")] if small else EXAMPLES.items():
        place = folder / name
        place.mkdir(parents=True, exist_ok=True)
        make_data(name, place, small)
        for goal in GOALS:
            walks.append(walk(goal, title, place))
            print(f"{title}: {goal.wish} {walks[-1].minutes:.1f} min: {walks[-1].answer}", flush=True)
    table = as_table(walks)
    print(f"\n{table}")
    if slow := [each for each in walks if not each.within_limits]:
        print(f"beyond {MOST_COMMANDS} commands, {MOST_MINUTES:g} minutes or {MOST_PAGES} page: {len(slow)}")
    if docs:
        put_into_page("new_user.py", table, QUICK_START)
    return walks


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--small", action="store_true", help="a finger of four elements")
    parser.add_argument("--docs", action="store_true", help="write the table into the quick start")
    chosen = parser.parse_args()
    with TemporaryDirectory() as scratch:
        main(chosen.folder or Path(scratch), chosen.small, chosen.docs and not chosen.small)
