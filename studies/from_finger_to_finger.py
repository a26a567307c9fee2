"""How many touches the sixth finger of a build is spared after five.

Six fingers are drawn from a population with known sds and touched by the independent simulator (`tests/independent`).
Five are calibrated with 45 touches each, the sixth with few: with default priors (alone), and with priors that are
learned from the five (like). Both calibrations then read touches with a round tip. Two builds: fingers of one batch of
rubber, and fingers of several. At last the sixth finger is not of the build: its σ, μ and depths are five sds from it.

    python studies/from_finger_to_finger.py [--small]
    python studies/from_finger_to_finger.py --docs          writes the tables of docs/statistics.md
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from _page import STATISTICS, docs_of, markdown_table, put_into_page

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from build_of_fingers import PITCH, Build, Built
from build_of_fingers import SAMPLES as SAMPLES_KNOWN

import bayestouch
from bayestouch.contact import composite_radius
from bayestouch.finger.learned_priors import learned_priors
from bayestouch.priors.parameters import Prior

BUILDS = {
    "one batch of rubber": Build(sigma_sd=0.0005, mu_sd=0.02, depth_sd=0.01, depth_within=0.05),
    "several batches": Build(sigma_sd=0.002, mu_sd=0.05, depth_sd=0.03, depth_within=0.06),
}
TOUCHES = 8, 15, 30, 60
EARLIER, OFF = 5, 5.0
# Tips (mm) that are read, how often, and samples a touch: their mean leaves the calibration as the larger error.
TIPS, PLACES, SAMPLES = (3.9, 7.55, 15.0), 4, 20
WAYS = "alone", "like"


@dataclass(frozen=True)
class Read:
    """Touches read with calibrations of n touches each: relative sds and errors of R, and z of σ, of all fingers."""

    sd: np.ndarray
    error: np.ndarray
    inside: np.ndarray
    z: np.ndarray
    sigma_sd: np.ndarray
    rhat: float

    @classmethod
    def joined(cls, parts: Sequence[Read]) -> Read:
        names = ("sd", "error", "inside", "z", "sigma_sd")
        return cls(*(np.concatenate([getattr(p, n) for p in parts]) for n in names), max(p.rhat for p in parts))

    @property
    def typical_sd(self) -> float:
        """Median sd of R, share of R."""
        return float(np.median(self.sd))


def learned(build: Build, rng: np.random.Generator) -> dict[str, Prior]:
    """Priors from five fingers."""
    datasets = [build.draw(rng).dataset(rng) for _ in range(EARLIER)]
    earlier = [(str(i), bayestouch.calibrate(each, draws=400, seed=i)) for i, each in enumerate(datasets)]
    return learned_priors(earlier, build.sensor, "layer", SAMPLES_KNOWN)[0]


def read(finger: Built, priors: dict[str, Prior] | None, n: int, seed: int) -> Read:
    """Calibrate with n touches and read others, the same whatever the priors and n."""
    dataset = finger.dataset(np.random.default_rng([seed, n]), n)
    calibration = bayestouch.calibrate(dataset, priors=priors, draws=400, seed=seed)
    rng = np.random.default_rng([seed, 0])
    tip = np.repeat(TIPS, PLACES)
    touches = finger.touched(rng, tip, rng.uniform(-PITCH, PITCH, len(tip)), SAMPLES)
    posteriors = bayestouch.infer(touches, calibration, check_sensor=False, seed=seed)
    truth = composite_radius(tip, finger.finger.body.outer)
    low, high = posteriors.interval("R")
    sigma = calibration.posterior["sigma"]
    return Read(
        posteriors.sd("R") / truth,
        posteriors.mean("R") / truth - 1,
        (low < truth) & (truth < high),
        np.atleast_1d((sigma.mean() - finger.finger.body.poisson) / sigma.std()),
        np.atleast_1d(sigma.std()),
        calibration.statistics["rhat"],
    )


Found = dict[tuple[str, int], Read]


def compare(build: Build, fingers: int, touches: Sequence[int], off: float = 0.0) -> Found:
    """By way and number of touches, over all sixth fingers."""
    parts: dict[tuple[str, int], list[Read]] = {(way, n): [] for way in WAYS for n in touches}
    for seed in range(fingers):
        rng = np.random.default_rng([seed, 16])
        priors = {"alone": None, "like": learned(build, rng)}
        sixth = build.draw(rng, off=off)
        for way, n in parts:
            parts[way, n].append(read(sixth, priors[way], n, seed))
    return {key: Read.joined(each) for key, each in parts.items()}


def needed(found: Found, n: int) -> float:
    """Touches that a finger alone needs for the sd of R which n touches give with the learned priors."""
    numbers = [each for way, each in found if way == "alone"]
    sds = [found["alone", each].typical_sd for each in numbers]
    # the sd of R decreases with the number of touches; equal ones by chance do not make it unknown
    falling = np.minimum.accumulate(sds)[::-1]
    return float(np.exp(np.interp(found["like", n].typical_sd, falling, np.log(numbers[::-1]))))


def table(found: Found) -> str:
    """One line for each number of touches."""
    head = (
        "touches",
        "sd of R, alone",
        "sd of R, like",
        "rms error, alone",
        "rms error, like",
        "in 90 %, alone",
        "in 90 %, like",
        "sd of σ, alone",
        "sd of σ, like",
        "rms z of σ, like",
        "touches alone for the same sd of R",
    )
    most = max(each for _, each in found)
    least = min(each.typical_sd for (way, _), each in found.items() if way == "alone")
    rows = []
    for n in [each for way, each in found if way == "alone"]:
        alone, like = (found[way, n] for way in WAYS)
        rows.append(
            [
                f"{n}",
                *(f"{100 * each.typical_sd:.2f} %" for each in (alone, like)),
                *(f"{100 * np.sqrt(np.mean(each.error**2)):.2f} %" for each in (alone, like)),
                *(f"{100 * each.inside.mean():.0f} %" for each in (alone, like)),
                *(f"{np.median(each.sigma_sd):.5f}" for each in (alone, like)),
                f"{np.sqrt(np.mean(like.z**2)):.2f}",
                f"more than {most}" if like.typical_sd < least else f"{needed(found, n):.0f}",
            ]
        )
    return markdown_table(head, rows)


def main(fingers: int, touches: Sequence[int]) -> dict[str, Found]:
    """Print and return what was found, by build, and last of fingers that are not of the build."""
    results: dict[str, Found] = {}
    for name, build in BUILDS.items():
        results[name] = compare(build, fingers, touches)
    results["not of the build"] = compare(BUILDS["one batch of rubber"], fingers, touches[:2], OFF)
    for name, found in results.items():
        print(f"{name}, {fingers} sixth fingers")
        print("largest R-hat:", *(f"{way} {n}: {each.rhat:.3f}" for (way, n), each in found.items()))
        print(table(found), flush=True)
    return results


def for_the_page(results: dict[str, Found], fingers: int) -> str:
    """The tables, as docs/statistics.md shows them."""
    parts = [
        f"**{name[0].upper()}{name[1:]}** ({fingers} sixth fingers)\n\n{table(found)}"
        for name, found in results.items()
    ]
    return "\n".join(parts)


if __name__ == "__main__":
    docs, arguments = docs_of(sys.argv[1:])
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--small", action="store_true", help="two fingers in place of five")
    parser.add_argument("--fingers", type=int, default=5)
    chosen = parser.parse_args(arguments)
    count = 2 if chosen.small else chosen.fingers
    everything = main(count, TOUCHES[:2] if chosen.small else TOUCHES)
    if docs:
        put_into_page("from_finger_to_finger.py", for_the_page(everything, count), STATISTICS)
