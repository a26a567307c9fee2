"""Parallel computation on the cores of this machine.

A touch needs many short numpy operations, between which threads wait for the lock of Python: two threads are hardly
faster than one. Therefore the work is done in processes forked from this one. They have its data without a copy and
write into shared memory. If a fork is not safe (other systems, a program with threads), threads are used.
"""

from __future__ import annotations

import mmap
import multiprocessing
import os
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from itertools import zip_longest
from multiprocessing.connection import wait
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Name of a thread of `follow_parent` beside which a fork is safe: it only waits, and holds no lock.
FOLLOWS = "bayestouch-follows-parent"
#: Function that computes one piece of the work.
Work = Callable[[Any], Any]
#: Function that begins to compute pieces, and yields their results in order. With one worker, a piece is computed when
#: its result is requested.
Spread = Callable[[Sequence[Any]], Iterator[Any]]


def cores(workers: int | None) -> int:
    """Return the number of workers: by default all cores that this process may use."""
    if workers is not None:
        return workers
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def may_fork() -> bool:
    """Return True if this process can fork safely: no other thread can hold a lock that the fork would wait for."""
    alone = all(each is threading.main_thread() or each.name == FOLLOWS for each in threading.enumerate())
    return sys.platform == "linux" and alone and not multiprocessing.current_process().daemon


def shared_empty(shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return an array of zeros that processes forked from this one can write into."""
    size = int(np.prod(shape))
    return np.frombuffer(mmap.mmap(-1, max(8, 8 * size)), dtype=np.float64, count=size).reshape(shape)


@contextmanager
def spread_out(work: Work, workers: int) -> Iterator[Spread]:
    """Yield a function that computes pieces of work on several cores; it may be called again before they are done.

    Parameters
    ----------
    work : callable
        Function of a piece that can be pickled. Only its changes to arrays of `shared_empty` are kept. To compute a
        piece twice must not change the result.
    workers : int
        Number of processes or threads.
    """
    if workers == 1:
        yield lambda pieces: map(work, pieces)
        return
    if not may_fork():
        with ThreadPoolExecutor(workers) as threads, _shut_down_after(threads):
            yield lambda pieces: threads.map(work, pieces)
        return
    fork = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(workers, fork, _begin, (work,)) as processes, _shut_down_after(processes):

        def spread(pieces: Sequence[Any]) -> Iterator[Any]:
            futures: list[Future[Any]] = []
            with warnings.catch_warnings(), suppress(BrokenProcessPool):
                # Python warns of any thread; the threads of BLAS are idle and BLAS prepares them for a fork.
                warnings.simplefilter("ignore", DeprecationWarning)
                futures += (processes.submit(_piece, piece) for piece in pieces)
            return _results(work, pieces, futures)

        yield spread


def on_cores(work: Work, pieces: Sequence[Any]) -> Iterator[Any]:
    """Yield the results of pieces in order, from all cores; one after the other here if a fork is not safe.

    Pieces of many short steps gain nothing from threads. `work` and `pieces` are as of `spread_out`.
    """
    workers = max(1, min(cores(None), len(pieces))) if may_fork() else 1
    with spread_out(work, workers) as spread:
        yield from spread(pieces)


def _results(work: Work, pieces: Sequence[Any], futures: Sequence[Future[Any]]) -> Iterator[Any]:
    """Yield the results of pieces that were submitted; those that were not, or were lost, are computed here."""
    for piece, future in zip_longest(pieces, futures):
        try:
            result = work(piece) if future is None else future.result()
        except BrokenProcessPool:
            # A process was killed, probably by the system because of too little memory.
            result = work(piece)
        yield result


@contextmanager
def _shut_down_after(pool: Executor) -> Iterator[None]:
    try:
        yield
    finally:
        pool.shutdown(cancel_futures=True)


# Work of this forked process.
_work: list[Work] = []


def _begin(work: Work) -> None:
    _work[:] = [work]
    # Work that is in pieces already is not divided again.
    follow_parent("bayestouch-piece")


def follow_parent(name: str) -> None:
    """Let this forked process end when its parent has ended, which is not automatic if the parent is killed.

    A thread with this name waits for it.
    """
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_after, args=(parent.sentinel,), daemon=True, name=name).start()


def _end_after(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)


def _piece(piece: Any) -> Any:
    return _work[0](piece)
