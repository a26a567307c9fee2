"""Check of a data set before any computation: contents, unusual features and missing information."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayestouch.data.dataset import DataSet, require_dataset
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

__all__ = ["DataCheck", "check"]


@dataclass(frozen=True, eq=False, repr=False)
class DataCheck(Summarised):
    """Contents of a data set, unusual features and missing information.

    Attributes
    ----------
    dataset : DataSet
    facts : mapping
        All results of the check, as `bayestouch check --json` prints them: ``sensor``, ``tables``, ``indenters``,
        ``elements`` (one row each: peak and noise of its readings), ``advice``.
    notes : tuple of str
        Irregularities that were corrected while reading.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> checked = bayestouch.check(dataset)
    >>> [table["touches"] for table in checked.facts["tables"]]  # calibration, touches
    [54, 45]
    >>> checked.to_dataframe()["peak"].round(-2).tolist()  # largest mean reading of each element
    [1100.0, 1300.0, 1200.0, 900.0]
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
        """Text for a terminal: tables, a bar for each element, and advice."""
        from bayestouch.checking.text import body

        return body(self.facts)

    def __str__(self) -> str:
        return f"{self.title}{self.text}"

    def _repr_html_(self) -> str:
        from bayestouch.checking.text import html

        return html(self.facts)

    def to_dataframe(self) -> DataFrame:
        """Return a data frame with peak and noise of the readings, one row per element."""
        import pandas as pd

        return pd.DataFrame(self.facts["elements"])

    def plot_touches(self, axes: Axes | None = None) -> Axes:
        """Plot the touches: load over location, or the locations on a plane pad."""
        from bayestouch.checking.plots import plot_touches

        return plot_touches(self.dataset, axes)

    def plot_readings(self, axes: Axes | None = None) -> Axes:
        """Plot the mean reading of every element over location (over the touch number if no location is known)."""
        from bayestouch.checking.plots import plot_readings

        return plot_readings(self.dataset, axes)

    def save_plot(self, path: str | Path) -> None:
        """Write both plots to one image file; its suffix determines the format.

        Raises
        ------
        InputError
            The image cannot be written, or is none of .png, .svg and .pdf.
        """
        from matplotlib.figure import Figure

        from bayestouch.data.files import replacing

        kind = Path(path).suffix.lstrip(".").lower() or "png"
        # Other formats of Matplotlib need programs that may not be there, such as LaTeX.
        if kind not in ("png", "svg", "pdf"):
            raise InputError("expected a name that ends in .png, .svg or .pdf", file=path)
        figure = Figure(figsize=(8.0, 6.4), layout="constrained")
        above, below = figure.subplots(2, 1)
        self.plot_touches(above)
        self.plot_readings(below)
        with replacing(path) as temporary:
            figure.savefig(temporary, format=kind, dpi=110)

    def summary_lines(self) -> list[str]:
        """Lines of the ``repr``."""
        advice = self.facts["advice"]
        lacking = f"what these data lack: {' '.join(advice)}" if advice else "nothing is lacking for a report"
        return [f"DataCheck of {self.dataset.sensor.in_short}", *self.dataset.tables_in_short(), lacking]


def check(dataset: DataSet) -> DataCheck:
    """Return the contents of a data set, unusual features, and what is missing for a calibration or a report.

    Parameters
    ----------
    dataset : DataSet
        Data set from `bayestouch.load_dataset`, which raises an error if a file is wrong.

    Returns
    -------
    DataCheck
        Counts and ranges of both tables, peak and noise of each element, and advice on touches to add.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> checked = bayestouch.check(dataset)
    >>> for advice in checked.facts["advice"]:
    ...     print(advice.partition(":")[0])
    touches were made in the order of their places
    no reading without contact (depth, load or contact 0)
    """
    from bayestouch.checking.facts import dataset_facts

    require_dataset(dataset)
    return DataCheck(dataset, dataset_facts(dataset), dataset.notes)
