"""Simulation-based calibration of the calibration posterior, at length: every parameter of a finger of four elements.

All parameters are drawn from their priors, calibration touches simulated and calibrated with, and the truth ranked:
five parameters of each element, σ, μ, the force sensor's noise, two true loads and the log density. The statistic and
its threshold are those of `bayestouch.ranks.RankStatistics`.

    python studies/sbc_calibration.py [FOLDER] [--small] [--no-pictures] [--scheduler ADDRESS]
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import sys
from dataclasses import replace
from pathlib import Path

from _published import options, save
from _shared_out import scheduler_of

import bayestouch
from bayestouch.ranks import RankStatistics
from bayestouch.simulation import FingerDesign

DESIGN = FingerDesign(
    n_elements=4,
    samples_per_touch=4,
    calibration_span_deg=36.0,
    edge_step_deg=4.0,
    flat_step_deg=8.0,
    touch_radii_mm=(3.9,),
    touch_span_deg=2.0,
)


# Two elements and contacts that are quickly solved
SMALL = replace(DESIGN, n_elements=2, calibration_span_deg=24.0, contact="hertz")


def main(
    simulations: int = 500, design: FingerDesign = DESIGN, folder: Path | None = None, scheduler: str | None = None
) -> RankStatistics:
    """Print p-values and coverage; returns the ranks."""
    dataset = bayestouch.simulate(design, seed=1).dataset
    result = bayestouch.sbc(dataset, simulations=simulations, contact=design.contact, seed=1, scheduler=scheduler)
    verdict = "uniform" if result.passes(0.01) else "NOT uniform"
    print(f"{simulations} calibrations, {len(result.ranks)} quantities: {verdict} at 1 %")
    print(f"(each p-value is to be {result.threshold(0.01):.2g} at least)")
    print(result.table())
    if folder is not None:
        save(result.plot(), folder, "sbc_calibration")
    return result


if __name__ == "__main__":
    scheduler, others = scheduler_of(sys.argv[1:])
    small, pictures = options(__doc__, others)
    main(100, SMALL, pictures, scheduler) if small else main(folder=pictures, scheduler=scheduler)
