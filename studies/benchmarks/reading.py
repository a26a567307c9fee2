"""How quickly a touch table in CSV is read, beside pandas and pyarrow on the same file.

A simulated finger's touches are repeated until the table has 442,800 rows of 22 columns, 155 MB. The readers are run
in turn; ratios are of their medians. Seconds are of processor, which other programs on the machine disturb least.
pandas and pyarrow check nothing: `read_touches` also knows the place of every row, refuses what is no number, and
checks values and rows against each other. `survey` is the pass that `infer` makes over the table in pieces; it keeps
the pieces of a table of this size, so that `infer` reads the file once.

    python studies/benchmarks/reading.py [--copies 60] [--repeats 5]
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.csv

from bayestouch.data.survey import survey
from bayestouch.data.touch_source import OnFile, joined_touches
from bayestouch.data.touch_table import read_touches, write_touches
from bayestouch.simulation import FingerDesign, simulate


def seconds(call: Callable[[], object]) -> float:
    """Seconds of processor that a call takes."""
    start = time.process_time()
    call()
    return time.process_time() - start


def main(copies: int = 60, repeats: int = 5) -> dict[str, float]:
    """Print the rates; returns the time of each reader over that of pandas."""
    data = simulate(FingerDesign(), seed=1).dataset
    step = int(np.ptp(data.touches.touch)) + 1
    many = joined_touches([data.touches.with_(touch=data.touches.touch + k * step) for k in range(copies)])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "touches.csv"
        write_touches(many, path, data.sensor)
        megabytes = path.stat().st_size / 1e6
        readers: dict[str, Callable[[], object]] = {
            "pandas.read_csv": lambda: pd.read_csv(path),
            "pyarrow.csv.read_csv": lambda: pyarrow.csv.read_csv(path),
            "read_touches": lambda: read_touches(path, data.sensor),
            "survey": lambda: survey(OnFile.of(path, data.sensor)),
        }
        runs = [{name: seconds(call) for name, call in readers.items()} for _ in range(repeats)]
    medians = {name: statistics.median(run[name] for run in runs) for name in readers}
    print(f"{many.n_rows:,} rows, {megabytes:.0f} MB, medians of {repeats}, seconds of processor")
    for name, median in medians.items():
        ratio = median / medians["pandas.read_csv"]
        print(f"{name:21s} {median:6.2f} s {megabytes / median:6.0f} MB/s {ratio:6.2f} times pandas")
    return {name: median / medians["pandas.read_csv"] for name, median in medians.items()}


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--copies", type=int, default=60)
    parser.add_argument("--repeats", type=int, default=5)
    o = parser.parse_args()
    main(o.copies, o.repeats)
