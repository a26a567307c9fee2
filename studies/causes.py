"""Are the probabilities of causes right? Small simulated fingers whose causes are known.

Fingers, effects and sizes are those of `studies/error_rates.py` (8 elements, a third of the touches): nothing, one
effect, two, or a cause that no catalogue has. The simulator is that of the tests, which shares no code with the
package. Fingers 0 to 9 were looked at in development; all others are fresh, each with 97 cases. `_cause_rules` says
which sets of causes are right.

    python studies/causes.py [-o RESULTS] [--first 10] [--fingers 13] [--processes 2] [--cases N]
        runs what this version of the code has not done yet; cases take turns among the fingers
    python studies/causes.py [-o RESULTS] --tables [--with FILE ...]
        runs nothing: tables of these results pooled with those of other files, such as results.jsonl of `blind_study`
    python studies/causes.py [-o RESULTS] --docs [--with FILE ...]
        writes tables and diagram of docs/diagnosis.md

Results of several versions of the code are not pooled: the command refuses, unless `--versions` names those that
belong together, which the tables then say.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

from _cause_figure import save_diagram  # noqa: E402
from _cause_rules import stated, tables  # noqa: E402
from _error_rate_versions import code_version, version_of  # noqa: E402
from _page import DOCS, put_into_page  # noqa: E402
from _result_lines import kept_lines  # noqa: E402
from _shared_out import finished_on_file  # noqa: E402
from error_rates import DESIGNS, Case, cases  # noqa: E402
from independent.dataset import EFFECTS, simulate, write  # noqa: E402
from independent.sizes import OutOfReach  # noqa: E402

import bayestouch  # noqa: E402

Record = dict[str, Any]
# The first finger that nobody looked at in development.
FRESH = 10
DIAGRAM = DOCS / "figures" / "causes.png"
FIGURE = """
```{figure} figures/causes.png
:alt: Share of fingers whose most probable statement of causes is right against its probability; below, their numbers

How often the most probable statement of causes is right, against its probability.
```
"""


def run(version: str, case: Case) -> Record:
    """Simulate and diagnose one finger."""
    record: Record = {**asdict(case), "key": case.key, "truth": case.names, "version": version, "study": "causes"}
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
    found = {"causes": numbers["causes"], "verdict": numbers["verdict"]}
    found["stated"] = stated([each["name"] for each in numbers["effects"]], numbers["verdict"])
    return {**record, **found, "processor_s": time.process_time() - began}


def with_statement(record: Record) -> Record:
    """A result of `causes`, `blind_study` or `error_rates` with truth, causes, and what the verdict states."""
    if "diagnosis" in record:  # of `error_rates`
        said = record["diagnosis"]
        record = {**record, "truth": record["names"], "causes": said["causes"], "verdict": said["verdict"]}
        record["effects_found"] = said["effects"]
    if "stated" in record or "causes" not in record:
        return record
    return {**record, "stated": stated([each["name"] for each in record["effects_found"]], record["verdict"])}


def of_versions(results: Sequence[Record], versions: Sequence[str]) -> list[Record]:
    """Results of these versions of the code; of one version alone if none is named.

    Raises
    ------
    ValueError
        There are several versions and none is named, or one that is named has no result.
    """
    present = Counter(map(version_of, results))
    if not versions and len(present) > 1:
        shown = ", ".join(f"{name} ({count})" for name, count in present.items())
        raise ValueError(f"results are of several versions of the code, name those that belong together: {shown}")
    if missing := set(versions) - set(present):
        raise ValueError(f"no results of version {', '.join(sorted(missing))}")
    return [each for each in results if not versions or version_of(each) in versions]


def unique(results: Sequence[Record]) -> list[Record]:
    """Of each case by each version the last result."""
    return list({(each["key"], version_of(each)): each for each in results}.values())


def summary(results: Sequence[Record]) -> str:
    """Tables of all results together, with versions, and how many fingers were fresh."""
    done = [each for each in results if each.get("causes")]
    failed = sum("error" in each for each in results)
    beyond = sum(bool({"out_of_reach", "not_simulated"} & each.keys()) for each in results)
    versions = ", ".join(f"`{name}`" for name in sorted({version_of(each) for each in results}))
    looked_at = sum(is_of_development(each) for each in done)
    counted = f"{len(done)} fingers, {looked_at} of them of the development set. Diagnoses that failed: {failed}; "
    head = f"{counted}out of reach of the size: {beyond}. Version of the code: {versions}."
    return f"{head}\n\n{tables(done)}" if done else f"{head}\n"


def is_of_development(record: Record) -> bool:
    """Whether it is one of the fingers on which the search was adjusted."""
    if "commit" in record:  # of `blind_study`
        return bool(record["commit"] == "development")
    kind, effects, seed, design = record["kind"], record["effects"], record["seed"], record["design"]
    return Case(kind, effects, seed, design).finger < FRESH


def planned(first: int, fingers: int) -> list[Case]:
    """Cases of these fingers, which take turns, so that a part of a run is a fair sample."""
    by_finger = [cases(range(each, each + 1), "small") for each in range(first, first + fingers)]
    return [case for turn in zip(*by_finger, strict=True) for case in turn]


def main(arguments: list[str] | None = None) -> list[Record]:
    """Run what is not in the file of results yet, and print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("-o", "--results", type=Path, default=Path("causes.jsonl"), help="a line a finger")
    parser.add_argument("--development", action="store_true", help="fingers from 0 on, for looking")
    parser.add_argument("--first", type=int, default=FRESH, metavar="N", help="number of the first finger")
    parser.add_argument("--fingers", type=int, default=13, help="number of fingers, each with 97 cases")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--cases", type=int, metavar="N", help="end after N new cases")
    parser.add_argument("--with", type=Path, nargs="+", default=[], dest="others", help="other files to pool")
    parser.add_argument("--versions", nargs="+", default=[], help="versions of the code that belong together")
    parser.add_argument("--tables", action="store_true", help="run nothing: print the tables")
    parser.add_argument("--docs", action="store_true", help="run nothing: write tables and diagram of the page")
    parser.add_argument("--diagram", type=Path, metavar="FILE", help="also save the diagram")
    given = parser.parse_args(arguments)
    results = kept_lines(given.results)
    if not (given.tables or given.docs):
        version = code_version()
        done = {each["key"] for each in results if version_of(each) == version}
        every = planned(0 if given.development else given.first, given.fingers)
        left = [case for case in every if case.key not in done][: given.cases]
        results += finished_on_file(given.results, run, version, left, processes=given.processes)
    for path in given.others:
        if not path.exists():
            parser.exit(2, f"{parser.prog}: no file {path}\n")
        results += kept_lines(path)
    try:
        pooled = [with_statement(each) for each in of_versions(unique(results), given.versions)]
    except ValueError as reason:
        parser.exit(2, f"{parser.prog}: {reason}\n")
    text = summary(pooled)
    print(text)
    some = [each for each in pooled if each.get("causes")]
    if given.diagram is not None and some:
        save_diagram(some, given.diagram)
    if given.docs:
        if not some:
            parser.exit(2, f"{parser.prog}: no results for the page\n")
        put_into_page("causes.py", text + FIGURE, DOCS / "diagnosis.md")
        save_diagram(some, DIAGRAM)
    return pooled


if __name__ == "__main__":
    main()
