"""Blocks read by a Dask cluster: the same file to the last byte, whoever reads it and whoever dies."""

from __future__ import annotations

import operator
import os
import pickle
import re
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from known_fingers import dataset, known_touches
from study_modules import study

import bayestouch
from bayestouch import inference
from bayestouch.calibration import calibrate
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.parallel import cluster as cluster_module
from bayestouch.parallel.cluster import on_cluster
from bayestouch.reading import driver as run_module
from bayestouch.reading.options import Kept, Options
from bayestouch.results.objects import Calibration, TouchPosteriors

distributed = pytest.importorskip("distributed", reason="distributed is not installed")

# What Dask warns of, such as a port that is taken, is not ours.
pytestmark = pytest.mark.filterwarnings("default")

DRAWS = 128


@pytest.fixture(scope="module")
def read() -> tuple[Touches, Calibration]:
    data = dataset(known_touches(1, step=3.0))
    return data.touches, calibrate(data, draws=40)


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of seven touches, where thousands are the rule."""
    monkeypatch.setattr(run_module, "BLOCK_DRAWS", 1)
    monkeypatch.setattr(run_module, "BLOCK_UNIT", 7)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as made:
        yield made


@pytest.fixture(scope="module")
def whole(read: tuple[Touches, Calibration]) -> TouchPosteriors:
    return bayestouch.infer(*read, draws=DRAWS, seed=5, workers=1)


@pytest.mark.slow
def test_the_same_file_with_one_worker_two_or_none(
    read: tuple[Touches, Calibration], cluster: Any, tmp_path: Path
) -> None:
    alone, shared, single = (tmp_path / f"{name}.nc" for name in ("alone", "shared", "single"))
    bayestouch.infer(*read, draws=DRAWS, seed=5, output=alone)
    bayestouch.infer(*read, draws=DRAWS, seed=5, output=shared, scheduler=cluster.scheduler_address)
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as one:
        bayestouch.infer(*read, draws=DRAWS, seed=5, output=single, scheduler=one.scheduler_address)
    assert shared.read_bytes() == alone.read_bytes()
    assert single.read_bytes() == alone.read_bytes()


def test_in_memory_too(read: tuple[Touches, Calibration], whole: TouchPosteriors, cluster: Any) -> None:
    result = bayestouch.infer(*read, draws=DRAWS, seed=5, scheduler=cluster.scheduler_address)
    for name, draws in whole.posterior.items():
        np.testing.assert_array_equal(result.posterior[name], draws)
    np.testing.assert_array_equal(result.rows.touch, whole.rows.touch)


def test_a_worker_that_is_killed_costs_nothing_but_time(
    read: tuple[Touches, Calibration], whole: TouchPosteriors, cluster: Any
) -> None:
    killed = []

    def kill(_: float) -> None:
        if not killed:
            with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
                killed.append(client.run(os.getpid))
            os.kill(next(iter(killed[0].values())), signal.SIGKILL)

    result = bayestouch.infer(*read, draws=DRAWS, seed=5, scheduler=cluster.scheduler_address, progress=kill)
    assert killed
    np.testing.assert_array_equal(result.posterior["R"], whole.posterior["R"])


def test_blocks_in_any_order(
    read: tuple[Touches, Calibration], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual, turned = tmp_path / "usual.nc", tmp_path / "turned.nc"
    bayestouch.infer(*read, draws=DRAWS, seed=5, output=usual)

    def backwards(workers: int | None) -> run_module.Executor:
        def execute(reader: Any, kept: Kept, blocks: Any, n_touches: int, largest: int, progress: Any) -> Any:
            for first, block in list(blocks)[::-1]:
                yield first, run_module.keep(reader.read(block, first), kept)

        return execute

    monkeypatch.setattr("bayestouch.inference.local_executor", backwards)
    bayestouch.infer(*read, draws=DRAWS, seed=5, output=turned)
    assert turned.read_bytes() == usual.read_bytes()


def test_a_scheduler_that_is_not_there(
    read: tuple[Touches, Calibration], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster_module, "PATIENCE", 0.5)
    with pytest.raises(InputError, match=r"tcp://127\.0\.0\.1:1"):
        bayestouch.infer(*read, draws=DRAWS, output=tmp_path / "a.nc", scheduler="tcp://127.0.0.1:1")
    assert not (tmp_path / "a.nc").exists()


@pytest.mark.slow
def test_a_scheduler_that_goes_away_ends_the_run_in_one_line_and_what_is_done_is_kept(
    read: tuple[Touches, Calibration], tmp_path: Path
) -> None:
    """The same command without a cluster goes on from the blocks that are finished."""
    output, undisturbed = tmp_path / "a.nc", tmp_path / "b.nc"
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as lost:
        address = lost.scheduler_address
        with pytest.raises(InputError, match=re.escape(f"the cluster at {address} does no work")) as caught:
            bayestouch.infer(
                *read, draws=DRAWS, seed=5, output=output, scheduler=address, progress=lambda share: lost.close()
            )
    assert "\n" not in str(caught.value) and not output.exists()
    bayestouch.infer(*read, draws=DRAWS, seed=5, output=output)
    bayestouch.infer(*read, draws=DRAWS, seed=5, output=undisturbed)
    assert output.read_bytes() == undisturbed.read_bytes()


def test_workers_that_all_go_end_the_run_in_one_line() -> None:
    """The scheduler would wait for others for ever."""
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as lost:
        address = lost.scheduler_address
        pieces = on_cluster(address, operator.add, 10, [(number, number) for number in range(20)], patience=1.0)
        assert next(pieces)[1] in range(10, 14)
        lost.scale(0)
        lost.sync(lost._correct_state)
        with pytest.raises(InputError, match="no worker is at work although work is left"):
            list(pieces)


def test_a_worker_of_another_version_is_refused(
    read: tuple[Touches, Calibration], cluster: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = cluster_module.versions_here()
    monkeypatch.setattr(cluster_module, "versions_here", lambda: {**real, "numpy": "0.1"})
    with pytest.raises(InputError, match="a worker has numpy"):
        bayestouch.infer(*read, draws=DRAWS, scheduler=cluster.scheduler_address)


@pytest.mark.parametrize("way", ["here", "processes", "cluster"])
def test_cases_of_a_study_are_shared_out(cluster: Any, way: str) -> None:
    options = {"here": {}, "processes": {"processes": 2}, "cluster": {"scheduler": cluster.scheduler_address}}[way]
    found = dict(study("_shared_out").finished(operator.sub, 10, [1, 2, 5], **options))
    assert found == {0: 9, 1: 8, 2: 5}


def test_what_is_sent_to_workers_is_small(read: tuple[Touches, Calibration]) -> None:
    """The tables that a worker makes for itself in a fraction of a second, 100 MB, stay here."""
    touches, calibration = read
    run, _ = inference._run(touches, calibration, Options(kept=Kept(DRAWS)))
    assert len(pickle.dumps(run.reader)) < 20e6
