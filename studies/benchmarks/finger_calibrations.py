"""How well emcee draws the calibrations of fingers with effects: effective draws, R-hat and processor time.

    python studies/benchmarks/finger_calibrations.py [CASE ...] [--docs]

Simulated fingers of 16 elements, with the effects that the model has. `--docs` writes the table of docs/statistics.md.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from _page import STATISTICS, markdown_table, put_into_page
from _processor import processor_seconds

import bayestouch
from bayestouch.effects.stated import StatedModel

#: Effects with the size of each, by name of the row.
CASES: dict[str, dict[str, float]] = {
    "no effect": {},
    "cross-talk": {"crosstalk": 0.04},
    "cross-talk and creep": {"crosstalk": 0.04, "creep": 0.05},
    "cross-talk and bent gain": {"crosstalk": 0.04, "gain_nonlinearity": 0.06},
    "creep and outliers": {"creep": 0.05, "outliers": 0.004},
    "drift of zeros": {"baseline_drift": 0.02},
    "cross-talk and drift of gains": {"crosstalk": 0.04, "gain_drift": 0.02},
}
HEAD = ("effects", "accepted", "bulk ESS of 1,000", "R-hat", "time")


def row(name: str, design: bayestouch.FingerDesign) -> list[str]:
    """One row of the table."""
    effects = CASES[name]
    dataset = bayestouch.simulate(design, effects=effects, seed=3).dataset
    model = StatedModel("finger", "layer", tuple((effect, {}) for effect in effects))
    begun = processor_seconds()
    found = bayestouch.calibrate(dataset, model=model, discrepancy="touch").statistics
    seconds = processor_seconds() - begun
    return [
        name,
        f"{found['acceptance']:.2f}",
        f"{found['ess_bulk']:.0f}",
        f"{found['rhat']:.3f}",
        f"{seconds:.1f} s",
    ]


def main(names: tuple[str, ...], design: bayestouch.FingerDesign, docs: bool = False) -> list[list[str]]:
    """Print the table and return its rows."""
    rows = [row(name, design) for name in names]
    table = markdown_table(HEAD, rows)
    print(table)
    if docs:
        put_into_page("benchmarks/finger_calibrations.py", table, STATISTICS)
    return rows


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("names", metavar="CASE", nargs="*", choices=list(CASES))
    parser.add_argument("--docs", action="store_true")
    given = parser.parse_args()
    main(tuple(given.names) or tuple(CASES), bayestouch.FingerDesign(), given.docs)
