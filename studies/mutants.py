"""Would the tests notice? Small changes to the core, made one at a time at random places, each tested.

cosmic-ray makes the changes and keeps the results; ``mutants/parts.toml`` says what the core is and which tests go with
each part. A run that was stopped goes on where it was; results belong to one state of the core and one
sample. The score and the survivors go to ``docs/verified.md``; ``mutants/judged.toml`` says what was found on looking
at a survivor.

    python studies/mutants.py                    160 changes, an hour or more of two cores
    python studies/mutants.py --number 15 --part chain
    python studies/mutants.py --again            only what was not killed, after tests were added
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, as_completed
from pathlib import Path

import click
from _mutant_page import Tried, section, summary
from _mutant_runs import tested, timed, workers
from _mutant_tests import ROOT, Part, Tests, parts
from _mutants import Mutant, fingerprint, sample
from _page import DOCS, put_into_page
from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import TestOutcome, WorkResult

KEPT = ROOT / "build" / "mutants"  # results and times, for the next run


def _outcome(result: WorkResult) -> str:
    if result.diff is None or result.test_outcome == TestOutcome.INCOMPETENT:
        return "broken"
    if result.test_outcome == TestOutcome.SURVIVED:
        return "survived"
    return "timeout" if result.output == "timeout" else "killed"


def _seconds(tests: Sequence[Path], pool: Executor, limit: float) -> dict[Path, float]:
    """What each file takes unchanged, measured where it was not with this package and this text of the file."""
    kept = KEPT / f"times-{fingerprint(list((ROOT / 'bayestouch').rglob('*.py')))}.json"
    times: dict[str, float | None] = json.loads(kept.read_text()) if kept.is_file() else {}
    keys = {test: f"{test.as_posix()} {fingerprint([ROOT / test])}" for test in tests}
    runs = {pool.submit(timed, test, limit): key for test, key in keys.items() if key not in times}
    for run in as_completed(runs):
        times[runs[run]] = took = run.result()
        kept.write_text(json.dumps(times, indent=1))
        print(f"{runs[run].split()[0]}: {'not used' if took is None else f'{took:.0f} s'}", flush=True)
    return {test: took for test, key in keys.items() if (took := times[key]) is not None}


def _run(
    session: WorkDB, mutants: Mapping[str, Mutant], files: Mapping[str, list[Path]], limit: float, pool: Executor
) -> None:
    """Test every change that has no result."""
    begun, runs = time.monotonic(), {}
    for item in session.pending_work_items:
        tests = files[item.job_id]
        if not tests:
            raise LookupError(f"no test file is quick enough for {mutants[item.job_id].name}: raise --budget")
        runs[pool.submit(tested, item, tests, limit)] = item.job_id
    for number, run in enumerate(as_completed(runs), 1):
        job, result = runs[run], run.result()
        session.set_result(job, result)
        mutant, minutes = mutants[job], (time.monotonic() - begun) / 60
        print(f"{number}/{len(runs)} {minutes:.0f} min {_outcome(result)} {mutant.name}", flush=True)
        print(f"    {mutant.before}\n    {mutant.after}", flush=True)


def _keep_killed(session: WorkDB) -> None:
    """Keep the results of what was killed, so that the rest is tested again."""
    done = [(item, result) for item, result in session.completed_work_items if _outcome(result) == "killed"]
    items = session.work_items
    session.clear()
    session.add_work_items(items)
    for item, result in done:
        session.set_result(item.job_id, result)


def _part_of(module: Path, among: Sequence[Part]) -> Part:
    return next(part for part in among if module in part.modules)


@click.command()
@click.option("--number", default=160, show_default=True, help="How many changes.")
@click.option("--seed", default=14, show_default=True, help="Which places.")
@click.option("--processes", default=2, show_default=True)
@click.option("--budget", default=90.0, show_default=True, help="Seconds of tests that a change has to survive.")
@click.option("--part", help="Only this part of the core, as parts.toml names it; the page is left as it is.")
@click.option("--again", is_flag=True, help="Test again what an earlier run did not kill.")
@click.option("--page/--no-page", default=True, help="Write docs/verified.md.")
def main(number: int, seed: int, processes: int, budget: float, part: str | None, again: bool, page: bool) -> None:
    """Change the core at random places, one at a time, and see whether the tests notice."""
    KEPT.mkdir(parents=True, exist_ok=True)
    among, every = parts()
    if part is not None:
        among = tuple(each for each in among if each.name == part)
        if not among:
            raise click.BadParameter(f"no part is named {part!r}", param_hint="--part")
    modules = [module for part in among for module in part.modules]
    chosen, places = sample(modules, number, seed, ROOT)
    mutants = {mutant.item().job_id: mutant for mutant in chosen}
    tests = Tests.read(every)
    wanted = {m: tests.candidates(m, _part_of(m, among)) for m in {each.spec.module_path for each in chosen}}
    files = sorted({path for groups in wanted.values() for group in groups for path in group})
    state = fingerprint([ROOT / module for module in modules], *sorted(mutants))
    with use_db(KEPT / f"session-{state}.sqlite") as session:
        if not session.num_work_items:
            session.add_work_items(mutant.item() for mutant in chosen)
        if again:
            _keep_killed(session)
        if session.pending_work_items:
            with workers(ROOT, processes) as pool:
                took = _seconds(files, pool, 60 + 2 * budget)
                order = {
                    job: tests.chosen(path := m.spec.module_path, _part_of(path, among), took, budget)
                    for job, m in mutants.items()
                }
                _run(session, mutants, order, 60 + 2 * budget, pool)
        results = {item.job_id: result for item, result in session.completed_work_items}
    tried = [
        Tried(
            _part_of(m.spec.module_path, among).name,
            m.spec.module_path.as_posix(),
            m.spec.start_pos[0],
            m.before,
            m.after,
            _outcome(results[job]),
        )
        for job, m in mutants.items()
    ]
    tried.sort(key=lambda one: ([each.name for each in among].index(one.part), one.module, one.line))
    for each in tried:
        if each.outcome in ("survived", "broken"):
            print(f"{each.outcome}: {each.module}:{each.line}\n    {each.before}\n    {each.after}")
    print(summary(tried))
    if page and part is None:
        put_into_page("mutants.py", section(tried, seed, places), DOCS / "verified.md")


if __name__ == "__main__":
    main()
