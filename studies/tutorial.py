"""The tutorial on measured data, run as a reader runs it, with what each of its commands prints.

    python studies/tutorial.py [FOLDER] [--small] [--docs]

Commands and Python run in the order of `docs/tutorial.md`, in FOLDER or in a temporary folder. ``--docs`` puts what
they print into the page, below each of them, and takes the picture of the report (which needs Chromium and playwright).
``--small`` keeps an eighth of the touches.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import re
import shlex
import subprocess
import sys
import textwrap
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from _page import DOCS, markdown_table, write_between

import bayestouch

PAGE = DOCS / "tutorial.md"
PICTURES = DOCS / "pictures"
README, MARK = DOCS.parent / "README.md", "<!-- made by studies/tutorial.py -->"
#: Rows of the table of the README: text, key in ``diagnosis.json``, format, unit, factor.
ERRORS = (
    ("error of the location, rms", "location_rms_mm", ".2f", "mm", 1),
    ("error of the load, read without the force sensor, rms", "P_rms_N", ".2f", "N", 1),
    ("touches whose 90 % region contains the true place (best: 90 %)", "coverage_90", ".0f", "%", 100),
)
#: A block that runs, and the block below it that shows what it prints, if there is one.
STEP = re.compile(r"^```(console|python)\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?", re.MULTILINE | re.DOTALL)
#: Longest line that a page shows without a scroll bar.
WIDTH = 90
#: A small run keeps one run of so many touches in so many.
RUN, SMALL = 6, 8


def wrapped(text: str) -> str:
    """The same text with long lines broken."""

    def short(line: str) -> str:
        return textwrap.fill(line, WIDTH, subsequent_indent="  ") if len(line) > WIDTH else line.rstrip()

    return "".join(f"{short(line)}\n" for line in text.splitlines())


def printed(language: str, source: str, folder: Path, names: dict[str, Any]) -> str:
    """What the commands or the Python of one block print in a folder.

    Raises
    ------
    subprocess.CalledProcessError
        A command fails.
    """
    if language == "python":
        out = io.StringIO()
        with contextlib.chdir(folder), contextlib.redirect_stdout(out):
            exec(compile(source, PAGE.name, "exec", dont_inherit=True), names)
        return wrapped(out.getvalue())
    shown = []
    for line in re.findall(r"^\$ (.+)$", source, re.MULTILINE):
        program, *arguments = shlex.split(line)
        start = [sys.executable, "-m", "bayestouch"] if program == "bayestouch" else [program]
        environment = {**os.environ, "COLUMNS": str(WIDTH), "NO_COLOR": "1"}
        done = subprocess.run([*start, *arguments], cwd=folder, env=environment, stdout=subprocess.PIPE, check=True)
        shown.append(done.stdout.decode("utf-8"))
    return wrapped("".join(shown))


def keep_some(folder: Path) -> None:
    """Thin the touches of a data set, in runs that follow each other."""
    dataset = bayestouch.load_dataset(folder)
    place = np.unique(dataset.touches.touch, return_inverse=True)[1]
    some = dataset.touches.select((place // RUN) % SMALL == 0)
    bayestouch.save_dataset(replace(dataset, touches=some), folder)


def run(page: str, folder: Path, small: bool = False) -> str:
    """Run all blocks of a page in a folder; return the page with what they print."""
    names: dict[str, Any] = {}
    first = True

    def shown(step: re.Match[str]) -> str:
        nonlocal first
        output = printed(step[1], step[2], folder, names)
        print(f"{step[2]}{output}", flush=True)
        if first and small:
            keep_some(folder / "channel")
        first = False
        block = f"```{step[1]}\n{step[2]}```\n"
        return block if step[3] is None else f"{block}\n```text\n{output}```\n"

    return STEP.sub(shown, page)


def readme_table(folder: Path) -> str:
    """Errors of the diagnosis that the page makes in a folder, before and after."""
    numbers = json.loads((folder / "channel-diagnosis" / "diagnosis.json").read_text("utf-8"))
    head = (f"{numbers['data']['held_out_touches']} touches that no fit has seen", "before", "after")
    rows = [
        [text, *(f"{factor * numbers[stand][key]:{form}} {unit}" for stand in ("before", "after"))]
        for text, key, form, unit, factor in ERRORS
    ]
    return markdown_table(head, rows).rstrip()


def main(folder: Path, small: bool = False, docs: bool = False) -> None:
    """Run the page and print it; write it, and its picture, where asked to."""
    folder.mkdir(parents=True, exist_ok=True)
    text = run(PAGE.read_text("utf-8"), folder, small)
    if docs:
        PAGE.write_text(text, "utf-8")
        write_between(MARK, readme_table(folder), README)
        sys.path.append(str(PICTURES))
        from report_first_screen import take_picture

        # Last, as it ends here without Chromium.
        take_picture((folder / "channel-report" / "index.html").resolve(), PICTURES / "tutorial_first_screen.png")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--small", action="store_true", help="keep an eighth of the touches")
    parser.add_argument("--docs", action="store_true", help="write the page and its picture")
    chosen = parser.parse_args()
    with TemporaryDirectory() as scratch:
        main(chosen.folder or Path(scratch), chosen.small, chosen.docs and not chosen.small)
