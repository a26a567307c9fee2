"""Two reports with one entry page: a simulated finger with an effect that the tool is not told of, and a measured pad.

    python studies/first_reports.py [FOLDER]

`make report` runs this. Each report is made by the commands that a user has, both at the same time. If scikit-learn is
installed, the report of the pad has regression without physics beside the diagnosis.
"""

from __future__ import annotations

import argparse
import json
import sys
from html import escape
from importlib import import_module
from importlib.resources import files
from importlib.util import find_spec
from multiprocessing import Process
from pathlib import Path
from typing import Any

from bayestouch.commands.cli import main as command
from bayestouch.reporting.loop_bars import before_after

#: Example, and title of its report.
REPORTS = {
    "finger": "Simulated finger, with an effect that the tool is not told of",
    "fluid-oil-1.5": "Measured channel of oil (SDU Soft Robotics, CC BY 4.0)",
}
#: Options of the reports.
OPTIONS = {"fluid-oil-1.5": ("--baselines",) if find_spec("sklearn") else ()}
#: Libraries that reports import late.
LIBRARIES = ("bokeh.embed", "matplotlib.figure", "corner", "jinja2", "h5netcdf", "pandas", "scipy.stats")
# The look of the reports that the page leads to.
STYLE = files("bayestouch.reporting").joinpath("templates/style.css").read_text("utf-8")


def imported(names: tuple[str, ...]) -> None:
    """Import libraries. Python compiles what it imports for the first time, and keeps it on the disk."""
    for name in names:
        import_module(name)


def run(*arguments: str | Path) -> None:
    """Run a command of bayestouch; stop if it fails, after it has said why."""
    if status := command([*map(str, arguments)]):
        sys.exit(status)


def at_once(commands: list[tuple[str | Path, ...]]) -> None:
    """Run commands of bayestouch at the same time, each in a process of its own; stop if one fails."""
    started = [Process(target=run, args=each) for each in commands]
    for each in started:
        each.start()
    for each in started:
        each.join()
    if failed := [each.exitcode for each in started if each.exitcode]:
        sys.exit(failed[0])


def section(folder: Path, name: str) -> str:
    """What was missing, what explains it, and what it is worth, from one report."""
    numbers: dict[str, Any] = json.loads((folder / name / "report.json").read_text("utf-8"))
    found = numbers["diagnosis"]
    lines = "".join(f"<li>{escape(line)}</li>" for line in found["sentences"])
    rows = "".join(
        f"<tr><td>{escape(row['quantity'])}{escape(f', {unit}' if (unit := row['unit']) else '')}</td>"
        f"<td>{_number(row['before'])}</td><td>{_number(row['after'])}</td></tr>"
        for row in before_after(found)
    )
    pictures = [each for each in numbers["figures"] if each["file"].startswith("figures/diagnosis_")][:1]
    shown = "".join(f'<img src="{name}/{each["file"]}" alt="{escape(each["alt"])}">' for each in pictures)
    return (
        f'<section><h2><a href="{name}/index.html">{escape(REPORTS[name])}</a></h2><ul>{lines}</ul>'
        f"<table><thead><tr><th>On touches held out</th><th>before</th><th>after</th></tr></thead>"
        f'<tbody>{rows}</tbody></table>{shown}<p><a href="{name}/index.html">The whole report</a></p></section>'
    )


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def main(folder: Path) -> Path:
    """Write the data sets, both reports and the entry page; return the page."""
    # The processes of the reports are forked (on Linux), so what this process has imported they need not import.
    # The first time, another process compiles the half of it: it begins at the other end.
    other = Process(target=imported, args=(LIBRARIES,))
    other.start()
    for name in REPORTS:
        run("example", name, "-o", folder / "data" / name)
    imported(LIBRARIES[::-1])
    other.join()
    at_once([("report", folder / "data" / name, "-o", folder / name, *OPTIONS.get(name, ())) for name in REPORTS])
    body = "".join(section(folder, name) for name in REPORTS)
    page = folder / "index.html"
    page.write_text(
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>bayestouch: two reports</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{STYLE}</style></head><body><main><h1>Two reports</h1>{body}</main></body></html>\n",
        "utf-8",
    )
    return page


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", type=Path, nargs="?", default=Path("report"))
    print(main(parser.parse_args().folder))
