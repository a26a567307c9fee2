"""Two sensors, or one sensor twice, side by side: before and after a repair, this finger and the next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayestouch.data.dataset import DataSet
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised, path_in_short
from bayestouch.output.text import plural
from bayestouch.progress import Progress
from bayestouch.results.objects import Calibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

__all__ = ["Comparison", "compare"]


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Summarised):
    """A written comparison.

    Attributes
    ----------
    path : Path
        Its folder: ``index.html``, ``comparison.json``, ``figures``; of data sets also a report of each, in
        ``first`` and ``second``.
    numbers : mapping
        What ``comparison.json`` holds.
    """

    path: Path
    numbers: Mapping[str, Any]

    def __str__(self) -> str:
        return " ".join(self.numbers["sentences"])

    def _repr_html_(self) -> str:
        from bayestouch.results.html import html_table

        rows = [[str(each) for each in row.values()] for row in self.to_dataframe().head(12).to_dict("records")]
        return f"<p>{self}</p>{html_table(self.to_dataframe().columns, rows)}"

    def to_dataframe(self) -> DataFrame:
        """A row for each parameter (and element): both means and sds, and the difference in standard deviations."""
        import pandas as pd

        return pd.DataFrame(self.numbers["parameters"])

    def plot_parameter(self, name: str, axes: Axes | None = None) -> Axes:
        """A parameter of both by element, less the mean of both; 90 % intervals.

        Raises
        ------
        InputError
            There is no parameter of this name that both have by element.
        """
        from bayestouch.reporting.comparison.plots import plot_compared_parameter

        return plot_compared_parameter(self.numbers["parameters"], name, axes)

    def summary_lines(self) -> list[str]:
        """Lines of the ``repr``."""
        rows = len(self.numbers["parameters"])
        first = f"Comparison in {path_in_short(self.path)}: {plural(rows, 'parameter')}, those of each element apart"
        return [first, *self.numbers["sentences"]]


def compare(
    first: DataSet | Calibration,
    second: DataSet | Calibration,
    output: str | Path,
    *,
    seed: int = 0,
    draws: int = 1024,
    diagnosis: bool = True,
    progress: Progress | None = None,
) -> Comparison:
    """Put two data sets, or two calibrations, side by side.

    Parameters
    ----------
    first, second : DataSet or Calibration
        Both of a kind, and both of a finger or both of a pad.
    output : str or Path
        Folder to write; made if need be.
    seed, draws, diagnosis
        As in `bayestouch.report`, for data sets.
    progress : callable, optional
        Called with the fraction done.

    Raises
    ------
    InputError
        The two are not of a kind, or as `bayestouch.report`.
    """
    from bayestouch.output.files import new_folder
    from bayestouch.reporting import report
    from bayestouch.reporting.comparison.numbers import compared
    from bayestouch.reporting.comparison.writing import write_comparison

    if isinstance(first, Calibration) is not isinstance(second, Calibration):
        raise InputError("expected two data sets or two calibrations, got one of each")
    if first.sensor.body.kind != second.sensor.body.kind:
        raise InputError("expected two fingers or two pads, got one of each")
    with new_folder(Path(output)) as folder:
        sides: list[tuple[Calibration, Mapping[str, Any] | None]] = []
        for number, (name, each) in enumerate((("first", first), ("second", second))):
            if isinstance(each, Calibration):
                sides.append((each, None))
                continue

            def advance(done: float, number: int = number) -> None:
                if progress is not None:
                    progress((number + done) / 2)

            written = report(each, folder / name, seed=seed, draws=draws, diagnosis=diagnosis, progress=advance)
            sides.append((written.calibration, written.numbers))
        numbers = compared(sides[0], sides[1])
        write_comparison(numbers, folder)
    return Comparison(Path(output), numbers)
