"""Coverage of intervals on fingers with an effect that a diagnosis finds by itself and adds.

Fingers are built at random of two rubbers, as in `coverage_of_places.py`, and each has one effect: cross-talk of 2 to
6 % between neighbours, zeros that drift by 2 % of the peak, or gains that drift by 2 %, all together or each by itself;
drifts are exact Matérn 3/2 processes with a length of 600 s. Edges, flats and tips at known places are given to
`bayestouch.diagnose`, which is not told what is missing. An hour after that the finger reads touches that are drawn
from the priors of R, θ_c and P, 20 samples each.

Before: `calibration_before` of the diagnosis, without effects, its discrepancy independent from touch to touch. Before,
by default: what `bayestouch.calibrate` gives for the same touches, which may choose functions of place. After:
`calibration_after`, with what was found. P is read with the force sensor's readings, and from the elements alone. Both
are held against the load that was pressed, which no reading of the force sensor is.

    python studies/coverage_of_effects.py [fingers] [touches a finger] [--processes N | --scheduler ADDRESS]
    python studies/coverage_of_effects.py --docs            writes the table of docs/statistics.md
    python studies/coverage_of_effects.py --condition gain_drift    that effect alone; by default the first two
    python studies/coverage_of_effects.py --first-seed 0    fingers that were looked at
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass, replace

import numpy as np
from _coverage import RUBBERS, SAMPLES, BuiltFinger, Read, by_case, coverage_options, coverage_table, read
from _effects import Change, Course, DriftingGain, DriftingZeros, Leaks
from _page import STATISTICS, put_into_page

import bayestouch
from bayestouch.contact import composite_radius
from bayestouch.data.touches import Touches, touches_from
from bayestouch.model.split_data import SplitData
from bayestouch.simulation.finger import REFERENCE_LOAD
from bayestouch.simulation.plan import LIFT_INTERVAL_S, SAMPLE_INTERVAL_S

CONDITIONS = ("crosstalk", "baseline_drift", "gain_drift", "gain_drift of each element")
WAYS = BEFORE, PLACED, AFTER = "before", "before, by default", "after"
DRIFT_SD, DRIFT_S = 0.02, 600.0
# Between the last touch of the data set and the first that is read, s.
PAUSE_S = 3600.0
# Tips at known places beside edges and flats.
TIPS = {"touch_radii_mm": (1.55, 3.9, 7.55), "touch_span_deg": 60.0, "touch_step_deg": 6.0}
# Fingers that were not looked at before; 0 to 4 were, while this study was written.
FIRST_SEED = 200

HEAD = ["rubber", "effect", "", "R", "θ_c", "P", "P alone", "z R", "z θ_c", "z P", "z P alone"]
HEAD += ["R, mm", "θ_c, °", "P, N/m", "P alone, N/m", "found"]
LAST = "how many diagnoses found which effect. P alone is read without the force sensor"


@dataclass(frozen=True, eq=False)
class Finger:
    """Touches of a finger read before and after its diagnosis, and the names of the effects that this found."""

    reads: dict[str, Read]
    found: tuple[str, ...]


def one_finger(touches: int, job: tuple[str, str, int]) -> Finger:
    """Build, diagnose, touch and read a finger."""
    rubber, condition, seed = job
    rng = np.random.default_rng([4, seed])
    built = BuiltFinger.of(rubber, seed, rng, **TIPS)
    tables = [built.simulated.dataset.calibration, built.simulated.dataset.touches]
    start_s = PAUSE_S + float(tables[1].time_s.max())
    truth = built.drawn_touches(touches, rng)
    touch, time_s = clock(touches, start_s)
    change = effect(condition, built, float(time_s.max()), seed)
    changed = [
        with_effect(table, built, np.asarray(built.simulated.truth[name]["P"]), change)
        for name, table in zip(("calibration", "touches"), tables, strict=True)
    ]
    dataset = replace(built.simulated.dataset, sensor=built.sensor, calibration=changed[0], touches=changed[1])
    clean = built.chain.predict(truth[:, 0], np.radians(truth[:, 1]), truth[:, 2])
    readings, load = built.noisy(change(clean[touch], time_s), truth[touch, 2], rng)
    fresh = touches_from(touch, readings, time_s=time_s, load=load, contact=1.0)
    diagnosis = bayestouch.diagnose(dataset, draws=400, sample=False, seed=seed)
    known = SplitData.of(dataset)
    training = replace(dataset, calibration=known.table.select(known.training))
    ways = {
        BEFORE: diagnosis.calibration_before,
        PLACED: bayestouch.calibrate(training, draws=400, seed=seed),
        AFTER: diagnosis.calibration_after,
    }
    reads = {}
    for way, calibration in ways.items():
        whole, alone = (read(fresh, calibration, truth, use_load=use_load) for use_load in (True, False))
        reads[way] = whole.beside(alone, 2)
    return Finger(reads, diagnosis.effects)


def clock(touches: int, start_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Number of the touch and time (s) of every sample."""
    touch, sample = np.divmod(np.arange(touches * SAMPLES), SAMPLES)
    cycle_s = SAMPLES * SAMPLE_INTERVAL_S + LIFT_INTERVAL_S
    return touch, start_s + touch * cycle_s + sample * SAMPLE_INTERVAL_S


def effect(condition: str, built: BuiltFinger, until_s: float, seed: int) -> Change:
    """The effect of a finger."""
    name, *each = condition.split(" ", 1)
    if name == "crosstalk":
        return Leaks.drawn(seed)
    m = built.chain.n_elements
    own = name == "baseline_drift" or bool(each)
    course = Course(DRIFT_SD, DRIFT_S, until_s, m if own else 1, (seed, 83))
    return (
        DriftingZeros(course, built.chain.response * REFERENCE_LOAD)
        if name == "baseline_drift"
        else DriftingGain(course)
    )


def with_effect(table: Touches, built: BuiltFinger, load: np.ndarray, change: Change) -> Touches:
    """A simulated table of touches at known places, with the effect on readings before their noise."""
    rows = np.unique(table.touch, return_inverse=True)[1]
    radius = composite_radius(table.indenter_radius_mm, built.chain.outer_radius_mm)
    clean = np.asarray(built.chain.predict(radius, np.radians(table.angle_deg), load[rows]))
    return table.with_(readings=table.readings + change(clean, table.time_s) - clean)


def main(
    fingers: int = 5,
    touches: int = 100,
    scheduler: str | None = None,
    processes: int = 1,
    first_seed: int = FIRST_SEED,
    conditions: tuple[str, ...] = CONDITIONS[:2],
) -> list[list[str]]:
    """Print coverage, rms of z and errors; returns the rows of the table."""
    cases = [(rubber, condition) for rubber in RUBBERS for condition in conditions]
    seeds = range(first_seed, first_seed + fingers)
    rows = []
    print(f"{fingers} fingers with {touches} touches each")
    for case, part in by_case(one_finger, touches, cases, seeds, processes=processes, scheduler=scheduler):
        for way in WAYS:
            together = Read.together([each.reads[way] for each in part])
            found = said(part) if way == AFTER else ""
            rows.append([*case, way, *together.summary(fingers), found])
            print(" | ".join(rows[-1]), flush=True)
    return rows


def said(part: list[Finger]) -> str:
    """What the diagnoses found, and how many of them."""
    found = [" and ".join(each.found) or "nothing" for each in part]
    return ", ".join(f"{found.count(each)} {each}" for each in dict.fromkeys(found))


if __name__ == "__main__":
    parser = coverage_options(__doc__, FIRST_SEED)
    parser.add_argument("--condition", action="append", choices=CONDITIONS, help="only this one")
    options = parser.parse_args()
    results = main(
        options.fingers,
        options.touches,
        options.scheduler,
        options.processes,
        options.first_seed,
        tuple(options.condition or CONDITIONS[:2]),
    )
    if options.docs:
        table = coverage_table(HEAD, results, LAST, options.fingers, options.touches)
        put_into_page("coverage_of_effects.py", table, STATISTICS)
