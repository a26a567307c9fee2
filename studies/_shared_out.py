"""Cases of a study shared out over this machine's processes, or over a Dask cluster."""

from __future__ import annotations

import argparse
import multiprocessing
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import Any

from _result_lines import appending
from tqdm import tqdm

from bayestouch.parallel.cluster import ClusterWork, on_cluster
from bayestouch.parallel.processes import follow_parent


def finished(
    work: ClusterWork, shared: Any, cases: Sequence[Any], *, processes: int = 1, scheduler: str | None = None
) -> Iterator[tuple[int, Any]]:
    """What each case comes to, with its place among the cases, as they are finished.

    Parameters
    ----------
    work : callable
        Given what all cases share and one case.
    shared : object
    cases : sequence
    processes : int
        Of this machine; with 1 this one does it all.
    scheduler : str, optional
        Address of a Dask cluster that does it instead. Its workers need the modules of the study beside bayestouch:
        start them with ``PYTHONPATH=studies:tests``.
    """
    if scheduler is not None:
        yield from on_cluster(scheduler, work, shared, enumerate(cases))
    elif processes == 1:
        yield from ((number, work(shared, case)) for number, case in enumerate(cases))
    else:
        # spawn: a fork of a process with threads can hang. A worker ends with a study that is killed; the name of the
        # thread that sees to it keeps it from dividing its case among all cores, which the other workers use.
        spawn = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(processes, spawn, follow_parent, ("bayestouch-case",)) as pool:
            jobs = {pool.submit(partial(work, shared), case): number for number, case in enumerate(cases)}
            for job in as_completed(jobs):
                yield jobs[job], job.result()


def finished_on_file(
    path: Path, work: ClusterWork, shared: Any, cases: Sequence[Any], *, processes: int
) -> list[dict[str, Any]]:
    """What each case comes to, as `finished`; each is appended to a file at once, and a bar shows how many are done."""
    out = []
    with appending(path) as append:
        for _, record in tqdm(finished(work, shared, cases, processes=processes), total=len(cases), disable=None):
            out.append(record)
            append(record)
    return out


def scheduler_of(arguments: list[str]) -> tuple[str | None, list[str]]:
    """``--scheduler ADDRESS`` of the arguments of a study, and the other arguments."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--scheduler")
    chosen, others = parser.parse_known_args(arguments)
    return chosen.scheduler, others
