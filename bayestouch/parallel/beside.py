"""Two pieces of work at the same time: one in this process, one in a process forked from it."""

from __future__ import annotations

import multiprocessing
import warnings
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from bayestouch.parallel.processes import FOLLOWS, cores, follow_parent, may_fork, shared_empty

Here = TypeVar("Here")
Beside = TypeVar("Beside")
#: Function that is called with the fraction of the work that is done.
Tell = Callable[[float], None]
# Seconds between two looks at how far the other process is.
_LOOK = 0.2


def both(
    here: Callable[[], Here], beside: Callable[[Tell | None], Beside], tell: Tell | None = None
) -> tuple[Here, Beside]:
    """Results of two functions, the second of which another process computes beside this one.

    With one core, or if a fork is not safe, they are computed one after the other. So is the second one again if the
    other process gives no result, for example because of an error, which is then raised here.

    Parameters
    ----------
    here : callable
        Function without arguments.
    beside : callable
        Function of a progress, which may be None. Its result can be pickled, and should be small. Nothing else that it
        changes is kept.
    tell : callable, optional
        Progress of `beside`; it is called after `here` is done.

    Examples
    --------
    >>> both(lambda: max(["a", "abc"], key=len), lambda tell: sum(range(10)))
    ('abc', 45)
    """
    if cores(None) < 2 or not may_fork():
        return here(), beside(tell)
    done = shared_empty((1,))

    def count(fraction: float) -> None:
        done[0] = fraction

    fork = multiprocessing.get_context("fork")
    receiver, sender = fork.Pipe(duplex=False)
    process = fork.Process(target=_send, args=(beside, None if tell is None else count, sender))
    with warnings.catch_warnings():
        # Python warns of any thread; the threads of BLAS are idle and BLAS prepares them for a fork.
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    sender.close()
    try:
        result = here()
        while not receiver.poll(_LOOK):
            if tell is not None:
                tell(float(done[0]))
        with suppress(EOFError):
            return result, receiver.recv()
    finally:
        receiver.close()
        process.terminate()
        process.join()
    return result, beside(tell)


def _send(work: Callable[[Tell | None], Any], tell: Tell | None, sender: Connection) -> None:
    """Send the result of the work from the process that was forked; nothing if it fails."""
    follow_parent(FOLLOWS)
    with suppress(Exception, KeyboardInterrupt):
        sender.send(work(tell))
    sender.close()
