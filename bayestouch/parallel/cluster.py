"""Work shared out over an existing Dask cluster: blocks of touches, candidates of a diagnosis, cases of a study.

The results are the same as without: what a piece comes to depends on the piece, not on who does it, when, or how
often. So whatever is lost, a worker or the scheduler, only costs time.
"""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from importlib import import_module
from importlib.metadata import version
from typing import Any

from bayestouch.errors import InputError

#: Does one piece of work, given what all pieces share.
ClusterWork = Callable[[Any, Any], Any]
#: How long a scheduler that does not answer, or has no workers, is waited for, in seconds.
PATIENCE = 30.0
#: Pieces given to a worker's thread: the next one waits there when one is done.
AHEAD = 2
#: Times that the cluster may be lost with nothing done in between.
MOST_LOST = 3
#: Looks, two seconds apart, at a cluster that does nothing, until it is given its pieces anew.
MOST_IDLE = 5


def on_cluster(
    address: str, work: ClusterWork, shared: Any, pieces: Iterable[tuple[int, Any]], patience: float | None = None
) -> Iterator[tuple[int, Any]]:
    """Do some work on every piece on the cluster whose scheduler is at `address`.

    Parameters
    ----------
    address : str
        Such as ``tcp://10.0.0.5:8786``.
    work : callable
        Given what all pieces share and one piece: a function that the workers can import, or one of the script that
        was started.
    shared : object
        Is sent to each worker once.
    pieces : iterable of (int, object)
        Numbered; taken as workers become free.
    patience : float, optional
        Seconds to wait for a scheduler and its workers, `PATIENCE` by default.

    Yields
    ------
    number, result
        As they are finished, in any order.

    Raises
    ------
    InputError
        `distributed` is not installed, the scheduler cannot be reached or has no workers, its workers have other
        versions of what computes, or the cluster was lost several times with nothing done in between.
    """
    seconds = PATIENCE if patience is None else patience
    pieces = iter(pieces)
    undone: dict[int, Any] = {}
    lost = 0
    while True:
        try:
            with _client(address, seconds) as client:
                for number, result in _done(client, seconds, work, shared, pieces, undone):
                    lost = 0
                    yield number, result
            return
        except _Lost as error:
            lost += 1
            if lost >= MOST_LOST:
                raise InputError(f"the cluster at {address} does no work: {error}") from error


def in_order(
    address: str | None,
    work: ClusterWork,
    shared: Any,
    pieces: Sequence[Any],
    progress: Callable[[int], None] = lambda number: None,
) -> list[Any]:
    """Results of some work on every piece, in order: by the cluster at `address`, by this process where it is None.

    `progress` is called with the number of pieces that are done.
    """
    if not pieces:
        return []
    numbered: Iterator[tuple[int, Any]]
    if address is None:
        numbered = ((number, work(shared, piece)) for number, piece in enumerate(pieces))
    else:
        numbered = on_cluster(address, work, shared, enumerate(pieces))
    done = {}
    for number, result in numbered:
        done[number] = result
        progress(len(done))
    return [done[number] for number in sorted(done)]


class _Lost(Exception):
    """Something of the cluster went away."""


def _done(
    client: Any,
    patience: float,
    work: ClusterWork,
    shared: Any,
    pieces: Iterator[tuple[int, Any]],
    undone: dict[int, Any],
) -> Iterator[tuple[int, Any]]:
    """Do the pieces that are undone, and then the others; what is on the cluster is in `undone`."""
    killed = _distributed().scheduler.KilledWorker
    lost = (OSError, TimeoutError, CancelledError, killed)
    try:
        client.wait_for_workers(1, timeout=patience)
        # A task, which Dask does again where a worker dies with its result. What is scattered would be lost, and a
        # worker that dies while something is scattered can leave the scheduler waiting for ever.
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
            there = client.submit(pickle.loads, pickle.dumps(shared), pure=False)
    except lost as error:
        raise _Lost(f"no worker within {patience:.0f} s") from error
    versions = versions_here()
    futures: dict[Any, int] = {}

    def submit(number: int) -> None:
        # Pure functions would be known by their arguments, which takes long to hash.
        future = client.submit(_one, work, there, undone[number], versions, pure=False)
        futures[future] = number

    for number in undone:
        submit(number)
    while True:
        try:
            while len(futures) < AHEAD * max(1, sum(client.nthreads().values())):
                following = next(pieces, None)
                if following is None:
                    break
                undone[following[0]] = following[1]
                submit(following[0])
            if not futures:
                return
            finished = [(futures.pop(future), future.result()) for future in _finished(client, list(futures))]
        except lost as error:
            raise _Lost(f"{type(error).__name__}: {error}") from error
        for number, result in finished:
            del undone[number]
            yield number, result


def _finished(client: Any, futures: list[Any]) -> list[Any]:
    """Wait for some to be done. A scheduler that went away, or forgot what it was to do, is noticed within seconds."""
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
                raise OSError("no worker is at work although work is left") from None


def _one(work: ClusterWork, shared: Any, piece: Any, versions: dict[str, str]) -> Any:
    """What a worker does."""
    here = versions_here()
    if here != versions:
        other = ", ".join(f"{name} {here[name]} for {versions[name]}" for name in here if here[name] != versions[name])
        raise InputError(f"a worker has {other}: results would not be the same")
    return work(shared, piece)


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
