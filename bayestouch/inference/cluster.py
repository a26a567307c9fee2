"""Blocks of touches read by an existing Dask cluster.

The results are the same as without: a block's draws depend on the seed and the numbers of its touches, not on who
reads it, when, or how often. So whatever is lost, a worker or the scheduler, only costs time.
"""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from importlib import import_module
from importlib.metadata import version
from typing import Any

from bayestouch.errors import InputError
from bayestouch.inference.options import Kept
from bayestouch.inference.run import BlockReader, Hands, Numbered, keep
from bayestouch.progress import Progress
from bayestouch.results import TouchPosteriors

#: How long a scheduler that does not answer, or has no workers, is waited for, in seconds.
PATIENCE = 30.0
#: Blocks given to a worker's thread: the next one waits there when one is read.
AHEAD = 2
#: Times that the cluster may be lost with no block read in between.
MOST_LOST = 3
#: Looks, two seconds apart, at a cluster that does nothing, until it is given its blocks anew.
MOST_IDLE = 5


def hands_of_cluster(address: str, patience: float | None = None) -> Hands:
    """Read blocks on the cluster whose scheduler is at `address`.

    Raises
    ------
    InputError
        From the function returned: `distributed` is not installed, the scheduler cannot be reached for so many
        seconds or has no workers, or its workers have other versions of what computes.
    """

    seconds = PATIENCE if patience is None else patience

    def hands(
        reader: BlockReader, kept: Kept, blocks: Numbered, within: Progress | None
    ) -> Iterator[tuple[int, TouchPosteriors]]:
        unread: dict[int, Any] = {}
        lost = 0
        while True:
            try:
                with _client(address, seconds) as client:
                    for first, result in _read(client, seconds, reader, kept, blocks, unread):
                        lost = 0
                        yield first, result
                return
            except _Lost as error:
                lost += 1
                if lost >= MOST_LOST:
                    raise InputError(f"the cluster at {address} does not read blocks: {error}") from error

    return hands


class _Lost(Exception):
    """Something of the cluster went away."""


def _read(
    client: Any, patience: float, reader: BlockReader, kept: Kept, blocks: Numbered, unread: dict[int, Any]
) -> Iterator[tuple[int, TouchPosteriors]]:
    """Read the blocks that are unread, and then the others; what is on the cluster is in `unread`."""
    killed = _distributed().scheduler.KilledWorker
    lost = (OSError, TimeoutError, CancelledError, killed)
    try:
        client.wait_for_workers(1, timeout=patience)
        # A task, which Dask does again where a worker dies with its result. What is scattered would be lost, and a
        # worker that dies while something is scattered can leave the scheduler waiting for ever.
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
            there = client.submit(pickle.loads, pickle.dumps(reader), pure=False)
    except lost as error:
        raise _Lost(f"no worker within {patience:.0f} s") from error
    versions = versions_here()
    futures: dict[Any, int] = {}

    def submit(first: int) -> None:
        # Pure functions would be known by their arguments, which takes long to hash.
        future = client.submit(_one_block, there, unread[first], first, kept, versions, pure=False)
        futures[future] = first

    for first in unread:
        submit(first)
    while True:
        try:
            while len(futures) < AHEAD * max(1, sum(client.nthreads().values())):
                following = next(blocks, None)
                if following is None:
                    break
                unread[following[0]] = following[1]
                submit(following[0])
            if not futures:
                return
            finished = [(futures.pop(future), future.result()) for future in _finished(client, list(futures))]
        except lost as error:
            raise _Lost(f"{type(error).__name__}: {error}") from error
        for first, result in finished:
            del unread[first]
            yield first, result


def _finished(client: Any, futures: list[Any]) -> list[Any]:
    """Wait for some to be read. A scheduler that went away, or forgot what it was to do, is noticed within seconds."""
    idle = 0
    while True:
        try:
            with client.as_current():
                return list(_distributed().wait(futures, timeout=2.0, return_when="FIRST_COMPLETED").done)
        except TimeoutError:
            if client.status != "running" or not client.nthreads():
                raise OSError("the scheduler is gone, or all of its workers") from None
            idle = 0 if any(client.processing().values()) else idle + 1
            if idle > MOST_IDLE:
                raise OSError("no worker is at work although blocks are left") from None


def _one_block(reader: BlockReader, block: Any, first: int, kept: Kept, versions: dict[str, str]) -> TouchPosteriors:
    """What a worker does."""
    here = versions_here()
    if here != versions:
        other = ", ".join(f"{name} {here[name]} for {versions[name]}" for name in here if here[name] != versions[name])
        raise InputError(f"a worker has {other}: results would not be the same")
    return keep(reader.read(block, first, 1, None), kept)


def versions_here() -> dict[str, str]:
    """Versions of what computes."""
    return {name: version(name) for name in ("bayestouch", "numpy", "scipy", "emcee")}


@contextmanager
def _client(address: str, patience: float) -> Iterator[Any]:
    try:
        client = _distributed().Client(address, timeout=patience, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"no scheduler answers at {address}: {error}") from error
    try:
        yield client
    finally:
        client.close()


def _distributed() -> Any:
    try:
        return import_module("distributed")
    except ImportError:
        message = "a cluster needs distributed, which is not installed: pip install 'bayestouch[cluster]'"
        raise InputError(message) from None
