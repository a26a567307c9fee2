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
from itertools import islice
from typing import Any

from bayestouch.errors import InputError

#: Does one piece of work, given what all pieces share.
ClusterWork = Callable[[Any, Any], Any]
#: How long a scheduler that does not answer, or has no workers, is waited for, in seconds.
PATIENCE = 30.0
#: Pieces given to a worker's thread: the next one waits there when one is done.
AHEAD = 2


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
        `distributed` is not installed, the scheduler cannot be reached or goes away, there are no workers or they have
        other versions of what computes, or nobody works at what is left.
    """
    seconds = PATIENCE if patience is None else patience
    with _client(address, seconds) as client, _told(address):
        yield from _done(client, seconds, work, shared, iter(pieces))


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


def _done(
    client: Any, patience: float, work: ClusterWork, shared: Any, pieces: Iterator[tuple[int, Any]]
) -> Iterator[tuple[int, Any]]:
    """Do the pieces, a few of them on the cluster at a time. A piece whose worker dies is done again by Dask."""
    client.wait_for_workers(1, timeout=patience)
    # A task, which Dask does again where a worker dies with its result. What is scattered would be lost, and a worker
    # that dies while something is scattered can leave the scheduler waiting for ever.
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
        there = client.submit(pickle.loads, pickle.dumps(shared), pure=False)
    versions = versions_here()
    futures: dict[Any, int] = {}

    def submit() -> list[Any]:
        """Give the workers what they lack. Pure functions would be known by their arguments, slow to hash."""
        room = AHEAD * max(1, sum(client.nthreads().values())) - len(futures)
        more = {
            client.submit(_one, work, there, piece, versions, pure=False): number
            for number, piece in islice(pieces, max(0, room))
        }
        futures.update(more)
        return list(more)

    def watch() -> Any:
        return _distributed().as_completed(list(futures), loop=client.loop, timeout=patience)

    submit()
    finished, idle = watch(), 0
    while futures:
        try:
            future = next(finished)
            result = future.result(timeout=patience)  # its worker may have gone with it: it is then made once more
        except TimeoutError:  # a scheduler that went away cancels what it was to do, but of lost workers nobody tells
            idle = 0 if any(client.processing().values()) else idle + 1
            if idle > 1:
                raise TimeoutError("no worker is at work although work is left") from None
            finished = watch()
            continue
        number, idle = futures.pop(future), 0
        finished.update(submit())
        yield number, result


@contextmanager
def _told(address: str) -> Iterator[None]:
    """Errors of a cluster of which something went away, in one line."""
    killed = _distributed().scheduler.KilledWorker
    try:
        yield
    except (OSError, TimeoutError, CancelledError, killed) as error:
        raise InputError(f"the cluster at {address} does no work: {type(error).__name__}: {error}") from error


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
