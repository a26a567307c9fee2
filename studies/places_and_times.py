"""Errors that belong to a place, and errors that belong to a time: does the diagnosis say which?

Fingers of two rubbers get errors of their elements' E maps, 1 to 5 % of the peak and smooth over 8 degrees, or zeros
that wander, 1 to 3 % of the peak. Each is measured in the order of a scan, as the paper's finger was, and again with
the touches of both tables in random order. The same fingers without an error say how well R can be read. Seeds 7400 to
7409 were written down before any of them was run.

    python studies/places_and_times.py [-o RESULTS] [--development] [--only place|time|none] [--cases N] [--processes 2]
    python studies/places_and_times.py [-o RESULTS] --docs      writes the tables of docs/diagnosis.md

Results carry the version of the code; tables are of the version of the last result.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

from _error_rate_versions import code_version, newest, version_of  # noqa: E402
from _page import DOCS, put_into_page  # noqa: E402
from _place_time_tables import KINDS, ORDERS, tables  # noqa: E402
from _result_lines import kept_lines  # noqa: E402
from _shared_out import finished_on_file  # noqa: E402
from nicolson_fearing.paper_design import SHEAR_MODULUS, paper_design, with_map_errors  # noqa: E402

import bayestouch  # noqa: E402
from bayestouch.data.dataset import DataSet  # noqa: E402
from bayestouch.data.touches import Touches  # noqa: E402
from bayestouch.diagnosis.place_or_time import IN_PLACE  # noqa: E402
from bayestouch.diagnosis.search import search  # noqa: E402
from bayestouch.model.body import body_of  # noqa: E402
from bayestouch.model.split_data import SplitData  # noqa: E402
from bayestouch.simulation import FingerDesign, SimulatedDataSet  # noqa: E402

#: MPa and mm: the paper's finger, and a stiffer one with elements nearer to the core.
RUBBERS = {"soft": (SHEAR_MODULUS, 10.3), "stiff": (0.15, 9.9)}
# Percent of the peak, one finger after the other.
PLACE_PERCENT, TIME_PERCENT = (1.0, 2.0, 3.0, 4.0, 5.0), (1.0, 2.0, 3.0)
# Correlation time of a zero that wanders, over the whole measurement.
WANDERS = (1 / 4, 1 / 10)
DRIFTS = {"baseline_drift", "gain_drift"}
# Seeds for looking, and seeds of the published table, which were looked at by nobody before it was run.
DEVELOPMENT, FRESH = range(3), range(7400, 7410)


@dataclass(frozen=True)
class Case:
    """One finger, measured once."""

    kind: str
    rubber: str
    order: str
    seed: int

    @property
    def key(self) -> str:
        """Name under which its result is kept."""
        return json.dumps([self.kind, self.rubber, self.order, self.seed])

    @property
    def percent(self) -> float:
        """Size of the error, % of the peak."""
        if self.kind == "none":
            return 0.0
        sizes = PLACE_PERCENT if self.kind == "place" else TIME_PERCENT
        return sizes[self.seed % len(sizes)]

    def design(self) -> FingerDesign:
        """The finger and its touches."""
        modulus, radius = RUBBERS[self.rubber]
        return paper_design(
            shear_modulus_MPa=modulus,
            sensing_radius_mm=radius,
            touch_radii_mm=(1.59, 6.01, 12.3, 25.25),
            gain_spread=0.3,
            depth_spread_mm=0.2,
        )

    def data(self) -> DataSet:
        """What is measured."""
        simulated = bayestouch.simulate(self.design(), seed=self.seed)
        rng = np.random.default_rng([self.seed, 91])
        if self.kind == "none":
            return ordered(simulated.dataset, self.order, rng)
        if self.kind == "place":
            return ordered(with_map_errors(simulated, self.percent, self.seed), self.order, rng)
        return with_wandering_zeros(simulated, ordered(simulated.dataset, self.order, rng), self.percent, self.seed)


def ordered(dataset: DataSet, order: str, rng: np.random.Generator) -> DataSet:
    """The same touches, those of each table in another order if it is "random"."""
    if order == "scan":
        return dataset
    assert dataset.calibration is not None
    return replace(dataset, calibration=shuffled(dataset.calibration, rng), touches=shuffled(dataset.touches, rng))


def shuffled(table: Touches, rng: np.random.Generator) -> Touches:
    """Touches in random order at the same times; each has as many samples as any other."""
    slots = np.unique(table.touch)
    rows = np.concatenate([np.flatnonzero(table.touch == each) for each in rng.permutation(slots)])
    return table.select(rows).with_(touch=table.touch, time_s=table.time_s)


def with_wandering_zeros(simulated: SimulatedDataSet, dataset: DataSet, percent: float, seed: int) -> DataSet:
    """Add to every element a smooth random function of time, `percent` of its peak: cosines of random frequency."""
    assert dataset.calibration is not None
    rng, waves = np.random.default_rng([seed, 92]), 60
    peak = np.abs(np.asarray(simulated.truth["response"])) * simulated.dataset.calibration.load.mean()  # type: ignore[union-attr]
    length = dataset.touches.time_s.max() * WANDERS[seed % len(WANDERS)]
    frequency = rng.standard_normal((len(peak), waves)) / length
    phase = rng.uniform(0, 2 * np.pi, (len(peak), waves))

    def moved(table: Touches) -> Touches:
        course = np.cos(table.time_s[:, None, None] * frequency + phase).sum(axis=-1) * np.sqrt(2 / waves)
        return table.with_(readings=table.readings + percent / 100 * peak * course)

    return replace(dataset, calibration=moved(dataset.calibration), touches=moved(dataset.touches))


def said(numbers: Mapping[str, Any]) -> str:
    """What the diagnosis names: "drift", "place", "not distinguishable", "other" (another effect), or "nothing"."""
    if DRIFTS & {each["name"] for each in numbers["effects"]}:
        return "drift"
    if any(IN_PLACE in pair for pair in numbers["not_distinguishable"]):
        return "not distinguishable"
    if numbers["in_place"] is not None:
        return "place"
    return "other" if numbers["effects"] else "nothing"


def run(version: str, case: Case) -> dict[str, Any]:
    """Diagnose one finger."""
    record = {**asdict(case), "key": case.key, "percent": case.percent, "version": version}
    began = time.process_time()
    try:
        found = searched(case) if case.kind == "time" else diagnosed(case)
    except Exception as error:  # a study of many runs counts failures, it does not stop at one
        found = {"error": " ".join(f"{type(error).__name__}: {error}".split())}
    return {**record, **found, "processor_s": time.process_time() - began}


def diagnosed(case: Case) -> dict[str, Any]:
    """What a diagnosis says of a finger, and errors on held-out touches before and after, with standard errors."""
    numbers = bayestouch.diagnose(case.data(), draws=64, seed=case.seed).numbers
    parts = ("before", "after", "after_against_stated", "change_against_stated_se")
    return {
        "said": said(numbers),
        "verdict": numbers["verdict"],
        "effects": [each["name"] for each in numbers["effects"]],
        "in_place": numbers["in_place"],
        "place_or_time": [each["place_or_time"] for each in numbers["rounds"]],
        **{part: numbers[part] for part in parts},
    }


def searched(case: Case) -> dict[str, Any]:
    """What the search of a diagnosis finds; draws of drifts, which take minutes, would not change it."""
    data = case.data()
    body = body_of(data.sensor)
    begun = body.begin(SplitData.of(data), draws=8, seed=case.seed, **body.own({"contact": None, "kernel": None}))
    rounds = search(begun.fitted, begun.effects)
    effects = [each.added.effect.name for each in rounds if each.added is not None]
    undecided = any(each.undecided for each in rounds[-1].place_or_time)
    named = (
        "drift" if DRIFTS & {*effects} else "not distinguishable" if undecided else "other" if effects else "nothing"
    )
    return {
        "said": named,
        "effects": effects,
        "place_or_time": [[asdict(one) for one in each.place_or_time] for each in rounds],
    }


def cases(seeds: range, kinds: tuple[str, ...]) -> list[Case]:
    """All cases, rubber and order changing fastest, so that a part of a run is a fair sample.

    Fingers without an error are measured in both orders, too: which touches are held out depends on the order.
    """
    return [Case(k, r, o, s) for s in seeds for o in ORDERS for r in RUBBERS for k in kinds]


def main(arguments: list[str] | None = None) -> list[dict[str, Any]]:
    """Run what is not in the file of results yet, and print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("-o", "--results", type=Path, default=Path("places_and_times.jsonl"), help="a line a finger")
    parser.add_argument("--development", action="store_true", help="seeds for looking")
    parser.add_argument("--only", choices=KINDS)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--cases", type=int, metavar="N", help="end after N new fingers")
    parser.add_argument("--docs", action="store_true", help="write the tables of docs/diagnosis.md from the results")
    given = parser.parse_args(arguments)
    results = kept_lines(given.results)
    if not given.docs:
        version = code_version()
        seeds, kinds = DEVELOPMENT if given.development else FRESH, (given.only,) if given.only else KINDS
        done = {each["key"] for each in results if version_of(each) == version}
        left = [each for each in cases(seeds, kinds) if each.key not in done][: given.cases]
        results += finished_on_file(given.results, run, version, left, processes=given.processes)
    latest = newest(results)
    if not latest:
        parser.exit(2, f"{parser.prog}: {given.results} has no results\n")
    others = sum(version_of(each) != version_of(latest[0]) for each in results)
    text = f"Version of the code: `{version_of(latest[0])}`.\n\n{tables(latest)}"
    print(f"{text}\n{others} results of other versions are left out.")
    if given.docs:
        put_into_page("places_and_times.py", text, DOCS / "diagnosis.md")
    return latest


if __name__ == "__main__":
    main()
