"""How quickly a touch table in CSV is read, beside plain `pandas.read_csv` on the same file.

A simulated finger's touches are repeated until the table has 442,800 rows of 22 columns, 155 MB. Both readers are run
in turn; the ratio is of their medians. Seconds are of processor, which other programs on the machine disturb least.
`pandas.read_csv` checks nothing: the reader also knows the place of every row, refuses what is no number, and checks
values and rows against each other.

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

from bayestouch.data.touch_source import joined_touches
from bayestouch.data.touch_table import read_touches, write_touches
from bayestouch.simulation import FingerDesign, simulate


def seconds(call: Callable[[], object]) -> float:
    """Seconds of processor that a call takes."""
    start = time.process_time()
    call()
    return time.process_time() - start


def main(copies: int = 60, repeats: int = 5) -> float:
    """Print the rates; returns the time of the reader over that of pandas."""
    data = simulate(FingerDesign(), seed=1).dataset
    step = int(np.ptp(data.touches.touch)) + 1
    many = joined_touches([data.touches.with_(touch=data.touches.touch + k * step) for k in range(copies)])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "touches.csv"
        write_touches(many, path, data.sensor)
        megabytes = path.stat().st_size / 1e6
        ours, plain = [], []
        for _ in range(repeats):
            ours.append(seconds(lambda: read_touches(path, data.sensor)))
            plain.append(seconds(lambda: pd.read_csv(path)))
    mine, theirs = statistics.median(ours), statistics.median(plain)
    print(f"{many.n_rows:,} rows, {megabytes:.0f} MB, medians of {repeats}, seconds of processor")
    print(f"read_touches     {mine:6.2f} s {megabytes / mine:6.0f} MB/s")
    print(f"pandas.read_csv  {theirs:6.2f} s {megabytes / theirs:6.0f} MB/s")
    print(f"ratio of times   {mine / theirs:6.2f}")
    return mine / theirs


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--copies", type=int, default=60)
    parser.add_argument("--repeats", type=int, default=5)
    o = parser.parse_args()
    main(o.copies, o.repeats)
