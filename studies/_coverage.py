"""Fingers of two rubbers, touches of them, and how well 90 % intervals of these touches hold the truth."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from _page import markdown_table
from _shared_out import finished
from _simulated import true_chain
from nicolson_fearing.paper_design import SHEAR_MODULUS, paper_design

import bayestouch
from bayestouch.chain.finger import FingerChain
from bayestouch.data.sensor import Sensor
from bayestouch.data.touches import Touches
from bayestouch.results.objects import Calibration

Case = TypeVar("Case", bound=tuple[str, ...])

RUBBERS = {
    f"{SHEAR_MODULUS:g} MPa, elements at 10.3 mm": (SHEAR_MODULUS, 10.3),
    "0.15 MPa, elements at 9.9 mm": (0.15, 9.9),
}
NAMES = ("R", "theta_c", "P")
# Room of the locations beyond the outermost elements (degree), and of the loads in typical ones: the priors of `infer`.
MARGIN_DEG, TYPICAL_LOADS = 20.0, 3.0
SAMPLES = 20
# Locations at which elements are on both sides, degree.
INSIDE_DEG = 60.0
# Of Poisson's ratio, and of the logarithm of the shear modulus: the tolerance of the stated rubber.
SD_POISSON, LOG_SD_MODULUS = 0.02, np.log(1.35)


@dataclass(frozen=True, eq=False)
class BuiltFinger:
    """A finger whose rubber is another than its description says.

    Attributes
    ----------
    sensor : Sensor
        Its description.
    simulated : SimulatedDataSet
        Its touches, without what a study adds.
    chain : FingerChain
        The finger as it was built.
    largest : float
        Largest load of touches that are read, N/m.
    """

    sensor: Sensor
    simulated: bayestouch.SimulatedDataSet
    chain: FingerChain
    largest: float

    @classmethod
    def of(cls, rubber: str, seed: int, rng: np.random.Generator, **design: object) -> BuiltFinger:
        """Build a finger of a rubber, touched as `design` says."""
        modulus, radius = RUBBERS[rubber]
        nominal = paper_design(shear_modulus_MPa=modulus, sensing_radius_mm=radius, **design)
        built = replace(
            nominal,
            poisson_ratio=float(np.clip(0.46 + SD_POISSON * rng.standard_normal(), 0.40, 0.495)),
            shear_modulus_MPa=modulus * float(np.exp(LOG_SD_MODULUS * rng.standard_normal())),
        )
        simulated = bayestouch.simulate(built, seed=seed)
        largest = TYPICAL_LOADS * float(np.mean(simulated.truth["calibration"]["P"]))
        sensor = bayestouch.simulate(nominal, seed=seed).dataset.sensor
        return cls(sensor, simulated, true_chain(simulated, largest), largest)

    def drawn_touches(self, touches: int, rng: np.random.Generator) -> np.ndarray:
        """R (mm), θ_c (degree) and P (N/m) of touches, (t, 3), from the priors of `infer`."""
        edge = MARGIN_DEG + np.degrees(self.chain.angle.max())
        columns = (
            rng.uniform(0, self.chain.outer_radius_mm, touches),
            rng.uniform(-edge, edge, touches),
            rng.uniform(0, self.largest, touches),
        )
        return np.stack(columns, axis=1)

    def noisy(self, clean: np.ndarray, load: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Readings and loads as measured of samples, from those without noise."""
        sd = np.asarray(self.simulated.truth["tactile_sd"], dtype=float)
        readings = clean + sd * rng.standard_normal(clean.shape)
        return readings, load + float(self.simulated.truth["force_sd"]) * rng.standard_normal(len(load))


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
    """

    hit: np.ndarray
    error: np.ndarray
    z: np.ndarray
    firm: np.ndarray

    @classmethod
    def together(cls, reads: Sequence[Read]) -> Read:
        """The touches of several fingers."""
        return cls(*(np.concatenate([getattr(each, name) for each in reads]) for name in cls.__dataclass_fields__))

    def beside(self, other: Read, column: int) -> Read:
        """The touches with one more column: that of another reading of them."""
        more = (getattr(other, name)[:, [column]] for name in ("hit", "error", "z"))
        hit, error, z = (
            np.concatenate(pair, axis=1) for pair in zip((self.hit, self.error, self.z), more, strict=True)
        )
        return replace(self, hit=hit, error=error, z=z)

    def summary(self, fingers: int) -> list[str]:
        """Coverage (%) with its standard error, rms of z and of errors, of each quantity."""
        by_finger = self.hit.reshape(fingers, -1, self.hit.shape[1]).mean(axis=1)
        se = by_finger.std(axis=0, ddof=1) / np.sqrt(fingers)
        means = self.hit.mean(axis=0)
        coverage = [f"{100 * share:.1f} ± {100 * more:.1f}" for share, more in zip(means, se, strict=True)]
        z, error = (np.sqrt((values[self.firm] ** 2).mean(axis=0)) for values in (self.z, self.error))
        return [*coverage, *(f"{value:.2f}" for value in z), *(f"{value:.3g}" for value in error)]


def read(table: Touches, calibration: Calibration, truth: np.ndarray, *, use_load: bool = True) -> Read:
    """Read touches, and hold them against what was done."""
    found = bayestouch.infer(table, calibration, check_sensor=False, use_load=use_load)
    columns = []
    for name, true in zip(NAMES, truth.T, strict=True):
        low, high = found.interval(name, 0.9)
        error = found.mean(name) - true
        columns.append(((low <= true) & (true <= high), error, error / found.sd(name)))
    hit, error, z = (np.stack(each, axis=1) for each in zip(*columns, strict=True))
    firm = (np.abs(truth[:, 1]) < INSIDE_DEG) & (truth[:, 2] > 0.5 * float(calibration.settings["typical_load"]))
    return Read(hit, error, z, firm)


def coverage_table(head: Sequence[str], rows: Sequence[Sequence[str]], last: str, fingers: int, touches: int) -> str:
    """Table of docs/statistics.md; `last` says what its last column holds."""
    return (
        f"{fingers} fingers with {touches} touches each. Columns R, θ_c, P: coverage of 90 % intervals, %, with "
        "standard errors from the scatter of fingers. Columns z: rms of the error over its stated standard deviation. "
        "Columns with a unit: rms error. Both are of touches on the elements, with more than half the typical load. "
        f"Last column: {last}.\n\n{markdown_table(head, rows)}"
    )


def by_case(
    one_sensor: Callable[[int, Any], Any],
    touches: int,
    cases: Sequence[Case],
    seeds: Sequence[int],
    **shared_out: Any,
) -> Iterator[tuple[Case, list[Any]]]:
    """Each case with the results of its sensors, as soon as it is complete; `shared_out` as `finished` takes it.

    `one_sensor` is given the number of touches, and the entries of the case with the seed behind them.
    """
    of_jobs = [(case, seed) for case in cases for seed in seeds]
    done: dict[Case, dict[int, Any]] = {case: {} for case in cases}
    jobs = [(*case, seed) for case, seed in of_jobs]
    for job, result in finished(one_sensor, touches, jobs, **shared_out):
        case, seed = of_jobs[job]
        done[case][seed] = result
        if len(done[case]) == len(seeds):
            yield case, [done[case][each] for each in seeds]


def coverage_options(description: str | None, first_seed: int, sensors: str = "fingers") -> argparse.ArgumentParser:
    """Options of a study of coverage; `sensors` is the name of the first one, a number of them."""
    parser = argparse.ArgumentParser(description=(description or "").split("\n")[0])
    parser.add_argument(sensors, type=int, nargs="?", default=5)
    parser.add_argument("touches", type=int, nargs="?", default=100)
    parser.add_argument("--processes", type=int, default=1, help="of this machine")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="Dask cluster that does the work")
    parser.add_argument("--first-seed", type=int, default=first_seed, help=f"of the {sensors}")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/statistics.md")
    return parser
