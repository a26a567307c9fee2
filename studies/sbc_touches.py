"""Simulation-based calibration of the posteriors of touches, at length: R, θ_c and P on a finger.

Touches are drawn from the prior and read with a calibration that was inferred, by emcee and by importance sampling, as
single samples and as averages of 20. The statistic and its threshold are those of `bayestouch.ranks.RankStatistics`.

    python studies/sbc_touches.py [FOLDER] [--small] [--no-pictures]
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from itertools import product
from pathlib import Path

from _published import options, save

import bayestouch
from bayestouch.ranks import RankStatistics
from bayestouch.simulation import embedded_dataset

METHODS, SAMPLES = ("emcee", "importance"), (1, 20)


def main(simulations: int = 2000, folder: Path | None = None) -> dict[tuple[str, int], RankStatistics]:
    """Print p-values and coverage; returns the ranks by method and samples."""
    calibration = bayestouch.calibrate(embedded_dataset().dataset)
    found = {}
    for method, samples in product(METHODS, SAMPLES):
        result = bayestouch.sbc(calibration, simulations=simulations, samples=samples, method=method, seed=1)
        found[method, samples] = result
        verdict = "uniform" if result.passes(0.01) else "NOT uniform"
        print(f"{method}, {samples} samples a touch, {simulations} touches: {verdict} at 1 %")
        print(f"(each p-value is to be {result.threshold(0.01):.2g} at least)")
        print(result.table(), end="\n\n")
        if folder is not None:
            save(result.plot(), folder, f"sbc_touches_{method}_{samples}")
    return found


if __name__ == "__main__":
    small, pictures = options(__doc__)
    main(100 if small else 2000, pictures)
