"""Are the probabilities of causes right on fresh fingers? 1,000 of them, with the forms of the five blind studies.

Forms, unlisted causes and fingers are those of `studies/blind_study.py`, which were new to the code that they examined.
The code of today was changed after it: the forms are known, the fingers (seeds 123000 and on) are not. Each finger has
nothing, one effect, two or an unlisted cause, as often as in the third study; form, size, rubber and order are drawn.
A warm column, which was in no catalogue when it was written, counts as the effect that describes it since: an angle
error of the prober that changes with time.

The probabilities allow for causes that imitate others (`bayestouch.diagnosis.imitations`), with shares that were
counted on the fingers of the blind studies. Which shares there are was chosen on 1,200 other fingers of this kind
(seeds 120000 and on), which are the development set: `development.jsonl`. That, and the rule which sets of causes are
right (`_cause_rules`), was written down and committed before any of the 1,000 was run. The aim is an expected
calibration error of at most 0.05.

    python studies/causes_of_forms.py [-o RESULTS] [--processes 2] [--cases N]   runs what was not run yet
    python studies/causes_of_forms.py [-o RESULTS] --tables                      runs nothing
    python studies/causes_of_forms.py [-o RESULTS] --docs                        writes tables and diagram of the page
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

from _cause_figure import save_diagram  # noqa: E402
from _cause_rules import stated, tables  # noqa: E402
from _error_rate_versions import code_version, the_version, version_of  # noqa: E402
from _page import DOCS, put_into_page  # noqa: E402
from _result_lines import kept_lines  # noqa: E402
from _shared_out import finished_on_file  # noqa: E402
from blind_study import BLIND_STUDIES, CONDITIONS, EFFECTS, Case  # noqa: E402
from imitations import again, recorded  # noqa: E402
from independent.blind_fingers import design, simulate  # noqa: E402
from independent.dataset import write  # noqa: E402
from independent.sizes import OutOfReach  # noqa: E402

import bayestouch  # noqa: E402
from bayestouch.diagnosis.causes import causes  # noqa: E402
from bayestouch.diagnosis.imitations import SHARES, best_effect  # noqa: E402

Record = dict[str, Any]
FIRST_SEED, FINGERS = 123_000, 1_000
#: Share of the fingers of each kind, as in the third study.
KINDS = {"none": 0.144, "one": 0.504, "pair": 0.192, "unlisted": 0.160}
SIZES = {"one": (1.0, 2.0, 5.0), "pair": (2.0,), "unlisted": (2.0, 5.0)}
#: Unlisted causes that an effect of the catalogue describes since, by its docstring.
DESCRIBED = {"warm_column": "prober_eccentricity"}
# Sets of causes below this probability are not kept; their sum is far below the errors that are looked for.
KEPT = 1e-3
RESULTS = DOCS / "results" / "causes_of_forms" / "results.jsonl"
DEVELOPMENT = RESULTS.with_name("development.jsonl")
DIAGRAM = DOCS / "figures" / "causes_of_forms.png"
FIGURE = """
```{figure} figures/causes_of_forms.png
:alt: Share of fingers whose most probable statement of causes is right against its probability; below, their numbers

How often the most probable statement of causes is right, on fresh fingers of known forms.
```
"""


def planned() -> list[Case]:
    """All fingers, in the order of their seeds."""
    registries = [study.registry for study in BLIND_STUDIES.values()]
    listed = [form.key for each in registries for form in each.LISTED]
    unlisted = [cause.key for each in registries for cause in each.UNLISTED]
    out = []
    for seed in range(FIRST_SEED, FIRST_SEED + FINGERS):
        rng = np.random.default_rng(seed)
        kind = str(rng.choice(list(KINDS), p=list(KINDS.values())))
        count, forms = {"none": 0, "pair": 2}.get(kind, 1), unlisted if kind == "unlisted" else listed
        keys = list[str]()
        while len(keys) < count:
            key = str(rng.choice(forms))
            if EFFECTS[key].name not in {EFFECTS[each].name for each in keys}:
                keys.append(key)
        rubber, order = CONDITIONS[rng.integers(len(CONDITIONS))]
        out.append(Case(kind, tuple((key, float(rng.choice(SIZES[kind]))) for key in keys), rubber, order, seed))
    return out


def known(case: Case) -> Record:
    """Kind of a finger, and the names of what was simulated, as the catalogue of today has them."""
    names = [DESCRIBED.get(name, name) for name in case.names]
    return {"kind": case.kind if names == case.names else "one", "truth": names}


def run(version: str, case: Case) -> Record:
    """Simulate and diagnose one finger: probabilities of causes, and as if one of the fitted sets were right."""
    record: Record = {**asdict(case), "key": case.key, **known(case), "version": version}
    began = time.process_time()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "finger"
        try:
            wanted = [(EFFECTS[key], size) for key, size in case.effects]
            write(simulate(design(case.design, case.rubber), case.order, wanted, case.seed), folder)
        except OutOfReach as reason:
            return {**record, "out_of_reach": str(reason)}
        except Exception as error:  # a study of many runs counts failures, it does not stop at one
            return {**record, "not_simulated": f"{type(error).__name__}: {error}".replace(str(folder), "")}
        try:
            found = bayestouch.diagnose(bayestouch.load_dataset(folder), sample=False, draws=64, seed=0)
        except Exception as error:  # the same
            return {**record, "error": f"{type(error).__name__}: {error}".replace(str(folder), "")}
    said = [each for each in found.to_dict()["causes"] if each["probability"] > KEPT]
    as_fitted = causes(found.traced.rounds)
    return {
        **record,
        "verdict": found.verdict,
        "stated": stated(found.effects, found.verdict),
        "not_distinguishable": found.to_dict()["not_distinguishable"],
        "causes": said,
        "fitted": [asdict(each) for each in as_fitted if each.probability > KEPT],
        "best": best_effect(as_fitted),
        "processor_s": time.process_time() - began,
    }


def allowed(record: Record) -> Record:
    """A result of development with the probabilities of causes that the package gives.

    Which causes were not distinguishable was not kept: a cause that was not named counts as passed over.
    """
    fitted = {**record, "causes": record["fitted"]}
    return again({**fitted, "best": best_effect(recorded(fitted))}, SHARES)


def kept(path: Path) -> list[Record]:
    """Results in a file, with probabilities of causes."""
    return [allowed(each) if "fitted" in each and "causes" not in each else each for each in kept_lines(path)]


def summary(results: Sequence[Record]) -> str:
    """Tables of all diagnoses that ended."""
    unable = {word: sum(word in each for each in results) for word in ("error", "out_of_reach", "not_simulated")}
    done = [each for each in results if "causes" in each]
    text = f"{len(done)} fingers. Version of the code: `{the_version(list(results))}`. Diagnoses that failed: "
    text += f"{unable['error']}; out of reach of the size: {unable['out_of_reach']}; not simulated: "
    text += f"{unable['not_simulated']}.\n\n"
    return text + (tables(done) if done else "")


def main(arguments: list[str] | None = None) -> list[Record]:
    """Run what is not in the file of results yet, and print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("-o", "--results", type=Path, default=RESULTS, help="a line a finger")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--cases", type=int, metavar="N", help="end after N new cases")
    parser.add_argument("--tables", action="store_true", help="run nothing: print the tables")
    parser.add_argument("--docs", action="store_true", help="run nothing: write tables and diagram of the page")
    given = parser.parse_args(arguments)
    results = kept(given.results)
    if not (given.tables or given.docs):
        version = code_version()
        if other := {version_of(each) for each in results} - {version}:
            parser.exit(2, f"{parser.prog}: {given.results} holds results of {other.pop()}, this is {version}\n")
        done = {each["key"] for each in results}
        left = [case for case in planned() if case.key not in done][: given.cases]
        results += finished_on_file(given.results, run, version, left, processes=given.processes)
    if not results:
        parser.exit(2, f"{parser.prog}: no results in {given.results}\n")
    text = summary(results)
    print(text)
    if given.docs:
        text += FIGURE
        if given.results.resolve() != DEVELOPMENT:
            text += f"\nFingers of development, with the same shares:\n\n{summary(kept(DEVELOPMENT))}"
        put_into_page("causes_of_forms.py", text, DOCS / "diagnosis.md")
        save_diagram([each for each in results if "causes" in each], DIAGRAM)
    return results


if __name__ == "__main__":
    main()
