"""Error rates of the diagnosis, over simulated fingers of which nothing is declared.

The simulator is that of the tests (`tests/independent`), which shares no code with the package. Some of its effects
have a formula that the catalogue's can be, others have not: `tests/independent` says which, and rates of both are
separate. Fingers 0 to 9 are a development set: catalogue and search were changed after failures on them.

A size is the root mean square of what an effect leaves in the touch means after the base parameters have absorbed what
they can, over the noise of an averaged touch: with it the lack of fit is about 1 + size². Sizes that only an absurd
value would reach are left out, and the tables show how many fingers there were.

    python studies/error_rates.py                              a handful of small fingers, within a minute
    python studies/error_rates.py -o FOLDER [--fingers 10]     the study: some 1000 diagnoses, for hours
        --small         of fingers with 8 elements and a third of the touches: within an hour or so
        --light         reads the held-out touches of fingers at one size only, for the errors of R and for coverage
        --seeds-from 10 begins with this finger, so that fingers are fresh that nobody has looked at
        --minutes 30    begins no case after so long
        --scheduler A   leaves the cases to the workers of a Dask cluster
        --tables        runs nothing: shows the results that there are
        --docs PAGE     writes them as a page of the documentation

Every result is appended to FOLDER/results.jsonl with the version of the code, and cases that this version has done are
not run again: a stopped run goes on, and small fingers and whole ones may share a folder. Tables and pages hold results
of one version, that of the last result.
Cases come finger by finger, those of a finger in random order, so that a part of the run is a smaller study.
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
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from tqdm import tqdm

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

from _error_rate_figures import save_figures  # noqa: E402
from _error_rate_page import groups, page  # noqa: E402
from _error_rate_tables import print_tables  # noqa: E402
from _error_rate_versions import code_version, newest, version_of  # noqa: E402
from _result_lines import appending, kept_lines  # noqa: E402
from _shared_out import finished  # noqa: E402
from independent.dataset import EFFECTS, LISTED, UNLISTED, forms, simulate, write  # noqa: E402
from independent.finger import SMALL, Design  # noqa: E402
from independent.sizes import OutOfReach  # noqa: E402

SIZES = (0.5, 1.0, 2.0, 5.0)
# The size at which a light run, too, reads the held-out touches, as it does those of fingers without effects.
READ_SIZE = 2.0
DESIGNS = {"whole": Design(), "small": SMALL}
PLAIN_PER_FINGER, PAIR_SIZE = 4, 1.5
# Fingers without effects have seeds from here on, `PLAIN_PER_FINGER` beside each finger with effects.
PLAIN_SEEDS = 10_000
PAIRS = (
    ("crosstalk", "baseline_drift"),
    ("gain_nonlinearity", "prober_eccentricity"),
    ("proximity", "gain_drift"),
    ("soft_spot", "memory"),
    ("tangential_load", "channel_lag"),
)


@dataclass(frozen=True)
class Case:
    """One data set: effects by key with their sizes, the seed of finger and touches, and which fingers."""

    kind: str
    effects: tuple[tuple[str, float], ...]
    seed: int
    design: str = "whole"

    @property
    def key(self) -> str:
        """Name under which its result is kept."""
        return json.dumps([self.kind, self.effects, self.seed, self.design])

    @property
    def finger(self) -> int:
        """Number of the finger; those without effects count with the finger beside which they are run."""
        return self.seed if self.kind != "none" else (self.seed - PLAIN_SEEDS) // PLAIN_PER_FINGER

    @property
    def noise(self) -> tuple[int, ...]:
        """Seed of the noise: each case has its own, so that one finger's luck is not that of all its cases."""
        return (zlib.crc32(self.key.encode()),)

    @property
    def names(self) -> list[str]:
        """Names of the effects."""
        return [EFFECTS[key].name for key, _ in self.effects]


def cases(fingers: range, design: str) -> Iterator[Case]:
    """All cases of a design, finger by finger and shuffled within; forms of an effect take turns."""
    names = list(dict.fromkeys(effect.name for effect in LISTED))

    def form(name: str, finger: int) -> str:
        several = forms(name)
        return several[finger % len(several)].key

    for finger in fingers:
        own = [Case("none", (), PLAIN_SEEDS + PLAIN_PER_FINGER * finger + i) for i in range(PLAIN_PER_FINGER)]
        own += [Case("one", ((form(name, finger), size),), finger) for name in names for size in SIZES]
        own += [Case("pair", tuple((form(name, finger), PAIR_SIZE) for name in pair), finger) for pair in PAIRS]
        own += [Case("unlisted", ((effect.key, size),), finger) for effect in UNLISTED for size in SIZES[1:3]]
        random.Random(finger).shuffle(own)
        yield from (replace(case, design=design) for case in own)


def small_cases() -> Iterator[Case]:
    """One of each kind, on small fingers."""
    yield Case("none", (), PLAIN_SEEDS + PLAIN_PER_FINGER, "small")
    yield Case("one", (("crosstalk: unequal, second neighbours", 2.0),), 1, "small")
    yield Case("unlisted", (("far_lobe: ", 2.0),), 1, "small")


def run(shared: tuple[bool, float], case: Case) -> dict[str, Any] | None:
    """Simulate and diagnose one case; None where the time to begin (s since the epoch) is over."""
    light, begin_before = shared
    if time.time() > begin_before:
        return None
    import bayestouch

    record: dict[str, Any] = {**asdict(case), "key": case.key, "names": case.names, "finger": case.finger}
    record["version"] = code_version()
    with tempfile.TemporaryDirectory() as folder:
        try:
            wanted = [(EFFECTS[key], size) for key, size in case.effects]
            simulated = simulate(DESIGNS[case.design], wanted, case.seed, case.noise)
        except OutOfReach as reason:
            return {**record, "out_of_reach": str(reason)}
        dataset = bayestouch.load_dataset(write(simulated, Path(folder) / "finger"))
        start, cpu = time.perf_counter(), time.process_time()
        try:
            sample = not light or all(size == READ_SIZE for _, size in case.effects)
            diagnosis = bayestouch.diagnose(dataset, sample=sample, seed=0)
        except Exception as error:  # a study of thousands of runs counts failures, it does not stop at one
            return {**record, "error": f"{type(error).__name__}: {error}".replace(f"{folder}/", "")}
        record |= {"seconds": time.perf_counter() - start, "cpu_seconds": time.process_time() - cpu}
    record["truth"] = {key: simulated.truth[key] for key in ("effects", "sizes", "size")}
    return record | {"diagnosis": diagnosis.to_dict()}


def results(
    folder: Path,
    wanted: list[Case],
    processes: int,
    light: bool,
    begin_before: float,
    scheduler: str | None = None,
) -> list[dict[str, Any]]:
    """Results of the `wanted` cases, from the cache where this version has done them; as many as there is time for.

    Raises
    ------
    RuntimeError
        A worker of the cluster runs another version of the code.
    """
    cache, version = folder / "results.jsonl", code_version()
    known = {record["key"]: record for record in kept_lines(cache) if version_of(record) == version}
    missing = [case for case in wanted if case.key not in known]
    done = finished(run, (light, begin_before), missing, processes=processes, scheduler=scheduler)
    with appending(cache) as append:
        for _, record in tqdm(done, total=len(missing), disable=None):
            if record is None:
                continue
            if version_of(record) != version:
                raise RuntimeError(f"a worker runs version {version_of(record)} of the code, here it is {version}")
            known[record["key"]] = record
            append(record)
    return [known[case.key] for case in wanted if case.key in known]


def main(arguments: list[str] | None = None) -> list[dict[str, Any]]:
    """Run what is not in the cache, print the tables, save the figures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("-o", "--output", type=Path, help="folder of results and figures; without it a handful is run")
    parser.add_argument("--fingers", type=int, default=10)
    parser.add_argument("--seeds-from", type=int, default=0, metavar="N", help="number of the first finger")
    parser.add_argument("--small", action="store_true", help="of fingers with 8 elements and a third of the touches")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--scheduler", metavar="ADDRESS", help="Dask cluster that does the work")
    parser.add_argument("--light", action="store_true", help=f"read held-out touches only at size {READ_SIZE:g}")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin no case after so long")
    parser.add_argument("--tables", action="store_true", help="run nothing: only show the results that there are")
    parser.add_argument("--docs", type=Path, help="page of the documentation to write")
    options = parser.parse_args(arguments)
    if options.output is None:
        with tempfile.TemporaryDirectory() as folder:
            wanted, scheduler = list(small_cases()), options.scheduler
            records = results(Path(folder), wanted, options.processes, True, float("inf"), scheduler)
        print_tables(records)
        return records
    if not options.tables:
        until = time.time() + 60 * options.minutes
        fingers = range(options.seeds_from, options.seeds_from + options.fingers)
        wanted = list(cases(fingers, "small" if options.small else "whole"))
        results(options.output, wanted, options.processes, options.light, until, options.scheduler)
    everything = kept_lines(options.output / "results.jsonl")
    records = newest(everything)
    if not records:
        parser.error(f"{options.output} has no results")
    others = len(everything) - len(records)
    print(f"version {version_of(records[0])}; {others} results of other versions are left out")
    several = groups(records)
    for title, some in several.items():
        print(f"\n{title}: ", end="")
        print_tables(some)
        save_figures(some, options.output, prefix=f"{title.split(' (')[0].replace(' ', '_').replace(',', '')}_")
    if options.docs is not None:
        some = next(iter(several.values()))
        save_figures(some, options.docs.parent / "figures", prefix="error_rates_", names=("detection", "confusion"))
        options.docs.write_text(page(records), encoding="utf-8")
    return records


if __name__ == "__main__":
    main()
