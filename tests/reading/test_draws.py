"""Blocks drawn by several processes or threads, while those before are used: the draws that one process makes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from streamed_cases import DRAWS, blocks_of_seven, calibrated, same

import bayestouch
from bayestouch.reading import draws as draws_module
from bayestouch.reading.draws import _late, arrays
from bayestouch.results.objects import TouchPosteriors


@pytest.fixture(scope="module", params=["importance", "emcee"])
def whole(request: pytest.FixtureRequest) -> TouchPosteriors:
    """All touches in one block, drawn by this process."""
    return bayestouch.infer(*calibrated(), method=request.param, draws=DRAWS, seed=5, workers=1)


@pytest.mark.parametrize("how", ["fork", "threads"])
@pytest.mark.parametrize("workers", [1, 2])
def test_blocks_that_are_drawn_ahead_are_the_same(
    whole: TouchPosteriors, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, how: str, workers: int
) -> None:
    if how == "fork" and sys.platform != "linux":
        pytest.skip("processes are forked on Linux only")
    blocks_of_seven(monkeypatch)
    monkeypatch.setattr(draws_module, "SHARED_FROM", 1)
    if how == "threads":
        monkeypatch.setattr("bayestouch.parallel.processes.may_fork", lambda: False)
        monkeypatch.setattr(draws_module, "may_fork", lambda: False)
    touches, calibration = calibrated()
    method = str(whole.settings["method"])
    told: list[float] = []
    mine = bayestouch.infer(
        touches, calibration, method=method, draws=DRAWS, seed=5, workers=workers, progress=told.append
    )
    assert len(mine.rows.touch) > 6 * 7, "more blocks than are in memory"
    same(mine, whole)
    assert told == sorted(told) and told[-1] == 1 and len(set(told)) > 3
    path = tmp_path / "posterior.nc"
    bayestouch.infer(touches, calibration, method=method, draws=DRAWS, seed=5, workers=workers, output=path)
    same(bayestouch.load(path), whole)


@pytest.mark.parametrize(("draws", "limit"), [(64, 1 + 3 / 16), (200, 1.06), (600, 1.02), (1024, 1.02)])
def test_the_largest_rhat_is_a_setting_of_the_result(draws: int, limit: float) -> None:
    """It decides the grade: 3 over the draws of a chain above 1, and at least 0.02."""
    touches, calibration = calibrated()
    result = bayestouch.infer(touches, calibration, draws=draws, seed=5, workers=1)
    assert result.settings["largest_rhat"] == pytest.approx(limit)
    rhat, ess = result.sample_stats["rhat"], result.sample_stats["ess_bulk"]
    good = (rhat <= result.settings["largest_rhat"]) & (ess >= result.settings["least_ess"])
    assert good[result.sample_stats["grade"] == 1].all()
    assert draws != 64 or (rhat[result.sample_stats["grade"] == 1] > 1.02).any()


def test_work_begins_before_its_result_is_needed() -> None:
    """Three blocks are begun before the first is complete, and no more."""
    begun: list[int] = []

    def numbers() -> Iterator[int]:
        for k in range(6):
            begun.append(k)
            yield k

    items = _late(_late(numbers(), 1), 1)  # type: ignore[arg-type, type-var]
    assert next(items) == 0  # type: ignore[comparison-overlap]
    assert begun == [0, 1, 2]
    assert list(items) == [1, 2, 3, 4, 5]  # type: ignore[comparison-overlap]


def test_arrays_share_memory_without_overlap() -> None:
    memory = np.zeros(5 * (6 + 1 + 3))
    made = arrays(memory, {"a": (2, 3), "b": (), "c": (3,)}, 4)
    assert {name: array.shape for name, array in made.items()} == {"a": (2, 3, 4), "b": (4,), "c": (3, 4)}
    for k, array in enumerate(made.values()):
        assert array.flags.c_contiguous
        array += k + 1
    assert {name: set(array.ravel()) for name, array in made.items()} == {"a": {1.0}, "b": {2.0}, "c": {3.0}}
    assert memory.sum() == 24 + 2 * 4 + 3 * 12
