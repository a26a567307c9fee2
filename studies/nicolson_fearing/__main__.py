"""All studies of the paper's tables and figures, one after another, each with its time.

    python -m studies.nicolson_fearing [FOLDER] [--small] [--no-pictures] [--only NAME ...]

Each runs in a process of its own, as `python studies/nicolson_fearing/NAME.py` with the same options. At the end stands
a table of seconds by the clock and of processor time; one that fails does not stop the others, and the status is 1.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

FOLDER = Path(__file__).resolve().parent
# What can be run says so; other files are parts of studies.
STUDIES = {
    path.stem: path for path in sorted(FOLDER.glob("[!_]*.py")) if '__name__ == "__main__"' in path.read_text("utf-8")
}


@dataclass(frozen=True)
class Ran:
    """How a study went: exit status, seconds by the clock, seconds of processor time."""

    name: str
    status: int
    seconds: float
    processor_seconds: float

    def __str__(self) -> str:
        failed = "" if self.status == 0 else f"  failed with status {self.status}"
        return f"{self.name:24s}{self.seconds:8.0f} s{self.processor_seconds:8.0f} s of processor{failed}"


def processor_seconds() -> float:
    """Processor time of all processes that ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(name: str, options: Sequence[str]) -> Ran:
    """Run a study."""
    began, used = perf_counter(), processor_seconds()
    done = subprocess.run([sys.executable, str(STUDIES[name]), *options], check=False)
    return Ran(name, done.returncode, perf_counter() - began, processor_seconds() - used)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run those that are named, or all; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m studies.nicolson_fearing", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("folder", nargs="?", help="where pictures go")
    parser.add_argument("--small", action="store_true", help="a few minutes in place of an hour")
    parser.add_argument("--no-pictures", action="store_true")
    parser.add_argument("--only", nargs="+", choices=sorted(STUDIES), metavar="NAME", help=", ".join(STUDIES))
    chosen = parser.parse_args(arguments)
    options = [chosen.folder] * bool(chosen.folder)
    options += ["--small"] * chosen.small + ["--no-pictures"] * chosen.no_pictures
    ran = []
    for name in chosen.only or STUDIES:
        print(f"== {name}", flush=True)
        ran.append(run(name, options))
        print(f"== {ran[-1]}", flush=True)
    print(
        "\n".join(
            ["", *map(str, ran), str(Ran("all", 0, sum(r.seconds for r in ran), sum(r.processor_seconds for r in ran)))]
        )
    )
    return int(any(each.status for each in ran))


if __name__ == "__main__":
    sys.exit(main())
