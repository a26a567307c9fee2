"""Faulty sensors: are they found, and do the stated intervals hold with and without the check?

Simulated fingers are calibrated while sound. Then one thing breaks (an element dies, sticks, changes its gain or zero,
two wires are swapped, the force sensor is off by a factor), and tables of touches are read twice: as if nothing had
happened, and with the check that `infer` makes by default. For each fault: how often it is found and rightly named,
and the coverage of the 90 % intervals of R, θ_c and P. Tables without a fault give the rate of false alarms.

    python studies/faulty_sensors.py [--fingers 20] [--results FILE] [--docs] [--processes 1 | --scheduler ADDRESS]

With ``--results`` a run goes on from the fingers that the file holds, so that the whole may be run in pieces. With
``--docs`` nothing is run: the table in ``docs/robustness.md`` is made from the file.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from _page import put_into_page
from _shared_out import finished

import bayestouch
from bayestouch.contact import composite_radius
from bayestouch.data.sensor import finger_of
from bayestouch.data.touches import Touches
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.simulation import FingerDesign, simulate

#: Radii from an edge to a flat; with 61 locations they make as many tables as there are radii.
RADII = tuple(float(r) for r in (0.0, *np.geomspace(0.5, 30.0, 18), np.inf))
NAMES = ("R", "theta_c", "P")
#: Of a table of touches: noticed or not, rightly named or not, coverage before and after (R, θ_c, P).
Row = tuple[bool, bool, list[float], list[float]]
Break = Callable[[Touches, int, np.random.Generator], Touches]


@dataclass(frozen=True)
class Fault:
    """A way to break a sensor, and what the check should say of it."""

    name: str
    apply: Break
    found: Callable[[TouchPosteriors, int], bool]


def design() -> FingerDesign:
    """The paper's finger, calibrated every 2° with 5 samples a touch."""
    return FingerDesign(
        samples_per_touch=5,
        edge_step_deg=2.0,
        flat_step_deg=6.0,
        touch_radii_mm=RADII,
        touch_span_deg=60.0,
        touch_step_deg=2.0,
    )


def _elements(change: Callable[[np.ndarray, np.random.Generator], np.ndarray]) -> Break:
    def apply(touches: Touches, element: int, rng: np.random.Generator) -> Touches:
        readings = touches.readings.copy()
        readings[:, element] = change(readings[:, element], rng)
        return touches.with_(readings=readings)

    return apply


def _swap(distance: int) -> Break:
    def apply(touches: Touches, element: int, rng: np.random.Generator) -> Touches:
        readings = touches.readings.copy()
        pair = [element, element + distance]
        readings[:, pair] = readings[:, pair[::-1]]
        return touches.with_(readings=readings)

    return apply


def _force(factor: float) -> Break:
    return lambda touches, element, rng: touches.with_(load=touches.load * factor)


def _all_gains(sd: float) -> Break:
    def apply(touches: Touches, element: int, rng: np.random.Generator) -> Touches:
        return touches.with_(readings=touches.readings * np.exp(sd * rng.standard_normal(touches.n_elements)))

    return apply


def left_out(result: TouchPosteriors, element: int) -> bool:
    """The element, and nothing else, was left out."""
    settings = result.settings
    other = "force_sensor" in settings or "element_order" in settings or "noise_widened" in settings
    return settings.get("elements_left_out") == f"e{element + 1:02d}" and not other


def _exchanged(distance: int) -> Callable[[TouchPosteriors, int], bool]:
    def found(result: TouchPosteriors, element: int) -> bool:
        order = np.arange(result.sensor.n_elements)
        order[[element, element + distance]] = order[[element + distance, element]]
        same = result.settings.get("element_order") == " ".join(f"e{column + 1:02d}" for column in order)
        return same and "elements_left_out" not in result.settings

    return found


def _no_force(result: TouchPosteriors, element: int) -> bool:
    return "force_sensor" in result.settings and "elements_left_out" not in result.settings


def anything(result: TouchPosteriors, element: int) -> bool:
    return any(note.startswith("sensor check") for note in result.notes)


FAULTS = (
    Fault("dead (noise only)", _elements(lambda y, rng: 17.2 * rng.standard_normal(len(y))), left_out),
    Fault("stuck at 0", _elements(lambda y, rng: np.zeros(len(y))), left_out),
    Fault("stuck at a reading", _elements(lambda y, rng: np.full(len(y), rng.choice(y))), left_out),
    Fault("neighbours swapped", _swap(1), _exchanged(1)),
    Fault("wires swapped", _swap(4), _exchanged(4)),
    Fault("zero moved by 5 % of peak", _elements(lambda y, rng: y + 50.0), left_out),
    *(
        Fault(f"gain x {factor:g}", _elements(lambda y, rng, factor=factor: y * factor), left_out)
        for factor in (0.5, 0.8, 0.9, 0.95, 0.98, 1.02, 1.05, 1.1, 1.25, 2.0)
    ),
    Fault("all gains, sd 5 %", _all_gains(0.05), anything),
    *(Fault(f"force x {factor:g}", _force(factor), _no_force) for factor in (0.7, 0.9, 0.98, 1.02, 1.1, 1.4)),
)


def tables(touches: Touches, rng: np.random.Generator) -> list[np.ndarray]:
    """Touches shared out at random into as many tables as there are radii."""
    return [np.sort(part) for part in np.array_split(rng.permutation(np.unique(touches.touch)), len(RADII))]


def inside(result: TouchPosteriors, truth: dict[str, np.ndarray], outer: float) -> np.ndarray:
    """Share of touches whose central 90 % interval holds the truth: R, θ_c, P."""
    true = {**truth, "R": composite_radius(result.rows.radius_mm, outer)}
    out = []
    for name in NAMES:
        low, high = result.interval(name)
        # a knife edge or a flat lies on the end of R's range, which no central interval holds
        inner = (true["R"] > 0) & (true["R"] < outer) if name == "R" else np.ones(len(low), dtype=bool)
        out.append(np.mean((low <= true[name])[inner] & (true[name] <= high)[inner]))
    return np.array(out)


def read(table: Touches, calibration: Calibration, check: bool, seed: int) -> TouchPosteriors:
    """Posteriors of a table, with or without the check."""
    return bayestouch.infer(
        table, calibration, check_sensor=check, method="importance", draws=512, workers=1, seed=seed
    )


def one_finger(shared: None, seed: int) -> list[tuple[str, Row]]:
    """Every fault once and as many sound tables as there are radii, on one finger."""
    simulated = simulate(design(), seed=seed)
    calibration = bayestouch.calibrate(simulated.dataset, draws=400, seed=seed)
    rng = np.random.default_rng([seed, 7])
    touches = simulated.dataset.touches
    outer = finger_of(simulated.dataset.sensor).outer_radius_mm
    ids = np.unique(touches.touch)
    true = {name: np.asarray(values) for name, values in simulated.truth["touches"].items()}
    rows: list[tuple[str, Row]] = []
    for number, part in enumerate(tables(touches, rng)):
        table = touches.select(np.isin(touches.touch, part))
        truth = {name: values[np.searchsorted(ids, part)] for name, values in true.items()}
        sound = read(table, calibration, True, seed)
        noticed, covered = anything(sound, 0), inside(sound, truth, outer).tolist()
        rows.append(("none", (noticed, noticed, covered, covered)))
        for fault in FAULTS[number :: len(RADII)]:
            element = int(rng.integers(3, 9))  # under the touches, and so are its partners
            broken = fault.apply(table, element, rng)
            before, after = (read(broken, calibration, check, seed) for check in (False, True))
            covered = [inside(result, truth, outer).tolist() for result in (before, after)]
            rows.append((fault.name, (anything(after, element), fault.found(after, element), covered[0], covered[1])))
    return rows


def main(
    fingers: int = 20, results: Path | None = None, *, processes: int = 1, scheduler: str | None = None
) -> dict[str, dict[str, Any]]:
    """Print the table; returns its rows by fault."""
    summary = summarised(tables_of(one_finger, fingers, results, processes, scheduler))
    print(as_markdown(summary))
    return summary


def tables_of(
    one: Callable[[None, int], list[tuple[str, Row]]],
    sensors: int,
    results: Path | None,
    processes: int,
    scheduler: str | None,
) -> dict[str, list[tuple[str, Row]]]:
    """Rows of so many sensors by seed; those in the file `results` are not made again."""
    done: dict[str, list[tuple[str, Row]]] = {}
    if results is not None and results.exists():
        done = json.loads(results.read_text())
    missing = [seed for seed in range(sensors) if str(seed) not in done]
    for place, rows in finished(one, None, missing, processes=processes, scheduler=scheduler):
        done[str(missing[place])] = rows
        if results is not None:
            results.write_text(json.dumps(done))
    return done


def summarised(done: dict[str, list[tuple[str, Row]]], faults: Sequence[Fault] = FAULTS) -> dict[str, dict[str, Any]]:
    """By fault: number of tables, shares noticed and rightly named, mean coverage in % before and after."""
    out: dict[str, dict[str, Any]] = {}
    for name in ("none", *(fault.name for fault in faults)):
        rows = [row for finger in done.values() for fault, row in finger if fault == name]
        if rows:
            noticed, named, before, after = (np.array(column, dtype=float) for column in zip(*rows, strict=True))
            out[name] = {
                "tables": len(rows),
                "noticed": noticed.mean(),
                "named": named.mean(),
                "before": 100 * np.nanmean(before, axis=0),
                "after": 100 * np.nanmean(after, axis=0),
            }
    return out


def as_markdown(summary: dict[str, dict[str, Any]], letters: str = "RθP") -> str:
    """The table; coverage of quantities of these letters."""
    heads = (
        "fault",
        "tables",
        "noticed",
        "rightly named",
        *(f"{n}, {c}" for c in ("no check", "check") for n in letters),
    )
    lines = ["| " + " | ".join(heads) + " |", "|---|" + "--:|" * (len(heads) - 1)]
    for name, row in summary.items():
        shares = (f"{100 * row['noticed']:.0f} %", "" if name == "none" else f"{100 * row['named']:.0f} %")
        coverage = [f"{value:.0f}" for key in ("before", "after") for value in row[key]]
        lines.append(f"| {name} | {row['tables']} | {' | '.join((*shares, *coverage))} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--fingers", type=int, default=20)
    parser.add_argument("--results", type=Path)
    parser.add_argument("--docs", action="store_true")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--scheduler", metavar="ADDRESS", help="Dask cluster that does the work")
    options = parser.parse_args()
    if options.docs and options.results is None:
        parser.error("--docs needs --results, the file that a run with --results wrote")
    if options.docs:
        put_into_page("faulty_sensors.py", as_markdown(summarised(json.loads(options.results.read_text()))))
    else:
        main(options.fingers, options.results, processes=options.processes, scheduler=options.scheduler)
