"""Measured pads that were not looked at while the diagnosis was written: before, after, beside regression.

Eight channels of fluid are in `studies/data` (CC BY 4.0). The six arrays are not, because their authors state no
licence: give the folder of a clone of Shaevitzaiden/Underwater-Tactile-Sensor. Each pad is diagnosed as `bayestouch
diagnose` does, without any option; touches are read as in `studies/measured_diagnosis.py`.

    python studies/other_pads.py -o FOLDER [--arrays CLONE] [--only NAME ...] [--docs]

A pad that has a result in FOLDER is not run again.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from _page import DOCS, markdown_table, write_between
from _paired import after_and_best
from _result_lines import Record, appending, kept_lines
from _runs import difference_of_rms, share_of_runs, share_over_runs
from _worth import Worth, worths

import bayestouch
from bayestouch.data.dataset import DataSet
from bayestouch.version import __version__

CHANNELS = Path(__file__).parent / "data" / "fluid-channels"
RESULTS = DOCS / "results" / "other_pads" / "results.jsonl"
#: The first run, before the changes that followed it.
FIRST = RESULTS.with_name("first_run.jsonl")
PAGE, MARK = DOCS / "other_pads.md", "<!-- made by studies/other_pads.py -->"
MARK_FIRST = "<!-- first run, made by studies/other_pads.py -->"
#: Share of touches that 90 % regions should hold.
NOMINAL = 0.9


@dataclass(frozen=True)
class Array:
    """An array of two by four pressure sensors; its file has x, y and eight readings in each line.

    The number in the name of a file is the pitch in mm: the largest readings of the elements are so far apart.
    """

    rubber: str
    pressure: str
    pitch_mm: float
    folder: str = "."
    end: str = "_10_samples_cast-bond_trial1.csv"

    @property
    def name(self) -> str:
        """Name of the data set."""
        return f"array8-{self.rubber}-{self.pressure}-{self.pitch_mm}"

    def write(self, clone: Path, folder: Path) -> None:
        """Write the data set into a folder, from a clone of the repository."""
        source = clone / self.folder / f"{self.rubber}_{self.pressure}_{self.pitch_mm}{self.end}"
        values = np.loadtxt(source, delimiter=",")
        p, line = self.pitch_mm, [0.0, self.pitch_mm, 2 * self.pitch_mm, 3 * self.pitch_mm]
        folder.joinpath("sensor.toml").write_text(
            f'name = "{self.name}"\nbody = "pad"\n[geometry]\nelement_x_mm = {[p] * 4 + [0.0] * 4}\n'
            f'element_y_mm = {line + line[::-1]}\n[readings]\nquantity = "pressure"\nunit = "psi"\n',
            "utf-8",
        )
        names = ",".join(f"e{k:02d}" for k in range(1, 9))
        rows = np.column_stack([np.arange(len(values)), values[:, :10]])
        form = ["%d", "%.2f", "%.2f", *["%.5f"] * 8]
        np.savetxt(folder / "touches.csv", rows, form, delimiter=",", header=f"touch,x_mm,y_mm,{names}", comments="")


ARRAYS = (
    Array("DS20", "atm", 9.9),
    Array("DS10", "50PSI", 6.75),
    Array("DS10", "atm", 8.75, folder="train_data", end="_10-samples_train.csv"),
    Array("DS20", "25PSI", 9.9),
    Array("DS10", "25PSI", 6.75),
    Array("DS20", "50PSI", 9.9),
)


def data_sets(clone: Path | None, only: Sequence[str], done: set[str]) -> Iterator[tuple[str, DataSet]]:
    """Names and data sets that are wanted and have no result yet."""

    def wanted(name: str) -> bool:
        return name not in done and (not only or name in only)

    for folder in sorted(CHANNELS.iterdir()):
        if wanted(folder.name):
            yield folder.name, bayestouch.load_dataset(folder)
    if clone is None:
        print("the arrays are left out: give --arrays with a clone of Shaevitzaiden/Underwater-Tactile-Sensor")
        return
    for array in filter(lambda each: wanted(each.name), ARRAYS):
        with tempfile.TemporaryDirectory() as folder:
            array.write(clone, Path(folder))
            yield array.name, bayestouch.load_dataset(folder)


def result(name: str, dataset: DataSet, **options: Any) -> Record:
    """Diagnose a pad, read its held-out touches in each way, and return the numbers; the error where there is one.

    `options` are those of `bayestouch.diagnose`; the study has none.
    """
    version = {"version": __version__, "commit": _commit()}
    begun = time.process_time()
    try:
        diagnosis = bayestouch.diagnose(dataset, **options)
        seconds = time.process_time() - begun
        ways = worths(dataset, diagnosis.traced)
    except Exception:
        return {"name": name, "error": traceback.format_exc(), **version}
    numbers = diagnosis.to_dict()
    return {
        "name": name,
        **version,
        "seconds": round(seconds, 1),
        "touches": numbers["data"]["touches"],
        "held_out": numbers["data"]["held_out_touches"],
        "effects": [each["name"] for each in numbers["effects"]],
        "verdict": numbers["verdict"],
        "correction": numbers["correction"] is not None,
        "sentences": str(diagnosis),
        "runs": len(np.unique(ways[0].run)),
        "ways": {each.way: numbers_of(each) for each in ways},
        "after_minus_best": {key: against_best(ways, key) for key in ("distance_mm", "load_error_N")},
    }


def numbers_of(way: Worth) -> Record:
    """Errors and coverages of one way to read touches; None where the data do not have a quantity."""
    values: dict[str, float] = {
        "readings_percent": way.readings_percent,
        "median_mm": way.median_mm,
        "rms_mm": way.rms_mm,
        "coverage": way.coverage,
        "load_rms_N": way.load_rms_N,
        "load_coverage": way.load_coverage,
        "load_error_of_runs": shared_by_runs(way.load_error_N, way.run),
    }
    for key, inside in (("coverage", way.inside), ("load_coverage", way.load_inside)):
        _, values[f"{key}_low"], values[f"{key}_high"] = share_of_runs(inside, way.run)
    return {key: None if np.isnan(value) else round(value, 4) for key, value in values.items()}


def shared_by_runs(error: np.ndarray, run: np.ndarray) -> float:
    """Share of the mean square of errors (t,) that is the mean of a run of touches; NaN without errors."""
    means = np.bincount(run, weights=error) / np.bincount(run)
    return float(np.mean(means[run] ** 2) / np.mean(error**2))


def against_best(ways: Sequence[Worth], key: str) -> Record | None:
    """Rms after minus that of the regression with the smallest rms, with the 90 % interval over runs of touches."""
    after, best = after_and_best(ways, key)
    if np.isnan(getattr(after, key)).all():
        return None
    value, low, high = difference_of_rms(getattr(after, key), getattr(best, key), after.run)
    return {"regression": best.way, "difference": value, "low": low, "high": high}


def _commit() -> str:
    git = shutil.which("git")
    if git is None:
        return "unknown"
    command = [git, "-C", str(Path(__file__).parent), "describe", "--always", "--dirty"]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    return found.stdout.strip() or "unknown"


HEAD = (
    *("data", "touches (runs held out)", "traced to", "verdict"),
    *("location rms, mm: best regression", "before", "after"),
    "90 % regions hold, before → after",
    *("load rms, N: best regression", "before", "after"),
    "90 % intervals hold, before → after",
    "processor, s",
)


def row(found: Record) -> list[str]:
    """Row of the table."""
    if "error" in found:
        return [found["name"], *["–"] * 2, "error", *["–"] * 9]
    ways = found["ways"]
    before, after = ways["before: kernel and map"], ways["after"]

    def errors(key: str, compared: str) -> list[str]:
        best = found["after_minus_best"][compared]
        if best is None:
            return ["–"] * 3
        return [f"{each[key]:.2f}" for each in (ways[best["regression"]], before, after)]

    def held(key: str) -> str:
        if after[key] is None:
            return "–"
        # The first run has no intervals.
        low, high = (after.get(f"{key}_{end}") for end in ("low", "high"))
        interval = f" ({low:.2f} to {high:.2f})" if low is not None else ""
        return f"{before[key]:.2f} → {after[key]:.2f}{interval}"

    runs = f" ({found['runs']})" if "runs" in found else ""

    return [
        found["name"],
        f"{found['touches']}{runs}",
        "; ".join(found["effects"]) or "nothing",
        found["verdict"],
        *errors("rms_mm", "distance_mm"),
        held("coverage"),
        *errors("load_rms_N", "load_error_N"),
        held("load_coverage"),
        f"{found['seconds']:.0f}",
    ]


def summary(records: Sequence[Record]) -> str:
    """How many pads are read at least as well as by the best regression, and the mean coverages."""
    whole = [each for each in records if "error" not in each]
    lines = []
    for key, what in (("distance_mm", "location"), ("load_error_N", "load")):
        compared = [d for each in whole if (d := each["after_minus_best"][key]) is not None]
        if not compared:
            continue
        worse = sum(each["low"] > 0 for each in compared)
        better = sum(each["high"] < 0 for each in compared)
        lines.append(
            f"- **{what.capitalize()}**, rms after against the best regression: better on {better} of {len(compared)} "
            f"pads, worse on {worse}, not distinguishable on the others (90 % interval over runs of touches)."
        )
    for key, what in (("coverage", "location"), ("load_coverage", "load")):
        pairs = [(e["ways"]["before: kernel and map"][key], e["ways"]["after"][key], e["held_out"]) for e in whole]
        some = np.array([each for each in pairs if each[1] is not None])
        if len(some):
            first, last = np.average(some[:, :2], axis=0, weights=some[:, 2])
            low, high = coverage_interval(some[:, 1], some[:, 2])
            ends = [[e["ways"]["after"].get(f"{key}_{end}") for end in ("low", "high")] for e in whole]
            known = [each for each in ends if each[0] is not None]
            right = sum(low <= NOMINAL <= high for low, high in known)
            within = f" The interval over runs has {NOMINAL} on {right} of {len(known)} pads." if known else ""
            lines.append(
                f"- **90 % regions of the {what}** hold {first:.2f} of the touches before and {last:.2f} after "
                f"(90 % interval over pads {low:.2f} to {high:.2f}).{within}"
            )
    shared = [share for each in whole if (share := each["ways"]["after"]["load_error_of_runs"]) is not None]
    if shared:
        low, middle, high = (100 * value for value in np.quantile(shared, [0, 0.5, 1]))
        lines.append(
            f"- **Errors of the load** are common to a run of touches: {low:.0f} to {high:.0f} % of their mean square "
            f"after, median {middle:.0f} %."
        )
    failed = [each["name"] for each in records if "error" in each]
    lines.append(f"- **Errors of the program:** {', '.join(failed) or 'none'}.")
    return "\n".join(lines)


def coverage_interval(share: np.ndarray, touches: np.ndarray) -> tuple[float, float]:
    """Central 90 % interval over pads of the share of touches (pads,)."""
    return share_over_runs(share * touches, touches)[1:]


def as_page(records: Sequence[Record]) -> str:
    """Tables and summary for the page."""
    versions = sorted({f"`{each['version']}` (commit {each['commit']})" for each in records})
    table = markdown_table(HEAD, [row(each) for each in sorted(records, key=lambda each: str(each["name"]))])
    return f"Version of the code: {', '.join(versions)}.\n\n{summary(records)}\n\n{table.rstrip()}"


def main(folder: Path, clone: Path | None = None, only: Sequence[str] = (), docs: bool = False) -> list[Record]:
    """Run what has no result yet, print the table, and put it into the page with `docs`."""
    path = folder / "results.jsonl"
    records = kept_lines(path)
    with appending(path) as append:
        for name, dataset in data_sets(clone, only, {each["name"] for each in records}):
            append(found := result(name, dataset))
            records.append(found)
            print(" | ".join(row(found)), flush=True)
    if records:
        print(as_page(records))
    if docs:
        RESULTS.parent.mkdir(parents=True, exist_ok=True)
        if path.resolve() != RESULTS.resolve():
            shutil.copyfile(path, RESULTS)
        write_between(MARK_FIRST, as_page(kept_lines(FIRST)), PAGE)
        write_between(MARK, as_page(records), PAGE)
    return records


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder of the results")
    parser.add_argument("--arrays", type=Path, help="clone of Shaevitzaiden/Underwater-Tactile-Sensor")
    names = [*sorted(each.name for each in CHANNELS.iterdir()), *(each.name for each in ARRAYS)]
    parser.add_argument("--only", nargs="+", default=[], choices=names, metavar="NAME", help="names of data sets")
    parser.add_argument("--docs", action="store_true", help="put the tables into docs/other_pads.md")
    chosen = parser.parse_args()
    main(chosen.output, chosen.arrays, chosen.only, chosen.docs)
