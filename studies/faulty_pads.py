"""Faulty pads: are faults found, and do the stated intervals hold with and without the check?

As `faulty_sensors.py`, on a simulated pad of eight elements (two columns of four, 6.75 mm apart, 6 mm thick): it is
calibrated while sound, then one thing breaks, and tables of 60 touches are read with and without the check.

    python studies/faulty_pads.py [--pads 4] [--results FILE] [--docs] [--processes 1 | --scheduler ADDRESS]

With ``--results`` a run goes on from the pads that the file holds. With ``--docs`` nothing is run: the table in
``docs/robustness.md`` is made from the file.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
from pathlib import Path

import numpy as np
from _page import put_into_page
from faulty_sensors import FAULTS, Fault, Row, anything, as_markdown, summarised, tables_of

import bayestouch
from bayestouch.results.objects import TouchPosteriors
from bayestouch.simulation import PadDesign, simulate

TABLES, TOUCHES, NAMES = 20, 60, ("x", "y", "P")
#: Those of a finger but changes of gain below 5 %, which a finger's table shows to be left in.
OURS = tuple(fault for fault in FAULTS if fault.name not in ("gain x 0.98", "gain x 1.02"))


def inside(result: TouchPosteriors, truth: dict[str, np.ndarray]) -> list[float]:
    """Share of touches whose central 90 % interval holds the truth: x, y, P."""
    ends = {name: result.interval(name) for name in NAMES}
    return [float(np.mean((low <= truth[name]) & (truth[name] <= high))) for name, (low, high) in ends.items()]


def element_of(fault: Fault, rng: np.random.Generator) -> int:
    """An element of the first column of four, whose wires are swapped with those of a neighbour."""
    element = int(rng.integers(4))
    return min(element, 2) if fault.name == "neighbours swapped" else element  # the last has the one before beside it


def one_pad(shared: None, seed: int) -> list[tuple[str, Row]]:
    """Every fault once and `TABLES` sound tables, on one pad."""
    simulated = simulate(PadDesign(n_touches=TABLES * TOUCHES), seed=seed)
    calibration = bayestouch.calibrate(simulated.dataset, draws=200, seed=seed)
    rng = np.random.default_rng([seed, 7])
    touches = simulated.dataset.touches
    ids = np.unique(touches.touch)
    true = {name: np.asarray(values) for name, values in simulated.truth["touches"].items()}
    rows: list[tuple[str, Row]] = []
    for number, part in enumerate(np.array_split(rng.permutation(ids), TABLES)):
        some = np.sort(part)
        table = touches.select(np.isin(touches.touch, some))
        truth = {name: true[name][np.searchsorted(ids, some)] for name in NAMES}

        def read(readings: object, check: bool) -> TouchPosteriors:
            return bayestouch.infer(readings, calibration, check_sensor=check, draws=256, seed=seed)  # type: ignore[arg-type]  # tables of two kinds

        sound = read(table, True)
        noticed, covered = anything(sound, 0), inside(sound, truth)
        rows.append(("none", (noticed, noticed, covered, covered)))
        for fault in OURS[number::TABLES]:
            element = element_of(fault, rng)
            broken = fault.apply(table, element, rng)
            before, after = (read(broken, check) for check in (False, True))
            named = fault.found(after, element)
            rows.append((fault.name, (anything(after, element), named, inside(before, truth), inside(after, truth))))
    return rows


def main(
    pads: int = 4, results: Path | None = None, *, processes: int = 1, scheduler: str | None = None
) -> dict[str, dict[str, object]]:
    """Print the table; returns its rows by fault."""
    summary = summarised(tables_of(one_pad, pads, results, processes, scheduler), OURS)
    print(as_markdown(summary, "xyP"))
    return summary


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--pads", type=int, default=4)
    parser.add_argument("--results", type=Path)
    parser.add_argument("--docs", action="store_true")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--scheduler", metavar="ADDRESS", help="Dask cluster that does the work")
    options = parser.parse_args()
    if options.docs and options.results is None:
        parser.error("--docs needs --results, the file that a run with --results wrote")
    if options.docs:
        put_into_page("faulty_pads.py", as_markdown(summarised(json.loads(options.results.read_text()), OURS), "xyP"))
    else:
        main(options.pads, options.results, processes=options.processes, scheduler=options.scheduler)
