"""Time and memory of `bayestouch infer` on 10³ ... 10⁶ touches: both beside what a linear cost would be.

Exponents of time and memory are those between the two largest tables.

Each table of single samples is written as Parquet or CSV and read by the command in a process of its own, whose
processor time (of all its processes) and peak memory (of the largest) the system tells. Summaries of 512 draws are
kept. On a finger every touch is another one; on a pad they are those of a simulated data set with new noise.

    python studies/benchmarks/scaling.py [--largest 1000000] [--body finger|pad] [--table parquet|csv]
                                         [--method importance|emcee] [--draws 512] [--folder DIR]
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import bayestouch
from bayestouch.data.averages import TouchMeans
from bayestouch.data.touch_table import write_touches
from bayestouch.data.touches import touches_from
from bayestouch.finger.calibration import finger_chain
from bayestouch.simulation import FingerDesign, PadDesign

# A table so small that what it costs is starting the program, solving contacts and opening files.
SMALLEST = 64
#: Sizes of the tables below the largest; the last but one is near it, so that exponents are those of large tables.
SIZES = (1000, 10_000, 100_000, 400_000)
LARGEST = 1_000_000
PART = 20_000


@dataclass(frozen=True)
class Cost:
    """What one run took.

    Attributes
    ----------
    touches : int
        Size of the table.
    seconds, processor : float
        By the clock, and of all cores.
    memory : float
        Peak, bytes.
    file : float
        Size of the posterior, bytes.
    """

    touches: int
    seconds: float
    processor: float
    memory: float
    file: float


def calibrated(folder: Path) -> tuple[Path, bayestouch.Calibration]:
    """A simulated finger, calibrated."""
    path = folder / "calibration.nc"
    calibration = bayestouch.calibrate(bayestouch.simulate(FingerDesign(), seed=3).dataset, draws=200)
    calibration.save(path)
    return path, calibration


def write_table(path: Path, calibration: bayestouch.Calibration, n: int) -> None:
    """Single samples of n touches, radii, angles and loads all over."""
    chain, rng = finger_chain(calibration), np.random.default_rng(n)
    typical = float(calibration.settings["typical_load"])
    radius, angle = rng.uniform(0.3, 12.6, n), rng.uniform(-60, 60, n)
    load = typical * rng.uniform(0.5, 1.5, n)
    readings = np.empty((n, chain.n_elements))
    for first in range(0, n, PART):
        part = slice(first, first + PART)
        readings[part] = chain.predict(radius[part], np.radians(angle[part]), load[part])
    readings += calibration.noise.tactile_sd * rng.standard_normal(readings.shape)
    read = load + calibration.noise.force_sd * rng.standard_normal(n)
    write_touches(touches_from(np.arange(n), readings, load=read, angle_deg=angle), path, calibration.sensor)


def calibrated_pad(folder: Path) -> tuple[Path, bayestouch.Calibration, TouchMeans]:
    """A simulated pad, calibrated, and the touches of its data set."""
    path, dataset = folder / "calibration.nc", bayestouch.simulate(PadDesign(), seed=1).dataset
    calibration = bayestouch.calibrate(dataset, kernel="half-space", draws=40)
    calibration.save(path)
    return path, calibration, dataset.touches.baseline_corrected().averaged()


def write_pad_table(path: Path, calibration: bayestouch.Calibration, means: TouchMeans, n: int) -> None:
    """Single samples of n touches, each one of the data set with new noise."""
    rng = np.random.default_rng(n)
    rows = rng.integers(0, means.n_touches, n)
    readings = means.readings[rows] + calibration.noise.tactile_sd * rng.standard_normal((n, means.n_elements))
    load = means.load[rows] + calibration.noise.force_sd * rng.standard_normal(n)
    location = {name: values[rows] for name in ("x_mm", "y_mm") if (values := getattr(means, name)) is not None}
    write_touches(touches_from(np.arange(n), readings, load=load, **location), path, calibration.sensor)


def run(table: Path, calibration: Path, n: int, method: str, draws: int) -> Cost:
    """Run the command on the table of n touches."""
    output = table.with_name("posterior.nc")
    command = [sys.executable, "-m", "bayestouch", "infer", str(table), "--quiet"]
    command += ["--calibration", str(calibration), "-o", str(output)]
    command += ["--method", method, "--draws", str(draws), "--summary-only"]
    begun = time.perf_counter()
    process = subprocess.Popen(command)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - begun
    if status:
        raise SystemExit(f"infer ended with status {status}")
    cost = Cost(n, seconds, usage.ru_utime + usage.ru_stime, 1024.0 * usage.ru_maxrss, output.stat().st_size)
    output.unlink()
    return cost


def sizes_up_to(largest: int) -> tuple[int, ...]:
    """Sizes of the tables, the largest one included."""
    return (*(size for size in SIZES if size < largest), largest)


def main(
    sizes: tuple[int, ...] = (*SIZES, LARGEST),
    method: str = "importance",
    draws: int = 512,
    folder: Path | None = None,
    body: str = "finger",
    ending: str = "parquet",
) -> dict[str, float]:
    """Print the table as it comes; returns exponents of time and memory, and bytes a touch."""
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        place = Path(temporary)
        write: Callable[[Path, int], None]
        if body == "pad":
            calibration_path, calibration, means = calibrated_pad(place)
            write = lambda path, n: write_pad_table(path, calibration, means, n)  # noqa: E731
        else:
            calibration_path, calibration = calibrated(place)
            write = lambda path, n: write_table(path, calibration, n)  # noqa: E731
        costs = []
        print(f"{body}, {ending}, {method}, {draws} draws a touch, summaries kept, {os.cpu_count()} cores")
        heads = {
            "touches": 9,
            "s": 8,
            "s of processor": 15,
            "ms a touch": 11,
            "peak MB": 8,
            "table MB": 9,
            "file MB": 8,
        }
        print(" ".join(f"{head:>{width}s}" for head, width in heads.items()))
        for n in (SMALLEST, *sizes):
            path = place / f"{n}.{ending}"
            write(path, n)
            cost, table = run(path, calibration_path, n, method, draws), path.stat().st_size
            path.unlink()
            costs.append(cost)
            each = (cost.processor - costs[0].processor) / n
            print(
                f"{n:9d} {cost.seconds:8.1f} {cost.processor:15.1f} {1e3 * each:11.3f} "
                f"{cost.memory / 1e6:8.0f} {table / 1e6:9.1f} {cost.file / 1e6:8.1f}",
                flush=True,
            )
    start, (before, last) = costs[0], costs[-2:]
    ratio = np.log(last.touches / before.touches)
    results = {
        # of what a touch costs, the start of the program left out
        "time": float(np.log((last.processor - start.processor) / (before.processor - start.processor)) / ratio),
        "memory": float(np.log(last.memory / before.memory) / ratio),
        "bytes": (last.memory - before.memory) / (last.touches - before.touches),
    }
    print(f"from {before.touches} to {last.touches} touches: processor time grows with exponent {results['time']:.3f}")
    print(f"peak memory with exponent {results['memory']:.3f}: {results['bytes']:.0f} bytes a touch")
    return results


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=int, default=LARGEST, help="largest table")
    parser.add_argument("--body", choices=["finger", "pad"], default="finger")
    parser.add_argument("--table", choices=["parquet", "csv"], default="parquet")
    parser.add_argument("--method", choices=["importance", "emcee"], default="importance")
    parser.add_argument("--draws", type=int, default=512)
    parser.add_argument("--folder", type=Path, default=None, help="where tables and posteriors are written for a while")
    chosen = parser.parse_args()
    if chosen.body == "pad" and chosen.method != "emcee":
        parser.error("touches on a pad are drawn by emcee alone: --method emcee")
    main(sizes_up_to(chosen.largest), chosen.method, chosen.draws, chosen.folder, chosen.body, chosen.table)
