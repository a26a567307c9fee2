"""Time and memory of `bayestouch infer` on 10³ ... 10⁶ touches: both beside what a linear cost would be.

Each table of single samples is written as Parquet and read by the command in a process of its own, whose processor
time (of all its processes) and peak memory (of the largest) the system tells. Summaries of 512 weighted draws are kept.

    python studies/benchmarks/scaling.py [--largest 1000000] [--method importance|emcee] [--draws 512] [--folder DIR]
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import bayestouch
from bayestouch.data.touch_table import write_touches
from bayestouch.data.touches import touches_from
from bayestouch.finger.calibration import finger_chain
from bayestouch.simulation import FingerDesign

# A table so small that what it costs is starting the program, solving contacts and opening files.
SMALLEST = 64
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


def run(folder: Path, calibration: Path, n: int, method: str, draws: int) -> Cost:
    """Run the command on the table of n touches."""
    output = folder / "posterior.nc"
    command = [sys.executable, "-m", "bayestouch", "infer", str(folder / f"{n}.parquet"), "--quiet"]
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


def main(
    sizes: tuple[int, ...] = (1000, 10_000, 100_000, 1_000_000),
    method: str = "importance",
    draws: int = 512,
    folder: Path | None = None,
) -> dict[str, float]:
    """Print the table as it comes; returns exponents of time and memory, and bytes a touch."""
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        place = Path(temporary)
        calibration_path, calibration = calibrated(place)
        costs = []
        print(f"{method}, {draws} draws a touch, summaries kept, {os.cpu_count()} cores")
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
            write_table(place / f"{n}.parquet", calibration, n)
            cost = run(place, calibration_path, n, method, draws)
            table = (place / f"{n}.parquet").stat().st_size
            (place / f"{n}.parquet").unlink()
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
    parser.add_argument("--largest", type=int, default=1_000_000, help="largest table")
    parser.add_argument("--method", choices=["importance", "emcee"], default="importance")
    parser.add_argument("--draws", type=int, default=512)
    parser.add_argument("--folder", type=Path, default=None, help="where tables and posteriors are written for a while")
    chosen = parser.parse_args()
    decades = [10**k for k in range(3, 10) if 10**k < chosen.largest]
    main((*decades, chosen.largest), chosen.method, chosen.draws, chosen.folder)
