"""Parts of one long computation, divided among the cores of this machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TypeVar

from bayestouch.parallel.processes import on_cores

Part = TypeVar("Part")
Result = TypeVar("Result")
#: Work of less time than this, seconds, is not divided: to start processes takes some tens of milliseconds.
WORTH = 0.5


def of_parts(work: Callable[[Part], Result], parts: Sequence[Part]) -> list[Result]:
    """Return the result of `work` for each part, in order; the results do not depend on the number of cores.

    The first part is computed here, which shows how long the others will take. They are divided if this is worth it and
    a fork is safe.

    Parameters
    ----------
    work : callable
        Function of a part. Its results can be pickled; nothing else that it changes is kept.
    parts : sequence
        The parts.
    """
    begun = time.perf_counter()
    first = [work(part) for part in parts[:1]]
    others = parts[1:]
    worth = (time.perf_counter() - begun) * len(others) > WORTH
    return [*first, *(on_cores if worth else map)(work, others)]
