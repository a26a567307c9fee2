"""Are the probabilities of causes right? Small simulated fingers whose causes are known.

Fingers, effects and sizes are those of `studies/error_rates.py` (8 elements, a third of the touches): nothing, one
effect, two, or a cause that no catalogue has. The simulator is that of the tests, which shares no code with the
package. Fingers 0 to 9 are for looking; those of the published table were looked at by nobody before it was run.

A set of causes is right if it names the effects that were simulated and no others. Beside effects it may name something
in place: most of the simulator's forms are not those of the catalogue. A drift counts as named by "something in time".
Without a listed effect, "nothing" is right where there is none, and "something in place" or "something in time" where
the cause is in no catalogue. The present rule is the verdict with its effects, taken as a probability of 0.99;
"unattributed" counts as something in place.

    python studies/causes.py [-o RESULTS] [--development] [--fingers N] [--cases N]
    python studies/causes.py [-o RESULTS] --docs      writes the tables of docs/diagnosis.md

A run that was stopped goes on where it was, unless the code was changed. Its cases take turns among the fingers.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

from _error_rate_versions import code_version, newest, version_of  # noqa: E402
from _page import DOCS, markdown_table, put_into_page  # noqa: E402
from error_rates import DESIGNS, Case, cases  # noqa: E402
from independent.dataset import EFFECTS, UNLISTED, simulate, write  # noqa: E402
from independent.sizes import OutOfReach  # noqa: E402

import bayestouch  # noqa: E402
from bayestouch.diagnosis.causes import IN_TIME, NOTHING  # noqa: E402
from bayestouch.diagnosis.place_or_time import IN_PLACE  # noqa: E402

# Fingers for looking, and the first of those that nobody looked at.
DEVELOPMENT, FRESH = range(10), 7200
DRIFTS = {"baseline_drift", "gain_drift"}
# Probabilities in a log score are within these: no study of this size knows more of rare failures.
LEAST, MOST = 0.01, 0.99
EDGES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)


def right(names: Sequence[str], truth: Sequence[str]) -> bool:
    """Whether a set of causes names what was simulated; `truth` holds effects, and may hold unlisted causes."""
    named, listed = set(names), {each for each in truth if each not in {one.name for one in UNLISTED}}
    if not truth:
        return named == {NOTHING}
    if not listed:
        return bool(named) and named <= {IN_PLACE, IN_TIME}
    drifts = {each for each in listed - named if each in DRIFTS}
    if IN_TIME in named and len(drifts) == 1:
        named = named - {IN_TIME} | drifts
    return named - {IN_PLACE} == listed


def stated(numbers: Mapping[str, Any]) -> list[str]:
    """Causes by the verdict and its effects."""
    effects = [each["name"] for each in numbers["effects"]]
    return effects or [NOTHING if numbers["verdict"] == "adequate" else IN_PLACE]


def run(case: Case) -> dict[str, Any]:
    """Simulate and diagnose one finger."""
    record: dict[str, Any] = {**asdict(case), "key": case.key, "truth": case.names, "version": code_version()}
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        try:
            wanted = [(EFFECTS[key], size) for key, size in case.effects]
            simulated = simulate(DESIGNS[case.design], wanted, case.seed, case.noise)
        except OutOfReach:
            return {**record, "out_of_reach": True}
        dataset = bayestouch.load_dataset(write(simulated, Path(folder) / "finger"))
        try:
            numbers = bayestouch.diagnose(dataset, sample=False, draws=64, seed=0).numbers
        except Exception as error:  # a study of many runs counts failures, it does not stop at one
            return {**record, "error": f"{type(error).__name__}: {error}"}
    found = {"causes": numbers["causes"], "verdict": numbers["verdict"], "stated": stated(numbers)}
    return {**record, **found, "processor_s": time.process_time() - began}


def forecasts(results: Sequence[Mapping[str, Any]]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of each finger: probability of the first set, whether it is right, probability of all right sets, the rule's."""
    first = [each["causes"][0] for each in results]
    hit = [right(one["names"], each["truth"]) for one, each in zip(first, results, strict=True)]
    total = [sum(c["probability"] for c in each["causes"] if right(c["names"], each["truth"])) for each in results]
    rule = [MOST if right(each["stated"], each["truth"]) else 1 - MOST for each in results]
    return np.array([one["probability"] for one in first]), np.array(hit), np.array(total), np.array(rule)


def tables(results: Sequence[Mapping[str, Any]]) -> str:
    """Reliability of the first set of causes, and both log scores, by kind of finger."""
    sure, hit, _, _ = forecasts(results)
    rows = []
    for low, high in pairwise(EDGES):
        inside = (sure > low) & (sure <= high)
        if inside.any():
            share = f"{100 * hit[inside].mean():.0f}"
            rows.append([f"{low:g} to {high:g}", str(inside.sum()), f"{100 * sure[inside].mean():.0f}", share])
    first = markdown_table(("probability of the first set", "fingers", "mean probability, %", "right, %"), rows)
    by_kind = []
    for kind in ("none", "one", "pair", "unlisted", "all"):
        some = [each for each in results if kind in (each["kind"], "all")]
        if some:
            sure, hit, total, rule = forecasts(some)
            score, other = (float(np.log(np.clip(each, LEAST, MOST)).mean()) for each in (total, rule))
            shares = (f"{100 * sure.mean():.0f}", f"{100 * hit.mean():.0f}", f"{100 * (rule > 0.5).mean():.0f}")
            by_kind.append([KINDS[kind], str(len(some)), *shares, f"{score:.2f}", f"{other:.2f}"])
    head = ("simulated", "fingers", "mean probability of the first set, %", "right, %", "verdict right, %")
    second = markdown_table((*head, "log score", "log score of the verdict"), by_kind)
    return f"{first}\nExpected calibration error {calibration_error(results):.3f}.\n\n{second}"


def calibration_error(results: Sequence[Mapping[str, Any]]) -> float:
    """Mean over fingers of the difference between probability and share right, in the bins of the table."""
    sure, hit, _, _ = forecasts(results)
    inside = np.digitize(sure, EDGES[1:-1], right=True)
    return float(sum(abs((hit - sure)[inside == k].sum()) for k in np.unique(inside)) / len(sure))


KINDS = {"none": "nothing", "one": "one effect", "pair": "two effects", "unlisted": "an unlisted cause", "all": "all"}


def main() -> None:
    """Run what is not in the file of results yet, and print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("-o", "--results", type=Path, default=Path("causes.jsonl"), help="a line a finger")
    parser.add_argument("--development", action="store_true", help="fingers for looking")
    parser.add_argument("--fingers", type=int, default=10, help="number of fingers, each with some 100 cases")
    parser.add_argument("--cases", type=int, metavar="N", help="end after N new cases")
    parser.add_argument("--docs", action="store_true", help="write the tables of docs/diagnosis.md from the results")
    given = parser.parse_args()
    results = [json.loads(line) for line in given.results.read_text().splitlines()] if given.results.exists() else []
    if not given.docs:
        first = DEVELOPMENT.start if given.development else FRESH
        by_finger = [cases(range(each, each + 1), "small") for each in range(first, first + given.fingers)]
        done = {each["key"] for each in results if version_of(each) == code_version()}
        left = [case for turn in zip(*by_finger, strict=True) for case in turn if case.key not in done]
        for case in left[: given.cases]:
            results.append(run(case))
            with given.results.open("a") as file:
                file.write(json.dumps(results[-1]) + "\n")
    latest = newest(results)
    text = tables([each for each in latest if "causes" in each])
    failed = sum("error" in each for each in latest)
    text += f"\nDiagnoses that failed: {failed}.\n"
    print(text)
    if given.docs:
        put_into_page("causes.py", text, DOCS / "diagnosis.md")


if __name__ == "__main__":
    main()
