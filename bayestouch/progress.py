"""Progress bar on the terminal for tasks that take longer than two seconds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

# Function that is called with the fraction of the work that is done, between 0 and 1.
Progress = Callable[[float], None]


@contextmanager
def progress_bar(label: str, quiet: bool) -> Iterator[Progress]:
    """Yield a function that shows progress on standard error after two seconds; no bar if `quiet` or no terminal."""
    from tqdm import tqdm

    # Without the monitor thread of tqdm, because a process with threads cannot fork safely.
    tqdm.monitor_interval = 0
    layout = "{desc}: {percentage:3.0f}%|{bar}| {elapsed} so far, {remaining} left"
    with tqdm(total=1.0, desc=label, delay=2.0, disable=quiet or None, leave=False, bar_format=layout) as bar:

        def advance(fraction: float) -> None:
            bar.update(max(fraction - bar.n, 0.0))

        yield advance
