"""Work beside this process: the same results, whatever becomes of the other process."""

from __future__ import annotations

import multiprocessing
import os
import threading
from typing import Any

import pytest

from bayestouch.parallel.beside import Tell, both
from bayestouch.parallel.processes import may_fork


@pytest.fixture(autouse=True)
def _two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bayestouch.parallel.beside.cores", lambda workers: 2)


forks = pytest.mark.skipif(not may_fork(), reason="processes are forked on Linux alone")


@forks
def test_another_process_works_and_ends() -> None:
    here, beside = both(os.getpid, lambda tell: (os.getpid(), os.getppid(), may_fork()))
    assert here == os.getpid() == beside[1] != beside[0]
    assert beside[2]  # it can divide its own work
    assert both(lambda: 1, lambda tell: both(lambda: 2, lambda tell: 3)) == (1, (2, 3))
    assert not multiprocessing.active_children() and threading.active_count() == 1


def test_with_other_threads_this_process_works() -> None:
    stop = threading.Event()
    thread = threading.Thread(target=stop.wait)
    thread.start()
    try:
        assert both(lambda: 1, lambda tell: os.getpid()) == (1, os.getpid())
    finally:
        stop.set()
        thread.join()


@forks
@pytest.mark.parametrize("end", [lambda: os._exit(1), lambda: threading.Lock()], ids=["killed", "not pickled"])
def test_work_without_a_result_is_done_here(end: Any) -> None:
    this = os.getpid()
    assert both(lambda: 1, lambda tell: this if os.getpid() == this else end()) == (1, this)


def test_an_error_is_raised_here() -> None:
    def wrong(tell: Tell | None = None) -> int:
        raise ValueError("bad")

    with pytest.raises(ValueError, match="bad"):
        both(lambda: 1, wrong)
    with pytest.raises(ValueError, match="bad"):
        both(wrong, lambda tell: threading.Event().wait())
    assert not multiprocessing.active_children()


@forks
def test_progress_of_the_other_process_is_told() -> None:
    told: list[float] = []
    heard = multiprocessing.Event()

    def tell(fraction: float) -> None:
        told.append(fraction)
        if fraction == 0.5:
            heard.set()

    def work(tell: Tell | None) -> bool:
        assert tell is not None
        tell(0.5)
        return heard.wait(10)

    assert both(lambda: 1, work, tell) == (1, True)
    assert told[-1] == 0.5
