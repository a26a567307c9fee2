"""Progress of long tasks: which fraction is done, in which stage, and the bar on the terminal that shows both."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from bayestouch.errors import InputError, shown

# Function that is called with the fraction of the work that is done, between 0 and 1.
Progress = Callable[[float], None]
# Characters of label and stages: in a terminal of 80 columns the rest has percentage, bar and times.
MOST_TEXT = 46


@dataclass(frozen=True)
class Stage:
    """Progress of one stage of a task: reports its own fraction as a fraction of the task.

    Attributes
    ----------
    task : callable
        Progress of the whole task. A bar, or a stage of a larger task, also learns the name.
    first, last : float
        Fraction of the task that is done when the stage begins, and when it ends.
    name : str
        Name of the stage, for the bar; empty if it has none.
    """

    task: Progress
    first: float
    last: float
    name: str = ""

    def __call__(self, fraction: float) -> None:
        self.tell(fraction, "")

    def tell(self, fraction: float, inner: str) -> None:
        """Report the fraction of this stage that is done, and the name of the stage within it."""
        done, name = self.first + (self.last - self.first) * fraction, ", ".join(filter(None, (self.name, inner)))
        tell(self.task, done, name)


@dataclass(frozen=True, eq=False)
class Bar:
    """Progress that is shown by a bar of tqdm.

    Attributes
    ----------
    label : str
        Name of the task.
    bar : tqdm
        The bar; its total is 1.
    """

    label: str
    bar: Any

    def __call__(self, fraction: float) -> None:
        self.tell(fraction, "")

    def tell(self, fraction: float, stage: str) -> None:
        """Show the fraction that is done, and the name of the stage; outer stages only where there is room."""
        self.bar.set_description_str(shortened(f"{self.label}: ", stage) if stage else self.label, refresh=False)
        self.bar.update(max(fraction - self.bar.n, 0.0))


def require_progress(progress: object) -> None:
    """Raise an error unless an option is a function, or None.

    Raises
    ------
    InputError
        It is something else.
    """
    if progress is not None and not callable(progress):
        raise InputError(f"progress: expected a function of the fraction that is done, got {shown(progress)}")


def shortened(label: str, stages: str) -> str:
    """Label with stages, outermost first, without the outer ones that make the text longer than `MOST_TEXT`."""
    while len(label) + len(stages) > MOST_TEXT and ", " in stages:
        stages = stages.partition(", ")[2]
    text = label + stages
    return text if len(text) <= MOST_TEXT else f"{text[: MOST_TEXT - 1]}…"


def tell(progress: Progress, fraction: float, stage: str) -> None:
    """Report the fraction that is done, and the name of what begins now if `progress` can show it."""
    if isinstance(progress, Stage | Bar):
        progress.tell(fraction, stage)
    else:
        progress(fraction)


def staged(progress: Progress | None, first: float, last: float, name: str = "") -> Progress | None:
    """Begin a stage, which takes the task from one fraction to another, and return its progress.

    The name is shown from now on. None without progress.
    """
    if progress is None:
        return None
    stage = Stage(progress, first, last, name)
    stage(0.0)
    return stage


@contextmanager
def progress_bar(label: str, quiet: bool) -> Iterator[Progress]:
    """Yield a function that shows progress on standard error after two seconds; no bar if `quiet` or no terminal.

    The bar shows the stage (see `staged`), the time so far and the time left.
    """
    from tqdm import tqdm

    # Without the monitor thread of tqdm, because a process with threads cannot fork safely.
    tqdm.monitor_interval = 0
    layout = "{desc} {percentage:3.0f}%|{bar}| {elapsed} so far, {remaining} left"
    # The time left is from the mean speed since the start: the speed of the last step is that of one stage.
    options = {"delay": 2.0, "disable": quiet or None, "leave": False, "bar_format": layout}
    with tqdm(total=1.0, desc=label, smoothing=0, miniters=0, **options) as bar:
        yield Bar(label, bar)
