"""Simulation-based calibration of the posteriors of touches, at length: R, r_c, θ_c and P on a finger.

Touches are drawn from the prior and simulated with the draws of a calibration, then read with that calibration: by
emcee and by importance sampling, as single samples and as averages of 20. The statistics and their thresholds are
those of `bayestouch.RankStatistics`; what they notice is the table of `sbc_power.py`.

    python studies/sbc_touches.py [FOLDER] [--small] [--no-pictures]
    python studies/sbc_touches.py --docs                 writes the table of docs/statistics.md
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import sys
from itertools import product
from pathlib import Path

from _page import STATISTICS, docs_of, markdown_table, put_into_page
from _published import options, save

import bayestouch
from bayestouch.simulation import embedded_dataset
from bayestouch.simulation_based_calibration.ranks import RankStatistics

METHODS, SAMPLES = ("emcee", "importance"), (1, 20)
SIMULATIONS = 2000
Found = dict[tuple[str, int], RankStatistics]


def main(simulations: int = SIMULATIONS, folder: Path | None = None) -> Found:
    """Print p-values and coverage; returns the ranks by method and samples."""
    # a draw of the calibration for each touch: none shares its error with another
    calibration = bayestouch.calibrate(embedded_dataset().dataset, draws=simulations)
    found = {}
    for method, samples in product(METHODS, SAMPLES):
        result = bayestouch.sbc(calibration, simulations=simulations, samples=samples, method=method, seed=1)
        found[method, samples] = result
        verdict = "uniform" if result.passes(0.01) else "NOT uniform"
        print(f"{method}, {samples} samples a touch, {simulations} touches: {verdict} at 1 %")
        print(f"(p-values: {result.threshold(0.01):.2g} at least, pooled {result.pooled_threshold(0.01):.2g})")
        print(result.table(), end="\n\n")
        if folder is not None:
            save(result.plot(), folder, f"sbc_touches_{method}_{samples}")
    return found


def as_markdown(found: Found) -> str:
    """Table of docs/statistics.md: p-values by quantity, and the pooled statistic."""
    first = next(iter(found.values()))
    head = ["sampler", "samples a touch", *(f"p of {name}" for name in first.ranks), "pooled mean square"]
    head += ["pooled p", "independent scores", "uniform at 1 %"]
    rows = []
    for (method, samples), result in found.items():
        pooled = result.pooled
        values = [f"{p:.3f}" for p in result.p_value.values()]
        values += [f"{pooled.mean_square:.3f}", f"{pooled.p_value:.3f}", f"{pooled.scores:.0f}"]
        rows.append([method, str(samples), *values, "yes" if result.passes(0.01) else "**no**"])
    count = len(next(iter(first.ranks.values())))
    return (
        f"{count:,} touches in each row; a p-value of one quantity is to be {first.threshold(0.01):.2g} at least, the "
        f"pooled one {first.pooled_threshold(0.01):.2g}.\n\n{markdown_table(head, rows)}"
    )


if __name__ == "__main__":
    docs, others = docs_of(sys.argv[1:])
    small, pictures = options(__doc__, others)
    result = main(100 if small else SIMULATIONS, pictures)
    if docs:
        put_into_page("sbc_touches.py", as_markdown(result), STATISTICS)
