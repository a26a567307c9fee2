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

import argparse
from dataclasses import dataclass, replace

import numpy as np
from _page import STATISTICS, markdown_table, put_into_page
from _placed import Missed, MissedFinger
from _shared_out import finished
from _simulated import true_chain
from nicolson_fearing.paper_design import SHEAR_MODULUS, paper_design

import bayestouch
from bayestouch.data.touches import Touches, touches_from
from bayestouch.results.objects import Calibration

RUBBERS = {
    f"{SHEAR_MODULUS:g} MPa, elements at 10.3 mm": (SHEAR_MODULUS, 10.3),
    "0.15 MPa, elements at 9.9 mm": (0.15, 9.9),
}
CONDITIONS = {
    "nothing": Missed(),
    "E map, 2.06 % of the peak over 8°": Missed(map_percent=2.06),
    "place, 1.26 % of the peak over 5°": Missed(place_percent=1.26),
    "curvature of the surface, 0.0084 /mm over 10°": Missed(curvature=0.0084),
}
WAYS = BEFORE, AFTER = {"before": "touch", "after": "auto"}
NAMES = ("R", "theta_c", "P")
# Room of the locations beyond the outermost elements (degree), and of the loads in typical ones: the priors of `infer`.
MARGIN_DEG, TYPICAL_LOADS = 20.0, 3.0
SAMPLES = 20
# Fingers that were not looked at while functions of place were written.
FIRST_SEED = 100
# Locations at which elements are on both sides, degree.
INSIDE_DEG = 60.0
# Of Poisson's ratio, and of the logarithm of the shear modulus: the tolerance of the stated rubber.
SD_POISSON, LOG_SD_MODULUS = 0.02, np.log(1.35)


@dataclass(frozen=True, eq=False)
class Read:
    """Touches read with one calibration, a row each; columns R (mm), θ_c (degree), P (N/m).

    Attributes
    ----------
    hit : (t, 3) bool array
        Whether the 90 % interval holds the truth.
    error, z : (t, 3) arrays
        Mean minus truth; the same in units of the stated standard deviation.
    firm : (t,) bool array
        Touches between the outermost elements with more than half the typical load.
    placed : (t,) bool array
        Whether functions of place were chosen.
    """

    hit: np.ndarray
    error: np.ndarray
    z: np.ndarray
    firm: np.ndarray
    placed: np.ndarray


def one_finger(touches: int, job: tuple[str, str, int]) -> dict[str, Read]:
    """Build, calibrate, touch and read a finger, in each way."""
    rubber, condition, seed = job
    modulus, radius = RUBBERS[rubber]
    design = paper_design(shear_modulus_MPa=modulus, sensing_radius_mm=radius, touch_radii_mm=(3.9,))
    rng = np.random.default_rng([3, seed])
    nominal = bayestouch.simulate(design, seed=seed).dataset.sensor
    built = replace(
        design,
        poisson_ratio=float(np.clip(0.46 + SD_POISSON * rng.standard_normal(), 0.40, 0.495)),
        shear_modulus_MPa=modulus * float(np.exp(LOG_SD_MODULUS * rng.standard_normal())),
    )
    simulated = bayestouch.simulate(built, seed=seed)
    largest = TYPICAL_LOADS * float(np.mean(simulated.truth["calibration"]["P"]))
    finger = MissedFinger.of(true_chain(simulated, largest), CONDITIONS[condition], seed)
    dataset = replace(finger.calibrating(simulated), sensor=nominal)
    edge = MARGIN_DEG + np.degrees(finger.chain.angle.max())
    truth = np.stack(
        [
            rng.uniform(0, finger.chain.outer_radius_mm, touches),
            rng.uniform(-edge, edge, touches),
            rng.uniform(0, largest, touches),
        ],
        axis=1,
    )
    table = touched(finger, truth, simulated, rng)
    return {
        way: read(table, bayestouch.calibrate(dataset, discrepancy=discrepancy, draws=400, seed=seed), truth)
        for way, discrepancy in WAYS.items()
    }


def touched(
    finger: MissedFinger, truth: np.ndarray, simulated: bayestouch.SimulatedDataSet, rng: np.random.Generator
) -> Touches:
    """Readings of the finger as it was built."""
    clean = finger.predict(truth[:, 0], np.radians(truth[:, 1]), truth[:, 2])
    touch = np.repeat(np.arange(len(clean)), SAMPLES)
    sd = np.asarray(simulated.truth["tactile_sd"], dtype=float)
    readings = clean[touch] + sd * rng.standard_normal((len(touch), clean.shape[1]))
    load = truth[touch, 2] + float(simulated.truth["force_sd"]) * rng.standard_normal(len(touch))
    return touches_from(touch, readings, load=load, contact=1.0)


def read(table: Touches, calibration: Calibration, truth: np.ndarray) -> Read:
    """Read touches, and hold them against what was done."""
    found = bayestouch.infer(table, calibration, check_sensor=False)
    columns = []
    for name, true in zip(NAMES, truth.T, strict=True):
        low, high = found.interval(name, 0.9)
        error = found.mean(name) - true
        columns.append(((low <= true) & (true <= high), error, error / found.sd(name)))
    hit, error, z = (np.stack(each, axis=1) for each in zip(*columns, strict=True))
    firm = (np.abs(truth[:, 1]) < INSIDE_DEG) & (truth[:, 2] > 0.5 * float(calibration.settings["typical_load"]))
    return Read(hit, error, z, firm, np.full(len(truth), "place_functions" in calibration.extra))


def main(
    fingers: int = 5, touches: int = 100, scheduler: str | None = None, processes: int = 1
) -> dict[tuple[str, str, str], Read]:
    """Print coverage, rms of z and errors; returns what was read, by rubber, condition and way."""
    cases = [(rubber, condition) for rubber in RUBBERS for condition in CONDITIONS]
    jobs = [(*case, FIRST_SEED + i) for case in cases for i in range(fingers)]
    done: dict[int, dict[str, Read]] = {}
    found = {}
    print(f"{fingers} fingers with {touches} touches each")
    for job, result in finished(one_finger, touches, jobs, processes=processes, scheduler=scheduler):
        done[job] = result
        number = job // fingers
        part = [done.get(number * fingers + seed) for seed in range(fingers)]
        if None in part:
            continue
        for way in WAYS:
            reads = [each[way] for each in part if each is not None]
            together = Read(
                *(
                    np.concatenate([getattr(one, name) for one in reads])
                    for name in ("hit", "error", "z", "firm", "placed")
                )
            )
            found[(*cases[number], way)] = together
            print(" | ".join([*cases[number], way, *summary(together, fingers)]), flush=True)
    return found


def summary(each: Read, fingers: int) -> list[str]:
    """Coverage with its standard error, rms of z and of errors, of R, θ_c and P; how many fingers had functions."""
    by_finger = each.hit.reshape(fingers, -1, len(NAMES)).mean(axis=1)
    se = by_finger.std(axis=0, ddof=1) / np.sqrt(fingers)
    coverage = [f"{100 * share:.1f} ± {100 * more:.1f}" for share, more in zip(each.hit.mean(axis=0), se, strict=True)]
    z, error = (np.sqrt((values[each.firm] ** 2).mean(axis=0)) for values in (each.z, each.error))
    chosen = each.placed.reshape(fingers, -1)[:, 0].sum()
    return [*coverage, *(f"{value:.2f}" for value in z), *(f"{value:.3g}" for value in error), f"{chosen}"]


def as_markdown(found: dict[tuple[str, str, str], Read], fingers: int) -> str:
    """Table of docs/statistics.md."""
    touches = len(next(iter(found.values())).hit) // fingers
    head = [
        "rubber",
        "the model misses",
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
        "placed",
    ]
    table = markdown_table(head, [[*key, *summary(each, fingers)] for key, each in found.items()])
    return (
        f"{fingers} fingers with {touches} touches each: coverage of 90 % intervals (%, with standard errors from the "
        "scatter of fingers); of touches on the elements with more than half the typical load the rms of error over "
        "stated standard deviation and the rms error; and fingers whose discrepancy was chosen to have functions of "
        f"place.\n\n{table}"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("fingers", type=int, nargs="?", default=5)
    parser.add_argument("touches", type=int, nargs="?", default=100)
    parser.add_argument("--processes", type=int, default=1, help="of this machine")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="Dask cluster that does the work")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/statistics.md")
    options = parser.parse_args()
    results = main(options.fingers, options.touches, options.scheduler, options.processes)
    if options.docs:
        put_into_page("coverage_of_places.py", as_markdown(results, options.fingers), STATISTICS)
