"""Speed-up of a local Dask cluster of two workers over one, and what a block costs beyond its work.

The same touches are read in blocks of several sizes by one worker and by two, and by this process alone. Clusters are
started, and workers have imported what they need, before a time is taken. Overhead: what a cluster of one worker takes
longer than this process, by the number of blocks (transport, scheduling, writing), as the straight line that fits best.
Times are the shortest of so many runs. How far they are from the line says how well the overhead is known.

    python studies/benchmarks/cluster.py [touches] [--repeats 2]
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import dataclass

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import bayestouch
from bayestouch.data.touches import Touches, touches_from
from bayestouch.finger.calibration import finger_chain
from bayestouch.reading import driver as run_module
from bayestouch.simulation import FingerDesign

DRAWS = 512
SIZES = (512, 2048, 8192)
#: Share of its time that a block may spend on anything but its touches.
OVERHEAD = 0.05


def prepared(n: int) -> tuple[Touches, bayestouch.Calibration]:
    """Single samples of n touches on a calibrated simulated finger."""
    calibration = bayestouch.calibrate(bayestouch.simulate(FingerDesign(), seed=3).dataset, draws=200)
    chain, rng = finger_chain(calibration), np.random.default_rng(1)
    load = float(calibration.settings["typical_load"]) * rng.uniform(0.5, 1.5, n)
    readings = chain.predict(rng.uniform(0.3, 12.6, n), np.radians(rng.uniform(-60, 60, n)), load)
    readings += calibration.noise.tactile_sd * rng.standard_normal(readings.shape)
    return touches_from(np.arange(n), readings, load=load), calibration


def seconds(
    touches: Touches, calibration: bayestouch.Calibration, scheduler: str | None, size: int, repeats: int
) -> float:
    """Shortest time of a run in blocks of a size that keeps summaries."""
    run_module.BLOCK_DRAWS, run_module.BLOCK_UNIT = 1, size
    best = np.inf
    for _ in range(repeats):
        begun = time.perf_counter()
        options = {"draws": DRAWS, "method": "importance", "summary_only": True, "workers": 1, "seed": 1}
        bayestouch.infer(touches, calibration, scheduler=scheduler, **options)
        best = min(best, time.perf_counter() - begun)
    return best


@dataclass(frozen=True)
class Line:
    """What a cluster takes longer than one process: something for each block, and once for all, s.

    `miss` is the largest distance of a run from the line.
    """

    block: float
    once: float
    miss: float

    @classmethod
    def through(cls, blocks: np.ndarray, longer: np.ndarray) -> Line:
        """The line of least squares through runs of so many blocks (n,) that took so much longer (n,), s."""
        block, once = np.polyfit(blocks, longer, 1)
        return cls(float(block), float(once), float(np.abs(once + block * blocks - longer).max()))


def main(n: int = 32_768, repeats: int = 2, sizes: tuple[int, ...] = SIZES) -> dict[str, float]:
    """Print the table; returns the largest speed-up, and times in s: of a block, of a run, of a touch."""
    import distributed

    touches, calibration = prepared(n)
    rows = []
    usual = run_module.BLOCK_DRAWS, run_module.BLOCK_UNIT
    print(f"{n} touches, {DRAWS} draws each, importance, summaries kept, {os.cpu_count()} cores")
    print(
        f"{'block':>6s} {'here s':>8s} {'1 worker s':>11s} {'2 workers s':>12s} {'speed-up':>9s} {'overhead ms':>12s}"
    )
    try:
        for size in sizes:
            times = [seconds(touches, calibration, None, size, repeats)]
            for workers in (1, 2):
                with distributed.LocalCluster(
                    n_workers=workers, threads_per_worker=1, dashboard_address=None
                ) as cluster:
                    address = cluster.scheduler_address
                    seconds(touches.select(np.arange(min(n, 512))), calibration, address, 64, 1)  # imports
                    times.append(seconds(touches, calibration, address, size, repeats))
            rows.append((size, *times))
            here, one, two = times
            overhead = (one - here) / -(-n // size)
            print(f"{size:6d} {here:8.2f} {one:11.2f} {two:12.2f} {one / two:9.2f} {1e3 * overhead:12.1f}", flush=True)
    finally:
        run_module.BLOCK_DRAWS, run_module.BLOCK_UNIT = usual
    size, here, one, two = np.array(rows).T
    line = Line.through(np.ceil(n / size), one - here)
    results = {
        "speed-up": float(np.max(one / two)),
        "overhead": max(0.0, line.block),
        "once": max(0.0, line.once),
        "touch": float(here.min()) / n,
    }
    needed = results["overhead"] / OVERHEAD / results["touch"]
    print(
        f"a run on a cluster costs {results['once']:.1f} s once and {1e3 * results['overhead']:.1f} ms a block beyond "
        f"its touches, a touch {1e3 * results['touch']:.3f} ms: "
        f"{100 * OVERHEAD:.0f} % of overhead at {needed:.0f} touches a block of {DRAWS} draws; "
        f"the runs are up to {line.miss:.1f} s from this line"
    )
    return results


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("touches", type=int, nargs="?", default=32_768)
    parser.add_argument("--repeats", type=int, default=2)
    chosen = parser.parse_args()
    main(chosen.touches, chosen.repeats)
