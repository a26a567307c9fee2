"""Comparison of two sensors, or of one sensor at two times, for example before and after a repair."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayestouch.data.dataset import DataSet
from bayestouch.errors import InputError, not_a
from bayestouch.output.progress import Progress, require_progress, staged
from bayestouch.output.summary import Summarised, path_in_short
from bayestouch.output.text import plural
from bayestouch.results.objects import Calibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

__all__ = ["Comparison", "compare"]


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Summarised):
    """A comparison that was written to a folder.

    Attributes
    ----------
    path : Path
        Folder with ``index.html``, ``comparison.json``, ``figures``. If data sets were compared, it also contains a
        report on each, in ``first`` and ``second``.
    numbers : mapping
        Content of ``comparison.json``.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> hertz = bayestouch.calibrate(dataset, contact="hertz", draws=200)
    >>> comparison = bayestouch.compare(calibration, hertz, "comparison")
    >>> sorted(each.name for each in comparison.path.iterdir())
    ['comparison.json', 'figures', 'index.html']
    >>> comparison.to_dataframe().columns[-3:].tolist()  # one row for each parameter
    ['second_mean', 'second_sd', 'difference_in_sd']
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
        """One row for each parameter and element: both means and sds, and the difference in standard deviations."""
        import pandas as pd

        return pd.DataFrame(self.numbers["parameters"])

    def plot_parameter(self, name: str, axes: Axes | None = None) -> Axes:
        """Plot a parameter of both sensors by element, minus the mean of both, with 90 % intervals.

        Raises
        ------
        InputError
            If no parameter with this name has a value for each element in both.
        """
        from bayestouch.reporting.comparison.plots import plot_compared_parameter

        return plot_compared_parameter(self.numbers["parameters"], name, axes)

    def summary_lines(self) -> list[str]:
        """Lines that ``repr`` shows."""
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
    """Comparison of two data sets or two calibrations, written to a folder.

    Parameters
    ----------
    first, second : DataSet or Calibration
        Two data sets or two calibrations, both of fingers or both of pads.
    output : str or Path
        Folder to write; it is created if necessary.
    seed, draws, diagnosis
        As in `bayestouch.report`; used for data sets.
    progress : callable, optional
        Function that is called with the fraction of the work that is done.

    Returns
    -------
    Comparison
        The folder, and the content of ``comparison.json``.

    Raises
    ------
    InputError
        If one is no data set and no calibration, the two are of different kinds, the output is no path, or as in
        `bayestouch.report`.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> hertz = bayestouch.calibrate(dataset, contact="hertz", draws=200)
    >>> table = bayestouch.compare(calibration, hertz, "comparison").to_dataframe()
    >>> table[table["difference_in_sd"].abs() > 3]["parameter"].tolist()  # the contact changes the shear modulus
    ['mu']
    """
    from bayestouch.data.files import path_of
    from bayestouch.output.files import new_folder
    from bayestouch.reporting import report
    from bayestouch.reporting.comparison.numbers import compared
    from bayestouch.reporting.comparison.writing import write_comparison

    require_progress(progress)
    for each in (first, second):
        if not isinstance(each, DataSet | Calibration):
            how = "bayestouch.load_dataset(folder) and bayestouch.load(file) read them"
            raise not_a("a data set or a calibration", each, how)
    if isinstance(first, Calibration) is not isinstance(second, Calibration):
        raise InputError("expected two data sets or two calibrations, got one of each")
    if first.sensor.body.kind != second.sensor.body.kind:
        raise InputError("expected two fingers or two pads, got one of each")
    output = path_of(output)
    with new_folder(output) as folder:
        sides: list[tuple[Calibration, Mapping[str, Any] | None]] = []
        for number, (name, each) in enumerate((("first", first), ("second", second))):
            if isinstance(each, Calibration):
                sides.append((each, None))
                continue
            side = staged(progress, number / 2, (number + 1) / 2, f"{name} sensor")
            written = report(each, folder / name, seed=seed, draws=draws, diagnosis=diagnosis, progress=side)
            sides.append((written.calibration, written.numbers))
        numbers = compared(sides[0], sides[1])
        write_comparison(numbers, folder)
    return Comparison(output, numbers)
