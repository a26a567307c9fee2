"""Coverage of intervals on pads: with nothing missing, and with errors that a calibration or a diagnosis finds.

Pads of nine elements are drawn at random (`_drawn_pads.py`, which shares no code with the package), each with one of:
nothing that is missing; a smooth error of each element's map, 3 % of the peak over 5 mm; cross-talk of 2 to 6 % between
neighbours; zeros that drift by 2 % of the peak, exact Matérn 3/2 processes with a length of 600 s. Two tables of known
touches are given to `bayestouch.diagnose`, which is not told what is missing. An hour after them the pad reads touches
in a table of their own, a minute apart, at places and loads that are drawn from the priors, with and without the force
sensor.

Kernel alone: a calibration without an empirical map. Before: `calibration_before` of the diagnosis, which may choose a
map. After: `calibration_after`, with what was found.

    python studies/coverage_of_pads.py [pads] [touches a pad] [--processes N | --scheduler ADDRESS]
    python studies/coverage_of_pads.py --docs            writes the table of docs/statistics.md
    python studies/coverage_of_pads.py --condition crosstalk    that one alone
    python studies/coverage_of_pads.py --first-seed 0    pads that were looked at
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass

import numpy as np
from _coverage import Read, by_case, coverage_options
from _drawn_pads import FORCE_NOISE, NOMINAL, DrawnPad, Errors, Table
from _page import STATISTICS, markdown_table, put_into_page

import bayestouch
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Pad, Sensor
from bayestouch.data.touches import Touches, touches_from
from bayestouch.model.split_data import SplitData
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.results.objects import Calibration

CONDITIONS = {
    "nothing": Errors(),
    "map": Errors(map_share=0.03),
    "crosstalk": Errors(crosstalk=(0.02, 0.06)),
    "baseline_drift": Errors(drift_share=0.02),
}
WAYS = KERNEL, BEFORE, AFTER = "kernel alone", "before", "after"
LOADS = {"yes": True, "no": False}
# Touches of the two known tables; the second is the one of which a diagnosis holds half out.
KNOWN = (70, 30)
# From touch to touch, s: those that are read are further apart, so that they see more of a drift; between tables.
CYCLES_S, PAUSE_S = (9.0, 9.0, 60.0), 3600.0
# That of the simulated pads, as a maker knows it. By default a calibration chooses one.
PAD_KERNEL = "half-space"
# Pads that were not looked at before; 0 to 9 were, while this study was written.
FIRST_SEED = 300

HEAD = ["model error", "", "load read", "x", "y", "P", "z x", "z y", "z P", "x, mm", "y, mm", "P, N", "found"]


@dataclass(frozen=True, eq=False)
class Found:
    """Touches of a pad, read in each way with (`"yes"`) and without the force sensor; effects of the diagnosis."""

    reads: dict[str, dict[str, Read]]
    effects: tuple[str, ...]


def one_pad(touches: int, job: tuple[str, int]) -> Found:
    """Draw, diagnose, touch and read a pad."""
    condition, seed = job
    rng = np.random.default_rng([5, seed])
    pad = DrawnPad.of(rng)
    known, held, fresh = pad.touched((*KNOWN, touches), CYCLES_S, PAUSE_S, CONDITIONS[condition], rng)
    dataset = DataSet(sensor(), as_known(known), as_known(held))
    diagnosis = bayestouch.diagnose(dataset, kernel=PAD_KERNEL, draws=100, sample=False, seed=seed)
    unknown = touches_from(fresh.touch, fresh.readings, time_s=fresh.time_s, load=fresh.read_load, contact=1.0)
    truth = np.column_stack([fresh.place, fresh.load])

    def reads_with(calibration: Calibration) -> dict[str, Read]:
        return {said: read(unknown, calibration, truth, use_load=use_load) for said, use_load in LOADS.items()}

    reads = {BEFORE: reads_with(diagnosis.calibration_before)}
    # The same calibrations are not read twice: that before without a map, and that after which nothing was found.
    reads[KERNEL] = reads[BEFORE]
    if diagnosis.calibration_before.settings["empirical_map"] == "yes":
        split = SplitData.of(dataset)
        training = DataSet(dataset.sensor, split.table.select(split.training), dataset.touches)
        reads[KERNEL] = reads_with(calibrate_pad(training, kernel=PAD_KERNEL, empirical=False, draws=100, seed=seed))
    reads[AFTER] = reads_with(diagnosis.calibration_after) if diagnosis.effects else reads[BEFORE]
    return Found(reads, diagnosis.effects)


def sensor() -> Sensor:
    """The pad as its maker describes it: nominal places."""
    x, y = (tuple(axis) for axis in NOMINAL.T)
    return Sensor(
        name="simulated pad",
        body=Pad(x, y),
        force_noise_sd=FORCE_NOISE,
        reading_unit="kPa",
        source={"note": "simulated"},
    )


def as_known(table: Table) -> Touches:
    """A table with the places of its touches."""
    place = table.place[table.touch - table.touch[0]]
    return touches_from(
        table.touch,
        table.readings,
        time_s=table.time_s,
        load=table.read_load,
        x_mm=place[:, 0],
        y_mm=place[:, 1],
        contact=1.0,
    )


def read(table: Touches, calibration: Calibration, truth: np.ndarray, *, use_load: bool) -> Read:
    """Read touches, and compare them with the truth: columns x (mm), y (mm), P (N)."""
    found = bayestouch.infer(table, calibration, check_sensor=False, use_load=use_load)
    low, high = (np.column_stack(ends) for ends in zip(*(found.interval(name, 0.9) for name in "xyP"), strict=True))
    error = np.column_stack([found.mean(name) for name in "xyP"]) - truth
    sd = np.column_stack([found.sd(name) for name in "xyP"])
    return Read((low <= truth) & (truth <= high), error, error / sd, np.ones(len(truth), dtype=bool))


def main(
    pads: int = 5,
    touches: int = 100,
    scheduler: str | None = None,
    processes: int = 1,
    first_seed: int = FIRST_SEED,
    conditions: tuple[str, ...] = tuple(CONDITIONS),
) -> list[list[str]]:
    """Print coverage, rms of z and errors; returns the rows of the table."""
    cases = [(condition,) for condition in conditions]
    seeds = range(first_seed, first_seed + pads)
    rows = []
    print(f"{pads} pads with {touches} touches each")
    for (condition,), part in by_case(one_pad, touches, cases, seeds, processes=processes, scheduler=scheduler):
        for way in WAYS:
            for said in LOADS:
                together = Read.together([each.reads[way][said] for each in part])
                found = named(part) if way == AFTER else ""
                rows.append([condition, way, said, *together.summary(pads), found])
                print(" | ".join(rows[-1]), flush=True)
    return rows


def named(part: list[Found]) -> str:
    """What the diagnoses found, and how many of them."""
    found = [" and ".join(each.effects) or "nothing" for each in part]
    return ", ".join(f"{found.count(each)} {each}" for each in dict.fromkeys(found))


def as_markdown(rows: list[list[str]], pads: int, touches: int) -> str:
    """Table of docs/statistics.md."""
    return (
        f"{pads} pads with {touches} touches each. Columns x, y, P: coverage of 90 % intervals, %, with standard "
        "errors from the scatter of pads. Columns z: rms of the error over its stated standard deviation. Columns with "
        "a unit: rms error. *Load read*: whether the force sensor's reading of the touch was used. Last column: how "
        f"many diagnoses found which effect.\n\n{markdown_table(HEAD, rows)}"
    )


if __name__ == "__main__":
    parser = coverage_options(__doc__, FIRST_SEED, "pads")
    parser.add_argument("--condition", action="append", choices=CONDITIONS, help="only this one")
    options = parser.parse_args()
    results = main(
        options.pads,
        options.touches,
        options.scheduler,
        options.processes,
        options.first_seed,
        tuple(options.condition or CONDITIONS),
    )
    if options.docs:
        put_into_page("coverage_of_pads.py", as_markdown(results, options.pads, options.touches), STATISTICS)
