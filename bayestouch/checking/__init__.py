"""Check a data set before anything is computed with it: what it holds, what is odd, what it lacks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayestouch.data.dataset import DataSet
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

__all__ = ["DataCheck", "check"]


@dataclass(frozen=True, eq=False, repr=False)
class DataCheck(Summarised):
    """What a data set holds.

    Attributes
    ----------
    dataset : DataSet
    facts : mapping
        Everything the check found, as `bayestouch check --json` prints it: ``sensor``, ``tables``, ``indenters``,
        ``elements`` (one a row: peak and noise of its readings), ``advice``.
    notes : tuple of str
        What was handled in reading.
    """

    dataset: DataSet
    facts: Mapping[str, Any]
    notes: tuple[str, ...]

    @property
    def title(self) -> str:
        """Name and kind of the sensor, in one line."""
        from bayestouch.checking.text import title

        return title(self.facts)

    @property
    def text(self) -> str:
        """Tables, a bar for each element, and advice, for a terminal."""
        from bayestouch.checking.text import body

        return body(self.facts)

    def __str__(self) -> str:
        return f"{self.title}{self.text}"

    def _repr_html_(self) -> str:
        from bayestouch.checking.text import html

        return html(self.facts)

    def to_dataframe(self) -> DataFrame:
        """Peak and noise of every element's readings, a row each."""
        import pandas as pd

        return pd.DataFrame(self.facts["elements"])

    def plot_touches(self, axes: Axes | None = None) -> Axes:
        """Where the sensor was touched; load over location, or places on a plane pad."""
        from bayestouch.checking.plots import plot_touches

        return plot_touches(self.dataset, axes)

    def plot_readings(self, axes: Axes | None = None) -> Axes:
        """Mean reading of every element over location (over the number of the touch where none is known)."""
        from bayestouch.checking.plots import plot_readings

        return plot_readings(self.dataset, axes)

    def save_plot(self, path: str | Path) -> None:
        """Write both plots into one picture, of the kind that the file's name says.

        Raises
        ------
        InputError
            The picture cannot be written.
        """
        from matplotlib.figure import Figure

        from bayestouch.data.files import replacing

        kind = Path(path).suffix.lstrip(".").lower() or "png"
        figure = Figure(figsize=(8.0, 6.4), layout="constrained")
        above, below = figure.subplots(2, 1)
        self.plot_touches(above)
        self.plot_readings(below)
        with replacing(path) as temporary:
            try:
                figure.savefig(temporary, format=kind, dpi=110)
            except ValueError:
                raise InputError("expected a name that ends in .png, .svg or .pdf", file=path) from None

    def summary_lines(self) -> list[str]:
        """Lines of the ``repr``."""
        advice = self.facts["advice"]
        lacking = f"what these data lack: {' '.join(advice)}" if advice else "nothing is lacking for a report"
        return [f"DataCheck of {self.dataset.sensor.in_short}", *self.dataset.tables_in_short(), lacking]


def check(dataset: DataSet) -> DataCheck:
    """Look at a data set: what it holds, what is odd about it, and what it lacks for a calibration or a report.

    Parameters
    ----------
    dataset : DataSet
        As `bayestouch.load_dataset` reads it, which raises where a file is wrong.
    """
    from bayestouch.checking.facts import dataset_facts

    return DataCheck(dataset, dataset_facts(dataset), dataset.notes)
