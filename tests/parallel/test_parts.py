"""Parts of a computation: the same results on one core and on two, which only long work uses."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
import time

import pytest

from bayestouch.parallel import parts, processes

forks = pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux alone")


@pytest.fixture(autouse=True)
def _two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes, "cores", lambda workers: 2)
    # Tests of a cluster leave idle threads in this process, which hold no lock.
    monkeypatch.setattr(processes, "may_fork", lambda: True)


def slow(part: int) -> tuple[int, int]:
    time.sleep(0.02)
    return part, os.getpid()


@forks
def test_long_work_is_divided_and_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "WORTH", 0.1)
    threads = threading.active_count()
    found = parts.of_parts(slow, range(20))
    assert [part for part, _ in found] == list(range(20))
    assert found[0][1] == os.getpid() not in {process for _, process in found[1:]}
    assert not multiprocessing.active_children() and threading.active_count() <= threads  # others may end


@pytest.mark.parametrize("number", [0, 1, 3])
def test_short_work_stays_here(number: int) -> None:
    assert parts.of_parts(slow, range(number)) == [(part, os.getpid()) for part in range(number)]


def test_beside_other_threads_work_stays_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "WORTH", 0.0)
    monkeypatch.setattr(processes, "may_fork", lambda: False)
    assert {process for _, process in parts.of_parts(slow, range(3))} == {os.getpid()}


@forks
def test_an_error_of_a_part_is_raised_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "WORTH", 0.0)

    def wrong(part: int) -> int:
        if part == 2:
            raise ValueError("bad part")
        return part

    with pytest.raises(ValueError, match="bad part"):
        parts.of_parts(wrong, range(4))
