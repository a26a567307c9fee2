"""Work shared out among the cores of this machine.

A touch takes many short steps of numpy, between which threads wait for Python's lock: two threads are hardly quicker
than one. So the work goes to processes forked from this one, which have its data without a copy, and write into
memory that is shared. Where forking is not safe (other systems, a program that runs threads) threads do it.
"""

from __future__ import annotations

import mmap
import multiprocessing
import os
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Does one piece of the work.
Work = Callable[[Any], Any]
#: Does the pieces, and yields what they give in order.
Spread = Callable[[Sequence[Any]], Iterator[Any]]


def cores(workers: int | None) -> int:
    """How many are to work: all cores that this process may use by default."""
    if workers is not None:
        return max(1, workers)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def may_fork() -> bool:
    """Whether a fork of this process is safe: no thread of it can hold a lock that the fork would wait for."""
    return sys.platform == "linux" and threading.active_count() == 1 and not multiprocessing.current_process().daemon


def shared_empty(shape: tuple[int, ...]) -> NDArray[np.float64]:
    """An array of numbers, zero at first, which processes forked from this one write into."""
    size = int(np.prod(shape))
    return np.frombuffer(mmap.mmap(-1, max(8, 8 * size)), dtype=np.float64, count=size).reshape(shape)


@contextmanager
def spread_out(work: Work, workers: int) -> Iterator[Spread]:
    """Give a function that does pieces of some work on so many cores.

    Parameters
    ----------
    work : callable
        Takes a piece that can be pickled. What it changes is kept only in arrays of `shared_empty`; what it does to a
        piece is the same when it is done twice.
    workers : int
        How many work at once.
    """
    if workers == 1:
        yield lambda pieces: map(work, pieces)
        return
    if not may_fork():
        with ThreadPoolExecutor(workers) as threads, _given_up(threads):
            yield lambda pieces: threads.map(work, pieces)
        return
    fork = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(workers, fork, _begin, (work,)) as processes, _given_up(processes):

        def spread(pieces: Sequence[Any]) -> Iterator[Any]:
            done = 0
            try:
                with warnings.catch_warnings():
                    # Python warns of any thread; those of BLAS are idle, and it prepares them for a fork.
                    warnings.simplefilter("ignore", DeprecationWarning)
                    results = processes.map(_piece, pieces)
                for result in results:
                    yield result
                    done += 1
            except BrokenProcessPool:
                # Somebody, most likely the system in want of memory, killed a process: the rest is done here.
                yield from map(work, pieces[done:])

        yield spread


@contextmanager
def _given_up(pool: Executor) -> Iterator[None]:
    try:
        yield
    finally:
        pool.shutdown(cancel_futures=True)


# What this process was forked for.
_work: list[Work] = []


def _begin(work: Work) -> None:
    _work[:] = [work]
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Where the parent is killed nobody else would tell its processes to end."""
    from multiprocessing.connection import wait

    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _piece(piece: Any) -> Any:
    return _work[0](piece)
