"""Right everywhere: the same answer, to the last bit, in whatever surroundings the command line is run.

A small simulated finger is calibrated, its touches are read and (``--report``) a report is written, first plainly and
then in one surrounding after another: a home that cannot be written to, no network, other locales, other folders,
settings of numpy's threads, warnings as errors, two runs at once in one folder. Each must end with status 0 and
nothing on the terminal but the notes, and every array of its posterior must be that of the plain run. What a machine
does not have is said to be absent.

    python studies/conditions.py [--report] [--docs] [WORD ...]

With words only the surroundings whose names hold one of them are tried, beside the plain one.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np
from _page import put_into_page

from bayestouch.simulation import FingerDesign, save_simulated, simulate

NOWHERE = "/proc/no-home"
USER = ("unshare", "--user", "--map-root-user")
READ_ONLY = "mount --bind data data && mount -o remount,bind,ro data"
DESIGN = FingerDesign(
    n_elements=6,
    samples_per_touch=2,
    edge_step_deg=9.0,
    flat_step_deg=18.0,
    calibration_span_deg=45.0,
    touch_radii_mm=(0.0, 3.0, 9.3),
    touch_span_deg=36.0,
    touch_step_deg=6.0,
)


@dataclass(frozen=True)
class Surrounding:
    """Where and how the command line is run."""

    name: str
    variables: Mapping[str, str] = field(default_factory=dict)
    before: Sequence[str] = ()
    folder: str = "work"
    at_once: int = 1
    python: Sequence[str] = ()


SURROUNDINGS = (
    Surrounding("plain"),
    Surrounding("home cannot be written to", {"HOME": NOWHERE, "XDG_CACHE_HOME": NOWHERE, "XDG_CONFIG_HOME": NOWHERE}),
    Surrounding("no network", before=(*USER, "--net")),
    Surrounding(
        "data that cannot be written to", before=(*USER, "--mount", "sh", "-c", f'{READ_ONLY} && exec "$@"', "sh")
    ),
    *(
        Surrounding(f"locale {name}", {"LC_ALL": name, "LANG": name, "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"})
        for name in ("C", "C.UTF-8", "de_DE.UTF-8", "tr_TR.UTF-8")
    ),
    Surrounding("folder of another name", folder="späße & 'quotes' $HOME %d"),
    *(
        Surrounding(f"{n} threads of OpenMP and BLAS", {"OMP_NUM_THREADS": n, "OPENBLAS_NUM_THREADS": n})
        for n in ("1", "2", "4")
    ),
    Surrounding("warnings are errors", {"PYTHONWARNINGS": "error"}),
    Surrounding("asserts left out, other hash seed", {"PYTHONHASHSEED": "12345"}, python=("-O",)),
    Surrounding("time zone and width of the terminal", {"TZ": "Pacific/Chatham", "COLUMNS": "20", "TERM": "dumb"}),
    Surrounding("two at once in one folder", at_once=2),
)


def commands(report: bool, number: int) -> list[list[str]]:
    """What is run, one after the other; each of those that run at once writes to its own files."""
    calibration, posterior = f"calibration-{number}.nc", f"posterior-{number}.nc"
    out = [
        ["calibrate", "data", "-o", calibration, "--draws", "64"],
        ["infer", "data/touches.csv", "--calibration", calibration, "-o", posterior, "--draws", "64"],
    ]
    return [*out, ["report", "data", "-o", f"report-{number}", "--draws", "64"]] if report else out


def available(where: Surrounding) -> bool:
    """Whether this machine has what a surrounding needs."""
    if where.before:
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "data").mkdir()
            probe = [*where.before, "true"]
            return (
                bool(shutil.which(probe[0])) and not subprocess.run(probe, cwd=folder, capture_output=True).returncode
            )
    if "LC_ALL" in where.variables:
        probe = [sys.executable, "-c", "import locale; locale.setlocale(locale.LC_ALL, '')"]
        return subprocess.run(probe, env={**os.environ, **where.variables}, capture_output=True).returncode == 0
    return True


def run(where: Surrounding, root: Path, report: bool) -> tuple[list[int], str, list[Path]]:
    """Status of every command, what they wrote to the terminal, and the files of every run, one run after the other."""
    folder = root / where.folder
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(root / "data", folder / "data")
    environment = {**os.environ, **where.variables}
    status, said = [], ""
    python = [*where.before, sys.executable, *where.python, "-m", "bayestouch"]
    for at_once in zip(*(commands(report, number) for number in range(where.at_once)), strict=True):
        running = [
            subprocess.Popen(
                [*python, *line], cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE
            )
            for line in at_once
        ]
        for process in running:
            out, err = process.communicate()
            status.append(process.returncode)
            said += (out + err).decode("utf-8", "replace")
    files = [folder / f"{of}-{number}.nc" for number in range(where.at_once) for of in ("calibration", "posterior")]
    return status, said, files


def arrays(file: Path) -> dict[str, bytes]:
    """Every array of a file, as bytes."""
    found: dict[str, bytes] = {}

    def visit(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiub":
            found[name] = np.asarray(item[()]).tobytes()

    with h5py.File(file, "r") as root:
        root.visititems(visit)
    return found


def main(report: bool = False, surroundings: Sequence[Surrounding] = SURROUNDINGS) -> dict[str, str]:
    """Print the table; returns what each surrounding came to."""
    out: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as name:
        root = Path(name).resolve()
        save_simulated(simulate(DESIGN, seed=1), root / "data")
        reference: list[dict[str, bytes]] = []
        for where in surroundings:
            out[where.name] = "not on this machine"
            if available(where):
                status, said, files = run(where, root, report)
                if any(status) or "Traceback" in said or "Warning" in said:
                    last = said.strip().splitlines()[-1] if said.strip() else ""
                    out[where.name] = f"status {status}: {last[:100]}"
                else:
                    found = [arrays(file) for file in files]
                    reference = reference or found
                    plain = reference * where.at_once
                    out[where.name] = "same to the last bit" if found == plain else _difference(plain, found)
            print(f"{where.name:60s}{out[where.name]}", flush=True)
    return out


def _difference(reference: list[dict[str, bytes]], found: list[dict[str, bytes]]) -> str:
    largest = 0.0
    for one, other in zip(reference, found, strict=True):
        for name, data in one.items():
            a, b = (np.frombuffer(x, dtype=np.float64) for x in (data, other.get(name, b"")))
            if a.shape != b.shape:
                return f"{name} has another shape"
            told = np.isfinite(a)
            if (told != np.isfinite(b)).any():
                return f"{name} is finite elsewhere"
            scale = np.max(np.abs(a[told]), initial=1e-300)
            largest = max(largest, float(np.max(np.abs(a[told] - b[told]), initial=0.0)) / scale)
    return f"differs by {largest:.1e} of the largest value of an array"


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--docs", action="store_true")
    parser.add_argument("words", nargs="*")
    options = parser.parse_args()
    chosen = [
        each for each in SURROUNDINGS if not options.words or any(w in each.name for w in ("plain", *options.words))
    ]
    results = main(options.report, chosen)
    if options.docs:
        lines = "".join(f"| {name} | {result} |\n" for name, result in results.items())
        put_into_page("conditions.py", f"| surrounding | result |\n|---|---|\n{lines}")
