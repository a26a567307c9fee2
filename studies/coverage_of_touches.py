"""Coverage of 90 % intervals of touches that are read with a calibration that was itself inferred.

Fingers are built at random and calibrated with touches as noisy as any; then other touches, drawn from the priors of R,
θ_c and P, are simulated with the finger as it was built and read with the calibration: its uncertainty propagated,
and plugged in. One noisy sample a touch hides the calibration's error, averages of twenty bring it out. The simulated
finger follows the model exactly, which no calibration knows: that the default prior leaves room for what the model
misses makes intervals of averages a little too wide here. A third way, told that nothing is missed, shows by how much.

    python studies/coverage_of_touches.py [fingers] [touches a finger] [--scheduler ADDRESS]
    python studies/coverage_of_touches.py --docs                    writes the table of docs/statistics.md
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
from dataclasses import replace

import numpy as np
from _page import STATISTICS, markdown_table, put_into_page
from _shared_out import finished
from _simulated import true_chain

import bayestouch
from bayestouch.chain.finger import FingerChain
from bayestouch.data.touches import Touches, touches_from
from bayestouch.priors.parameters import LogNormal, Prior
from bayestouch.results.objects import Calibration
from bayestouch.simulation import FingerDesign

DESIGN = FingerDesign(samples_per_touch=2, edge_step_deg=4.0, flat_step_deg=12.0, touch_radii_mm=(3.9,))
SAMPLES = (1, 20)
NAMES = ("R", "theta_c", "P")
WAYS = PROPAGATED, PLUGGED_IN, EXACT = "propagated", "plugged in", "propagated, no model error"
NOTHING_MISSED: dict[str, Prior] = {"discrepancy_sd": LogNormal(1e-3, 0.1)}
# Room of the locations beyond the outermost elements (degree), and of the loads in typical ones: the priors of `infer`.
MARGIN_DEG, TYPICAL_LOADS = 20.0, 3.0

# By samples a touch, then way of reading, then quantity: whether the interval holds the truth, one entry a touch.
Hits = dict[int, dict[str, dict[str, np.ndarray]]]


def coverage(fingers: int, touches: int, scheduler: str | None = None) -> Hits:
    """Whether 90 % intervals hold the truth, for all touches of all fingers."""
    found = dict(finished(one_finger, touches, range(fingers), scheduler=scheduler))
    parts = [found[seed] for seed in range(fingers)]
    return {
        samples: {
            way: {name: np.concatenate([part[samples][way][name] for part in parts]) for name in NAMES} for way in WAYS
        }
        for samples in SAMPLES
    }


def one_finger(touches: int, seed: int) -> Hits:
    """Build, calibrate, touch and read a finger."""
    # the rubber of each is another, within the stated tolerance, which is the prior of the calibration
    rng = np.random.default_rng([1, seed])
    nominal = bayestouch.simulate(DESIGN, seed=seed).dataset.sensor
    ratio = float(np.clip(0.46 + 0.02 * rng.standard_normal(), 0.40, 0.495))
    modulus = 0.15 * float(np.exp(np.log(1.35) * rng.standard_normal()))
    simulated = bayestouch.simulate(replace(DESIGN, poisson_ratio=ratio, shear_modulus_MPa=modulus), seed=seed)
    dataset = replace(simulated.dataset, sensor=nominal)
    calibration = bayestouch.calibrate(dataset, draws=400, seed=seed)
    exact = bayestouch.calibrate(dataset, priors=NOTHING_MISSED, draws=400, seed=seed)
    largest = TYPICAL_LOADS * float(calibration.settings["typical_load"])
    chain = true_chain(simulated, largest)
    edge = np.radians(MARGIN_DEG)
    truth = {
        "R": rng.uniform(0, chain.outer_radius_mm, touches),
        "theta_c": np.degrees(rng.uniform(chain.angle.min() - edge, chain.angle.max() + edge, touches)),
        "P": rng.uniform(0, largest, touches),
    }
    noise_sd = np.asarray(simulated.truth["tactile_sd"], dtype=float)
    hits: Hits = {}
    for samples in SAMPLES:
        table = touched(chain, truth, samples, noise_sd, float(simulated.truth["force_sd"]), rng)
        hits[samples] = {
            PROPAGATED: inside(table, calibration, truth, plug_in=False),
            PLUGGED_IN: inside(table, calibration, truth, plug_in=True),
            EXACT: inside(table, exact, truth, plug_in=False),
        }
    return hits


def touched(
    chain: FingerChain,
    truth: dict[str, np.ndarray],
    samples: int,
    noise_sd: np.ndarray,
    force_sd: float,
    rng: np.random.Generator,
) -> Touches:
    """Readings of the finger as it was built."""
    clean = chain.predict(truth["R"], np.radians(truth["theta_c"]), truth["P"])
    touch = np.repeat(np.arange(len(clean)), samples)
    readings = clean[touch] + noise_sd * rng.standard_normal((len(touch), clean.shape[1]))
    load = truth["P"][touch] + force_sd * rng.standard_normal(len(touch))
    return touches_from(touch, readings, load=load, contact=1.0)


def inside(
    table: Touches, calibration: Calibration, truth: dict[str, np.ndarray], *, plug_in: bool
) -> dict[str, np.ndarray]:
    """Whether the 90 % interval of each quantity holds the truth."""
    read = bayestouch.infer(table, calibration, plug_in=plug_in, check_sensor=False)
    out = {}
    for name in NAMES:
        low, high = read.interval(name, 0.9)
        out[name] = (low <= truth[name]) & (truth[name] <= high)
    return out


def main(fingers: int = 20, touches: int = 100, scheduler: str | None = None) -> Hits:
    """Print the coverage; returns the hits."""
    found = coverage(fingers, touches, scheduler)
    print(f"Coverage of 90 % intervals, {fingers} fingers with {touches} touches each, %")
    print(f"{'samples a touch':18s}{'calibration':28s}" + "".join(f"{name:>10s}" for name in NAMES))
    for samples, ways in found.items():
        for way, hits in ways.items():
            shares = "".join(f"{100 * hits[name].mean():10.1f}" for name in NAMES)
            print(f"{samples:<18d}{way:28s}{shares}")
    largest = 100 * max(standard_error(hits, fingers) for hits in found[20][PROPAGATED].values())
    print(f"standard error by fingers: at most {largest:.1f} %")
    return found


def standard_error(hits: np.ndarray, fingers: int) -> float:
    """Standard error of a share of all touches, from the scatter of fingers: touches of one share its calibration."""
    return float(by_finger(hits, fingers).std(ddof=1) / np.sqrt(fingers))


def as_markdown(found: Hits, fingers: int) -> str:
    """Table of docs/statistics.md: share of intervals that hold the truth, with its standard error, %."""
    touches = len(found[1][PROPAGATED]["R"]) // fingers
    rows = [
        [
            str(samples),
            way,
            *(f"{100 * hits[name].mean():.1f} ± {100 * standard_error(hits[name], fingers):.1f}" for name in NAMES),
        ]
        for samples, ways in found.items()
        for way, hits in ways.items()
    ]
    table = markdown_table(["samples a touch", "calibration", "R", "θ_c", "P"], rows)
    return f"{fingers} fingers with {touches} touches each; standard errors from the scatter of fingers.\n\n{table}"


def by_finger(hits: np.ndarray, fingers: int) -> np.ndarray:
    """Share of each finger's touches, (fingers,)."""
    return hits.reshape(fingers, -1).mean(axis=1)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("fingers", type=int, nargs="?", default=20)
    parser.add_argument("touches", type=int, nargs="?", default=100)
    parser.add_argument("--scheduler", metavar="ADDRESS", help="Dask cluster that does the work")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/statistics.md")
    options = parser.parse_args()
    hits = main(options.fingers, options.touches, options.scheduler)
    if options.docs:
        put_into_page("coverage_of_touches.py", as_markdown(hits, options.fingers), STATISTICS)
