"""The blind studies of the diagnosis: new forms, new causes, two rubbers, two orders. Each of the five is run once.

Forms and causes of the first are in `tests/independent/blind_forms.py`, those of the others in `second_forms.py`,
`third_forms.py`, `fourth_forms.py` and `fifth_forms.py` beside it; cases and rules are in this file, tables in
`studies/_blind_tables.py`. All of them were committed before the code that they examine was frozen. No form was adapted
to what the diagnosis can do, and no diagnosis of these forms was run before. Results are published whatever they are.

Cases, each with a finger of its own (seeds 88000 and on in the first study, 91000 and on in the second, 94000 and on in
the third, 97000 and on in the fourth, 103000 and on in the fifth):

- one: 2 forms of every effect at sizes 1, 2 and 5; each form sees both rubbers and both orders (third study: each form
  at each size; fourth study: each form once at each size, with rubbers and orders that change; fifth: each form once,
  at size 2);
- none: fingers on which nothing is missing, 25 for each rubber and order (second study: 15, third: 36, fourth: 10,
  fifth: 5);
- unlisted: 12 causes (from the second study on: 10) at sizes 2 and 5, for each rubber and order (third study: twice;
  fourth study: for two of them, which have both rubbers and both orders; fifth: for one of them);
- pair: 30 pairs of effects (from the second study on: 24 others), size 2 each, twice with other forms, rubbers or
  orders (third study: eight times; fifth: no pairs);
- whole, in the first study alone: 12 fingers as large as the practice fingers, counted apart from the others, which
  have 8 elements.

A size that no plausible value reaches is replaced by the next smaller one of `blind_fingers.LADDER`.

How results are counted, written down before any run:

- one: right if the effect is the first that is added. In a column of its own: or if it is declared indistinguishable
  from an effect that is added. The rate is that of sizes 1 and above. Aim 95 %.
- none: right if the verdict is "adequate". Aim 95 %.
- unlisted: right if no effect is added, and the verdict is "unattributed" or the diagnosis says "something smooth in
  place" (`in_place`). Aim 90 %.
- pair: right if both effects are added, in any order, where both have sizes of 1 and above. Aim 80 %.
- drift: a listed drift of size 1 and above, alone or in a pair, is found if it is among the effects. Aim 95 %.
- Failed diagnoses are wrong. Cases out of reach of all sizes are left out, and counted; so are cases that cannot be
  simulated, which are listed, too.
- Harm: 78 touches that no fit has seen (the exam) are read by `infer` with the calibrations before and after, and
  compared with what is true: R of the tip on a round finger, the place, and the load (read without the force sensor).
  R, θ_c or P is worse if the mean of squared errors is larger after by more than two standard errors. The standard
  error is that over the 13 places of the exam, since errors at one place belong together. A calibration that differs,
  but reads no better and no worse, would be listed by chance once in 30 readings. Aim 0. An exam that fails with an
  error is counted and listed apart; the diagnosis before it counts as it is.
- Causes: a set of causes is right as `studies/_cause_rules.py` counts it.

    python studies/blind_study.py -o FOLDER [--processes 2]   runs what is not in FOLDER/results.jsonl
        --study NAME    first, second, fourth or fifth, in place of the third
        --development   a handful of today's forms, with other seeds: to see that this runs; needs no tag
        --again         the fingers of 8 elements of a study that was run, with the code of today or, by PYTHONPATH,
                        with other code: for development
        --form TEXT     with --again: only those with this form, cause or pair
        --cases N       ends after N new cases
        --tables        runs nothing: prints the tables
        --docs          runs nothing: writes the tables of the page of the study in docs

A study refuses to run if its git tag does not exist, if a file that makes or counts the results differs from it, or if
another copy of the package is imported. The page is written only with the rules of counting of the tag.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import random
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

from _blind_pairs import FOURTH_PAIRS, PAIRS, SECOND_PAIRS, THIRD_PAIRS  # noqa: E402
from _blind_run import COUNTING, FrozenError, diagnosed, frozen_commit, named, require_own_package  # noqa: E402
from _blind_tables import NOT_RUN, tables  # noqa: E402
from _error_rate_versions import code_version, version_of  # noqa: E402
from _page import DOCS, put_into_page  # noqa: E402
from _result_lines import kept_lines  # noqa: E402
from _shared_out import finished_on_file  # noqa: E402
from independent import blind_forms, dataset, fifth_forms, fourth_forms, second_forms, third_forms  # noqa: E402
from independent.blind_fingers import design, simulate  # noqa: E402
from independent.dataset import write  # noqa: E402
from independent.effects import forms_of  # noqa: E402
from independent.sizes import OutOfReach  # noqa: E402

REGISTRIES = (dataset, blind_forms, second_forms, third_forms, fourth_forms, fifth_forms)
EFFECTS = {key: effect for each in REGISTRIES for key, effect in each.EFFECTS.items()}
#: Rubber and order of touches. Any three that follow each other have both rubbers and both orders.
CONDITIONS = (("soft", "scan"), ("stiff", "random"), ("soft", "random"), ("stiff", "scan"))
SIZES, UNLISTED_SIZES, PAIR_SIZE = (1.0, 2.0, 5.0), (2.0, 5.0), 2.0
#: First seed of the fingers that try the runner.
DEVELOPMENT = 86_000
#: Whole fingers: effects by key with their size; of each there are two, under conditions that follow each other.
WHOLE = (
    (),
    (("crosstalk: ribbon", 2.0),),
    (("baseline_drift: flicker", 2.0),),
    (("soft_spot: patch", 2.0),),
    (("grain: ", 2.0),),
    (("seats_of_tips: ", 2.0),),
)


@dataclass(frozen=True)
class Study:
    """What one of the studies has of its own.

    `name` is that of its page and of its folder, `tag` that of the commit at which it runs, and `registry` the module
    of its forms and causes. `plain` counts the fingers of each rubber and order on which nothing is missing, `of_form`
    those of each form and size, `of_cause` those of each unlisted cause and size, `of_pair` those of each pair.
    `sizes` are those of a single effect.
    """

    name: str
    tag: str
    registry: ModuleType
    first_seed: int
    plain: int
    pairs: tuple[tuple[str, str], ...]
    whole: tuple[tuple[tuple[str, float], ...], ...] = ()
    of_form: int = 1
    of_cause: int = 4
    of_pair: int = 2
    sizes: tuple[float, ...] = SIZES


BLIND_STUDIES = {
    "first": Study("blind_study", "blind-study", blind_forms, 88_000, 25, PAIRS, WHOLE),
    "second": Study("second_blind_study", "second-blind-study", second_forms, 91_000, 15, SECOND_PAIRS),
    "third": Study("third_blind_study", "third-blind-study", third_forms, 94_000, 36, THIRD_PAIRS, (), 4, 8, 8),
    "fourth": Study("fourth_blind_study", "fourth-blind-study", fourth_forms, 97_000, 10, FOURTH_PAIRS, (), 1, 2, 2),
    "fifth": Study("fifth_blind_study", "fifth-blind-study", fifth_forms, 103_000, 5, (), (), 1, 1, 1, (PAIR_SIZE,)),
}


@dataclass(frozen=True)
class Case:
    """One finger: effects by key with the sizes that are asked for, its seed, and how it is built and touched."""

    kind: str
    effects: tuple[tuple[str, float], ...]
    rubber: str
    order: str
    seed: int
    design: str = "small"

    @property
    def key(self) -> str:
        """Name under which its result is kept."""
        return json.dumps([self.kind, self.effects, self.rubber, self.order, self.seed, self.design])

    @property
    def names(self) -> list[str]:
        """Names of the effects."""
        return [EFFECTS[key].name for key, _ in self.effects]


def cases(study: Study) -> list[Case]:
    """All cases of a study in a fixed random order, so that a part of the run is a smaller study."""
    plan: list[tuple[str, tuple[tuple[str, float], ...], int, str]] = []
    for i, form in enumerate(study.registry.LISTED):
        sizes = [(i + j + k, size) for j, size in enumerate(study.sizes) for k in range(study.of_form)]
        plan += [("one", ((form.key, size),), condition, "small") for condition, size in sizes]
    plan += [("none", (), i, "small") for i in range(study.plain * len(CONDITIONS))]
    for number, cause in enumerate(study.registry.UNLISTED):
        for j, size in enumerate(UNLISTED_SIZES):
            # with one condition for a cause, these change from cause to cause and from size to size
            begin = number + j if study.of_cause == 1 else 0
            plan += [("unlisted", ((cause.key, size),), begin + i, "small") for i in range(study.of_cause)]
    for i, (first, second) in enumerate(study.pairs):
        for j in range(study.of_pair):
            one, other = (forms_of(study.registry.EFFECTS, name) for name in (first, second))
            keys = one[j % 2].key, other[1 - j % 2].key
            # both choices of forms see all conditions
            plan.append(("pair", tuple((key, PAIR_SIZE) for key in keys), i + j + j // 4, "small"))
    for i, effects in enumerate(study.whole):
        kind = "none" if not effects else "one" if EFFECTS[effects[0][0]].listed else "unlisted"
        plan += [(kind, effects, i + j, "whole") for j in range(2)]
    out = []
    for seed, (kind, effects, condition, size) in enumerate(plan, start=study.first_seed):
        rubber, order = CONDITIONS[condition % len(CONDITIONS)]
        out.append(Case(kind, effects, rubber, order, seed, size))
    random.Random(study.first_seed).shuffle(out)
    return out


def trial_cases() -> list[Case]:
    """One of each kind with forms that are published already."""
    effects = {
        "none": (),
        "one": (("crosstalk: unequal, second neighbours", 2.0),),
        "unlisted": (("far_lobe: ", 2.0),),
        "pair": (("crosstalk: unequal, second neighbours", 2.0), ("baseline_drift: warm-up", 2.0)),
    }
    several = enumerate(effects.items())
    return [Case(kind, each, *CONDITIONS[i], DEVELOPMENT + i) for i, (kind, each) in several]


def run(commit: str, case: Case) -> dict[str, Any]:
    """Simulate and diagnose one case."""
    record: dict[str, Any] = {**asdict(case), "key": case.key, "truth": case.names}
    record |= {"version": code_version(), "commit": commit}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "finger"
        try:
            wanted = [(EFFECTS[key], size) for key, size in case.effects]
            simulated = simulate(design(case.design, case.rubber), case.order, wanted, case.seed)
            write(simulated, folder)
        except OutOfReach as reason:
            return {**record, "out_of_reach": str(reason)}
        except Exception as error:  # a study of many runs counts failures, it does not stop at one
            return {**record, "not_simulated": named(error, folder)}
        record |= {"sizes": simulated.truth["sizes"], "values": simulated.truth["effects"]}
        start, cpu = time.perf_counter(), time.process_time()
        try:
            record |= diagnosed(folder, simulated.recording)
        except Exception as error:  # the same
            record["error"] = named(error, folder)
    return {**record, "seconds": time.perf_counter() - start, "processor_s": time.process_time() - cpu}


def kept(folder: Path) -> list[dict[str, Any]]:
    """Results so far.

    Raises
    ------
    FrozenError
        They are of several versions of the code: the study is run once.
    """
    cache = folder / "results.jsonl"
    found = kept_lines(cache)
    if len({(version_of(each), each["commit"]) for each in found}) > 1:
        raise FrozenError(f"{cache} holds results of several versions of the code; the study is run once")
    return found


def main(arguments: list[str] | None = None) -> list[dict[str, Any]]:
    """Run what is not in the folder, and print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("-o", "--output", type=Path, help="folder of the results (default: the name of the page)")
    parser.add_argument("--study", choices=BLIND_STUDIES, default="third")
    parser.add_argument("--development", action="store_true", help="a handful of today's forms, with other seeds")
    parser.add_argument("--again", action="store_true", help="cases that were run, for development")
    parser.add_argument("--form", default="", help="with --again: only fingers with this in the names of their effects")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--cases", type=int, metavar="N", help="end after N new cases")
    parser.add_argument("--tables", action="store_true", help="run nothing: print the tables")
    parser.add_argument("--docs", action="store_true", help="run nothing: write the tables of the page")
    given = parser.parse_args(arguments)
    if given.form and not given.again:
        parser.error("--form needs --again: a study is run whole")
    study = BLIND_STUDIES[given.study]
    folder = given.output or Path(study.name)
    try:
        results = kept(folder)
        if not (given.tables or given.docs):
            if not given.again:
                require_own_package()
            commit = "development" if given.development or given.again else frozen_commit(study.tag)
            if results and (version_of(results[0]), results[0]["commit"]) != (code_version(), commit):
                raise FrozenError(f"{folder} holds results of {version_of(results[0])}; the study is run once")
            print(f"code version {code_version()}, commit {commit}")
            done = {each["key"] for each in results}
            planned = trial_cases() if given.development else cases(study)
            left = [each for each in planned if each.key not in done and not (given.again and each.design != "small")]
            left = [each for each in left if any(given.form in key for key, _ in each.effects) or not given.form]
            left = left[: given.cases]
            results += finished_on_file(folder / "results.jsonl", run, commit, left, processes=given.processes)
        if given.docs and results:
            if any(each["commit"] == "development" for each in results):
                raise FrozenError("results of development are not for the page")
            frozen_commit(study.tag, COUNTING)
    except FrozenError as reason:
        parser.exit(2, f"{parser.prog}: {reason}\n")
    text = tables(results) if results else NOT_RUN
    print(text)
    if given.docs:
        put_into_page("blind_study.py", text, DOCS / f"{study.name}.md")
    return results


if __name__ == "__main__":
    main()
