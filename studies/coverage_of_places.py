"""Coverage of intervals on fingers that miss the elastic model by a function of place.

Fingers are built at random of two rubbers: that of the paper's finger, and a stiffer one with elements nearer to the
core. Each gets errors that belong to a place, smooth and drawn anew; it is calibrated with edges and flats, and reads
touches that are drawn from the priors of R, θ_c and P, 20 samples each. Before: the discrepancy is independent from
touch to touch. After: the default, which may choose functions of place.

    python studies/coverage_of_places.py [fingers] [touches a finger] [--processes N | --scheduler ADDRESS]
    python studies/coverage_of_places.py --docs         writes the table of docs/statistics.md
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import replace

import numpy as np
from _coverage import RUBBERS, SAMPLES, BuiltFinger, Read, by_case, coverage_options, coverage_table, read
from _page import STATISTICS, put_into_page
from _placed import Missed, MissedFinger

import bayestouch
from bayestouch.data.touches import Touches, touches_from

CONDITIONS = {
    "nothing": Missed(),
    "E map, 2.06 % of the peak over 8°": Missed(map_percent=2.06),
    "place, 1.26 % of the peak over 5°": Missed(place_percent=1.26),
    "curvature of the surface, 0.0084 /mm over 10°": Missed(curvature=0.0084),
}
WAYS = {"before": "touch", "after": "auto"}
# Fingers that were not looked at while functions of place were written.
FIRST_SEED = 100

HEAD = [
    "rubber",
    "model error",
    "",
    "R",
    "θ_c",
    "P",
    "z R",
    "z θ_c",
    "z P",
    "R, mm",
    "θ_c, °",
    "P, N/m",
    "chosen",
]
LAST = "number of fingers on which functions of place were chosen"

# By way: what was read, and whether functions of place were chosen.
Finger = dict[str, tuple[Read, bool]]


def one_finger(touches: int, job: tuple[str, str, int]) -> Finger:
    """Build, calibrate, touch and read a finger, in each way."""
    rubber, condition, seed = job
    rng = np.random.default_rng([3, seed])
    built = BuiltFinger.of(rubber, seed, rng, touch_radii_mm=(3.9,))
    finger = MissedFinger.of(built.chain, CONDITIONS[condition], seed)
    dataset = replace(finger.calibrating(built.simulated), sensor=built.sensor)
    truth = built.drawn_touches(touches, rng)
    table = touched(built, finger, truth, rng)
    out = {}
    for way, discrepancy in WAYS.items():
        calibration = bayestouch.calibrate(dataset, discrepancy=discrepancy, draws=400, seed=seed)
        out[way] = read(table, calibration, truth), "place_functions" in calibration.extra
    return out


def touched(built: BuiltFinger, finger: MissedFinger, truth: np.ndarray, rng: np.random.Generator) -> Touches:
    """Readings of the finger as it was built."""
    clean = finger.predict(truth[:, 0], np.radians(truth[:, 1]), truth[:, 2])
    touch = np.repeat(np.arange(len(clean)), SAMPLES)
    readings, load = built.noisy(clean[touch], truth[touch, 2], rng)
    return touches_from(touch, readings, load=load, contact=1.0)


def main(
    fingers: int = 5,
    touches: int = 100,
    scheduler: str | None = None,
    processes: int = 1,
    first_seed: int = FIRST_SEED,
) -> list[list[str]]:
    """Print coverage, rms of z and errors; returns the rows of the table."""
    cases = [(rubber, condition) for rubber in RUBBERS for condition in CONDITIONS]
    seeds = range(first_seed, first_seed + fingers)
    rows = []
    print(f"{fingers} fingers with {touches} touches each")
    for case, part in by_case(one_finger, touches, cases, seeds, processes=processes, scheduler=scheduler):
        for way in WAYS:
            together = Read.together([each[way][0] for each in part])
            chosen = sum(each[way][1] for each in part)
            rows.append([*case, way, *together.summary(fingers), f"{chosen}"])
            print(" | ".join(rows[-1]), flush=True)
    return rows


if __name__ == "__main__":
    options = coverage_options(__doc__, FIRST_SEED).parse_args()
    results = main(options.fingers, options.touches, options.scheduler, options.processes, options.first_seed)
    if options.docs:
        table = coverage_table(HEAD, results, LAST, options.fingers, options.touches)
        put_into_page("coverage_of_places.py", table, STATISTICS)
