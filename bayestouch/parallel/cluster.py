"""Parallel computation on an existing Dask cluster: blocks of touches, candidates of a diagnosis, cases of a study.

The results are the same as without a cluster. The result of a piece depends only on the piece: not on the worker, the
time or the number of attempts. The loss of a worker therefore costs only time.
"""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from importlib.metadata import version
from itertools import islice
from typing import Any

from bayestouch.errors import InputError, shown
from bayestouch.parallel.processes import on_cores

#: Function that computes one piece of work from the data common to all pieces and the piece.
ClusterWork = Callable[[Any, Any], Any]
#: Seconds to wait for a scheduler that does not answer or has no workers.
PATIENCE = 30.0
#: Number of pieces sent to each thread of a worker, so that the next piece is there when one is finished.
AHEAD = 2


def require_address(scheduler: object) -> None:
    """Raise an error unless an option is the address of a scheduler, or None.

    Raises
    ------
    InputError
        It is no text.
    """
    if not isinstance(scheduler, str | None):
        raise InputError(f"scheduler: expected an address, such as 'tcp://10.0.0.5:8786', got {shown(scheduler)}")


def on_cluster(
    address: str, work: ClusterWork, shared: Any, pieces: Iterable[tuple[int, Any]], patience: float | None = None
) -> Iterator[tuple[int, Any]]:
    """Yield the result of `work` for every piece, computed on the cluster with its scheduler at `address`.

    Parameters
    ----------
    address : str
        Address of the scheduler, such as ``tcp://10.0.0.5:8786``.
    work : callable
        Function of `shared` and one piece. The workers must be able to import it, or it is defined in the script
        that was started.
    shared : object
        Data common to all pieces; sent once to each worker.
    pieces : iterable of (int, object)
        Number and content of each piece; taken when workers become free.
    patience : float, optional
        Seconds to wait for a scheduler and its workers, `PATIENCE` by default.

    Yields
    ------
    number, result
        In the order in which they are finished.

    Raises
    ------
    InputError
        `distributed` is not installed, the scheduler cannot be reached or disappears, there are no workers or they have
        other versions of the packages, or no worker computes the remaining pieces.
    """
    seconds = PATIENCE if patience is None else patience
    with _client(address, seconds) as client, _errors_in_one_line(address):
        yield from _results(client, seconds, work, shared, iter(pieces))


def in_order(
    address: str | None,
    work: ClusterWork,
    shared: Any,
    pieces: Sequence[Any],
    progress: Callable[[int], None] = lambda number: None,
) -> list[Any]:
    """Return the result of `work` for every piece, in order.

    The cluster at `address` computes them, or the cores of this machine if `address` is None. `progress` is called with
    the number of finished pieces.
    """
    if not pieces:
        return []
    done = {}
    for number, result in _finished(address, work, shared, pieces):
        done[number] = result
        progress(len(done))
    return [done[number] for number in sorted(done)]


def _finished(address: str | None, work: ClusterWork, shared: Any, pieces: Sequence[Any]) -> Iterator[tuple[int, Any]]:
    """Number and result of each piece, as they are finished."""
    if address is None:
        return enumerate(on_cores(partial(work, shared), pieces))
    return on_cluster(address, work, shared, enumerate(pieces))


def _results(
    client: Any, patience: float, work: ClusterWork, shared: Any, pieces: Iterator[tuple[int, Any]]
) -> Iterator[tuple[int, Any]]:
    """Yield the results of the pieces, a few at a time on the cluster; Dask repeats a piece if its worker fails."""
    client.wait_for_workers(1, timeout=patience)
    # A task, because Dask repeats it if a worker fails with its result. Scattered data would be lost, and if a worker
    # fails while data are scattered, the scheduler can wait for ever.
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Sending large graph", category=UserWarning)
        there = client.submit(pickle.loads, pickle.dumps(shared), pure=False)
    versions = versions_here()
    futures: dict[Any, int] = {}

    def submit() -> list[Any]:
        """Submit pieces to free workers; not as pure functions, because hashing their arguments is slow."""
        room = AHEAD * max(1, sum(client.nthreads().values())) - len(futures)
        more = {
            client.submit(_on_worker, work, there, piece, versions, pure=False): number
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
            result = future.result(timeout=patience)  # if the worker failed with the result, it is computed again
        except TimeoutError:  # a lost scheduler cancels its tasks, but lost workers cause no error
            idle = 0 if any(client.processing().values()) else idle + 1
            if idle > 1:
                raise TimeoutError("no worker is at work although work is left") from None
            finished = watch()
            continue
        number, idle = futures.pop(future), 0
        finished.update(submit())
        yield number, result


@contextmanager
def _errors_in_one_line(address: str) -> Iterator[None]:
    """Turn errors of a lost scheduler or worker into an `InputError` of one line."""
    killed = _distributed().scheduler.KilledWorker
    try:
        yield
    except (OSError, TimeoutError, CancelledError, killed) as error:
        raise InputError(f"the cluster at {address} does no work: {type(error).__name__}: {error}") from error


def _on_worker(work: ClusterWork, shared: Any, piece: Any, versions: dict[str, str]) -> Any:
    """Compute one piece on a worker, after a check of its package versions."""
    here = versions_here()
    if here != versions:
        other = ", ".join(f"{name} {here[name]} for {versions[name]}" for name in here if here[name] != versions[name])
        raise InputError(f"a worker has {other}: results would not be the same")
    return work(shared, piece)


def versions_here() -> dict[str, str]:
    """Return the versions of the packages that determine the results."""
    return {name: version(name) for name in ("bayestouch", "numpy", "scipy", "emcee")}


@contextmanager
def _client(address: str, patience: float) -> Iterator[Any]:
    distributed = _distributed()
    try:
        _check_port(address)
        client = distributed.Client(address, timeout=patience, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"no scheduler answers at {address}: {error}") from error
    try:
        yield client
    finally:
        client.close()


def _check_port(address: str) -> None:
    """Raise ValueError for an address without a port, for which a client would wait in vain."""
    addressing = import_module("distributed.comm.addressing")
    scheme, place = addressing.parse_address(address)
    if scheme in ("tcp", "tls"):
        addressing.parse_host_port(place)


def _distributed() -> Any:
    try:
        return import_module("distributed")
    except ImportError:
        message = "a cluster needs distributed, which is not installed: pip install 'bayestouch[cluster]'"
        raise InputError(message) from None
