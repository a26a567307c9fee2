"""Simulations side by side, and in a process that may not start others."""

from __future__ import annotations

import multiprocessing
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayestouch.simulation_based_calibration.ranks import RankStatistics
from bayestouch.simulation_based_calibration.running import Ranked, check_calibration


@dataclass(frozen=True)
class Design:
    """Ranks that count; one quantity has no rank in a simulation."""

    lacking: int

    def ranked(self, number: int) -> Ranked:
        found = {"always": (number % 100, number % 10 > 0), "mostly": ((3 * number) % 100, True)}
        if number == self.lacking:
            del found["mostly"]
        return found


def check_ranks(found: RankStatistics) -> None:
    np.testing.assert_array_equal(found.ranks["always"], np.arange(100))
    assert tuple(found.ranks) == tuple(found.coverage_90) == ("always",)
    assert found.coverage_90["always"] == 0.9


def test_a_quantity_that_is_held_in_one_simulation_is_left_out() -> None:
    done: list[float] = []
    for lacking in (0, 57):
        check_ranks(check_calibration(Design(lacking), 100, done.append))
    np.testing.assert_allclose(done, np.tile(np.arange(1, 101) / 100, 2))


def test_a_process_that_may_not_start_others_computes_alone() -> None:
    """As a worker of a pool, which is a daemon."""

    def in_daemon(queue: Any) -> None:
        queue.put(dict(check_calibration(Design(57), 100, None).ranks))

    fork = multiprocessing.get_context("fork")
    queue = fork.Queue()
    process = fork.Process(target=in_daemon, args=(queue,), daemon=True)
    process.start()
    found = queue.get(timeout=60)
    process.join()
    np.testing.assert_array_equal(found["always"], np.arange(100))
