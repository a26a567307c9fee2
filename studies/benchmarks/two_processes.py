"""How much faster `infer` is on two processes than on one, and where the rest is lost.

A simulated finger's touches are repeated until there are 22,140 (442,800 rows, 155 MB of CSV), and read from a file
into a file of summaries. One process, two processes, and two separate runs of one process at the same time are timed in
turn. The last shows what the machine allows: cores share its memory and its clock.

Three times are printed of each run on two processes: of this process before it starts others (imports are not counted;
the table is surveyed, the reader is prepared), of this process afterwards (it averages, summarises and writes), and
of the others (they draw). `by processor` is the ratio that these times would give if nothing ever waited: the first
counts in full, the others are shared by two cores. It hardly depends on what else the machine does; the ratio by the
clock needs a machine that does nothing else.

    python studies/benchmarks/two_processes.py [--copies 60] [--repeats 3] [--method importance] [--table csv]
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import click
import numpy as np

import bayestouch
from bayestouch.data.touch_source import joined_touches
from bayestouch.data.touch_table import write_touches
from bayestouch.simulation import FingerDesign, simulate

PROGRAM = """
import json, os, resource, sys, tempfile, time
import pandas, emcee, h5netcdf
import bayestouch
from bayestouch.reading import draws

table, calibration, method, workers = *sys.argv[1:4], int(sys.argv[4])
loaded = bayestouch.load(calibration)
started, usual = [], draws.spread_out

def noted(*arguments):
    started.append(time.process_time())
    return usual(*arguments)

draws.spread_out = noted
with tempfile.TemporaryDirectory() as folder:
    clock, processor = time.perf_counter(), time.process_time()
    bayestouch.infer(
        table, loaded, method=method, draws=1024, summary_only=True, workers=workers, output=folder + "/posterior.nc"
    )
    print(json.dumps({
        "clock": time.perf_counter() - clock,
        "before": started[0] - processor,
        "after": time.process_time() - started[0],
        "others": sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2]),
    }))
"""


def start(arguments: Sequence[str | Path], workers: int) -> subprocess.Popen[str]:
    """A run in a process of its own."""
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-c", PROGRAM, *map(str, arguments), str(workers)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)


def finished(process: subprocess.Popen[str]) -> dict[str, float]:
    """Its times."""
    out, _ = process.communicate()
    if process.returncode:
        raise click.ClickException("a run has failed")
    times: dict[str, float] = json.loads(out)
    return times


def compare(arguments: Sequence[str | Path], repeats: int) -> dict[str, float]:
    """Run one process, two processes, and two runs at once, in turn; print medians and return the ratios."""
    runs: dict[str, list[dict[str, float]]] = {"one": [], "two": [], "at once": []}
    for _ in range(repeats):
        runs["one"].append(finished(start(arguments, 1)))
        runs["two"].append(finished(start(arguments, 2)))
        both = [start(arguments, 1) for _ in range(2)]
        runs["at once"] += [finished(process) for process in both]

    def median(which: str, key: str) -> float:
        return statistics.median(run[key] for run in runs[which])

    print(f"{'seconds, medians':26s}{'clock':>8s}{'before':>8s}{'after':>8s}{'others':>8s}")
    for which, label in {"one": "one process", "two": "two processes", "at once": "one process, two runs"}.items():
        print(f"{label:26s}" + "".join(f"{median(which, key):8.2f}" for key in ("clock", "before", "after", "others")))
    one, before = median("one", "before") + median("one", "after"), median("two", "before")
    shared = median("two", "after") + median("two", "others")
    ratios = {
        "by the clock": median("one", "clock") / median("two", "clock"),
        "by processor": one / (before + shared / 2),
        "what the machine allows": 2 * median("one", "clock") / median("at once", "clock"),
    }
    for name, ratio in ratios.items():
        print(f"{name:26s}{ratio:8.2f}")
    lost = f"{before / 2:.2f} s before the others start, {(before + shared - one) / 2:.2f} s more work"
    print(f"of the {before + shared / 2 - one / 2:.2f} s over half of one process: {lost}", flush=True)
    return ratios


@click.command()
@click.option("--copies", default=60, show_default=True, help="Copies of 369 touches of 20 samples.")
@click.option("--repeats", default=3, show_default=True)
@click.option("--method", "methods", multiple=True, default=("importance", "emcee"), show_default=True)
@click.option("--table", "endings", multiple=True, default=("csv", "parquet"), show_default=True)
def main(copies: int, repeats: int, methods: tuple[str, ...], endings: tuple[str, ...]) -> None:
    """Compare one process with two."""
    data = simulate(FingerDesign(), seed=1).dataset
    step = int(np.ptp(data.touches.touch)) + 1
    many = joined_touches([data.touches.with_(touch=data.touches.touch + k * step) for k in range(copies)])
    with tempfile.TemporaryDirectory() as folder:
        calibration = Path(folder) / "calibration.nc"
        bayestouch.calibrate(data, draws=200).save(calibration)
        for ending in endings:
            table = Path(folder) / f"touches.{ending}"
            write_touches(many, table, data.sensor)
            for method in methods:
                size = table.stat().st_size / 1e6
                print(f"\n{many.n_touches:,} touches, {many.n_rows:,} rows, {size:.0f} MB of {ending}, {method}")
                compare([table, calibration, method], repeats)


if __name__ == "__main__":
    main()
