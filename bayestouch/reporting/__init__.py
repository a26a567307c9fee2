"""Reliability report: which estimates of a sensor can be trusted, and at which locations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayestouch.data.dataset import DataSet
from bayestouch.errors import InputError, shown
from bayestouch.output.progress import Progress, require_progress, staged
from bayestouch.output.summary import Summarised, path_in_short
from bayestouch.output.text import number, plural
from bayestouch.results.objects import Calibration, TouchPosteriors

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

__all__ = ["Report", "report"]


@dataclass(frozen=True, eq=False, repr=False)
class Report(Summarised):
    """A report that was written to a folder.

    Attributes
    ----------
    path : Path
        Folder with ``index.html``, ``report.json``, ``figures``, ``calibration.nc``, ``posterior.nc``.
    numbers : mapping
        Content of ``report.json``: every number of the page.
    figures : tuple of Path
        Paths of the figures.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> report = bayestouch.report(dataset, "my-report", diagnosis=False)
    >>> sorted(each.name for each in report.path.iterdir())
    ['calibration.nc', 'figures', 'index.html', 'posterior.nc', 'report.json']
    >>> for each in report.numbers["answer"]["headline"]:  # as on the first screen
    ...     print(f"{each['quantity']}: {each['kind']} {each['value']:.1g} {each['unit']}")
    location θ: rms error 0.05 degree
    load: rms error 6 N/m
    composite radius R: rms error 0.4 mm
    """

    path: Path
    numbers: Mapping[str, Any]
    figures: tuple[Path, ...]

    @property
    def calibration(self) -> Calibration:
        """Calibration, read from its file."""
        from bayestouch.results.reading import load_calibration

        return load_calibration(self.path / "calibration.nc")

    @property
    def posteriors(self) -> TouchPosteriors:
        """Posteriors of the touches, read from their file."""
        from bayestouch.results.reading import load_touches

        return load_touches(self.path / "posterior.nc")

    def to_dataframe(self) -> DataFrame:
        """Key numbers: one row for each ``quantity``, with ``value``, ``unit`` and ``detail`` (text)."""
        import pandas as pd

        return pd.DataFrame(self.numbers["answer"]["key_numbers"])

    def to_arviz(self) -> Any:
        """Draws of the touches, see `bayestouch.TouchPosteriors.to_arviz`."""
        return self.posteriors.to_arviz()

    def plot_estimates(self, name: str, axes: Axes | None = None) -> Axes:
        """Plot posterior mean and 90 % interval of every touch against its reference value."""
        return self.posteriors.plot_estimates(name, axes)

    def _repr_html_(self) -> str:
        from html import escape

        rows = "".join(
            f"<dt>{escape(row['question'])}</dt>"
            f"<dd><strong>{escape(row['short'])}.</strong> {escape(row['reason'])}</dd>"
            for row in self.numbers["answer"]["verdict"]
        )
        return f"<dl>{rows}</dl><p>{escape(str(self.path / 'index.html'))}</p>"

    def __str__(self) -> str:
        return " ".join(self.numbers["answer"]["sentences"])

    def summary_lines(self) -> list[str]:
        """Lines that ``repr`` shows."""
        answer = self.numbers["answer"]
        verdict = [f"{row['question']} {row['short']}." for row in answer.get("verdict", ())]
        keys = [f"{row['quantity']}: {number(row['value'])} {row['unit']}".rstrip() for row in answer["key_numbers"]]
        first = f"Report in {path_in_short(self.path)}, {plural(len(self.figures), 'figure')}"
        return [first, *verdict, *([", ".join(keys)] if keys else [])]


def report(
    dataset: DataSet | None,
    output: str | Path,
    *,
    seed: int = 0,
    draws: int = 1024,
    plug_in: bool = False,
    diagnosis: bool | str | Path = True,
    baselines: bool = False,
    progress: Progress | None = None,
) -> Report:
    """Report on the reliability of a sensor; this calibrates, infers all touches and writes the report.

    Parameters
    ----------
    dataset : DataSet or None
        Sensor and touches. If None, the report is on the simulated finger of the package and includes the tables of
        the paper.
    output : str or Path
        Folder to write; it is created if necessary. An earlier report in it is replaced when the new one is complete.
    seed : int
        Seed of every random number. The same data, version and seed give the same report.
    draws : int
        Draws of a touch. More than the default are also more draws of the calibration, in the same ratio.
    plug_in : bool
        Assume that the calibration is exact.
    diagnosis : bool or path
        True to search for effects that are missing from the model (a short run, without inference of the held-out
        touches on a finger), or the folder of a saved diagnosis.
    baselines : bool
        On a pad, also read the held-out touches of the diagnosis by regression without physics, a Gaussian process and
        a polynomial (`bayestouch.baselines`); the page has their errors between those before and after. It needs
        scikit-learn and a diagnosis that is made with the report, and takes minutes with thousands of touches.
    progress : callable, optional
        Function that is called with the fraction of the work that is done.

    Returns
    -------
    Report
        The folder, and the content of ``report.json``.

    Raises
    ------
    InputError
        As in `bayestouch.calibrate` and `bayestouch.infer`, if the folder cannot be written, if `diagnosis` is neither
        True nor False nor a path, or if `baselines` are wanted of a finger, beside a saved diagnosis or none, or
        without scikit-learn.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> report = bayestouch.report(dataset, "my-report", diagnosis=False)
    >>> (report.path / "index.html").is_file()
    True
    >>> len(report.posteriors), report.calibration.sensor.n_elements
    (45, 4)
    """
    from bayestouch.data.dataset import require_dataset
    from bayestouch.data.files import path_of
    from bayestouch.output.files import new_folder
    from bayestouch.reporting.gather import GATHERED, gather
    from bayestouch.reporting.writing import drafted, write_report

    require_progress(progress)
    if dataset is not None:
        require_dataset(dataset)
    output = path_of(output)
    if not isinstance(diagnosis, bool | str | PathLike):
        raise InputError(f"diagnosis: expected True, False or the folder of a saved diagnosis, got {shown(diagnosis)}")
    wanted = diagnosis if isinstance(diagnosis, bool) else Path(diagnosis)
    with new_folder(output) as folder:
        draft, diagnosed = gather(
            dataset,
            partial(drafted, folder),
            seed=seed,
            draws=draws,
            plug_in=plug_in,
            diagnosis=wanted,
            baselines=baselines,
            progress=progress,
        )
        writing = staged(progress, GATHERED, 1.0, "write the page")
        numbers = write_report(draft, diagnosed, folder)
    if writing is not None:
        writing(1.0)
    return Report(output, numbers, tuple(output / figure["file"] for figure in numbers["figures"]))
