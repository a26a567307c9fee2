"""Result of `bayestouch.diagnose`."""

from __future__ import annotations

import copy
import html
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayestouch.diagnosis.numbers import diagnosis_numbers
from bayestouch.diagnosis.outcome import (
    before_and_after,
    probable_causes,
    sentences,
    verdict_sentence,
    worse_lines,
)
from bayestouch.diagnosis.traced import Traced
from bayestouch.errors import few
from bayestouch.output.summary import Summarised
from bayestouch.results.objects import Calibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

    from bayestouch.data.dataset import DataSet


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Summarised):
    """Result of a diagnosis: effects that were found, and models with and without them.

    Attributes
    ----------
    numbers : mapping
        Content of ``diagnosis.json``.
    calibration_before, calibration_after : Calibration
        Calibrations without effects, and with what was found and is used; `bayestouch.infer` can read with both.
    options : mapping
        Options with which `bayestouch.diagnose` was called.
    traced : Traced
        Models, residuals and rounds of the search from which the numbers were made.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, effects={"crosstalk": 0.05}, seed=3).dataset
    >>> diagnosis = bayestouch.diagnose(dataset, draws=200, sample=False)
    >>> diagnosis.verdict, diagnosis.effects
    ('explained', ('crosstalk',))
    >>> touches = bayestouch.infer(dataset.touches, diagnosis.calibration_after, draws=256)
    >>> len(touches)
    45
    """

    numbers: Mapping[str, Any]
    calibration_before: Calibration
    calibration_after: Calibration
    options: Mapping[str, Any]
    traced: Traced

    @classmethod
    def of(cls, traced: Traced, dataset: DataSet, options: Mapping[str, Any]) -> Diagnosis:
        """Diagnosis of a data set from the results of the search."""
        numbers = diagnosis_numbers(traced, dataset)
        return cls(numbers, traced.before.calibration, traced.after.calibration, options, traced)

    @property
    def verdict(self) -> str:
        """Verdict: ``adequate``, ``explained``, ``partly explained`` or ``unattributed``."""
        return str(self.numbers["verdict"])

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that were found, in the order in which they were added."""
        return tuple(each["name"] for each in self.numbers["effects"])

    @property
    def causes(self) -> dict[tuple[str, ...], float]:
        """Probability of each set of causes that the search tried, by their names, most probable first.

        The probabilities sum to one. Besides effects, names are ``something in place`` (smooth functions of the place
        touched), ``something in time`` (a drift that was not added), ``something in single touches`` (errors that
        follow neither time nor place, as of places that are wrong at random), ``something else`` (a cause that was not
        tried; in a set with others it is there beside them) and ``nothing``.
        """
        return {tuple(each["names"]): each["probability"] for each in self.numbers["causes"]}

    def to_dict(self) -> dict[str, Any]:
        """Content of ``diagnosis.json``, as a copy."""
        return copy.deepcopy(dict(self.numbers))

    def save(self, folder: str | Path) -> None:
        """Write calibrations, ``model.toml``, ``diagnosis.json``, figures and ``repeat.py`` to a folder.

        The files are written to a temporary folder first, which is moved when complete.

        Raises
        ------
        InputError
            If the folder cannot be written.
        """
        from bayestouch.diagnosis.writing import write_diagnosis
        from bayestouch.output.files import new_folder

        with new_folder(Path(folder)) as new:
            write_diagnosis(self.traced, self.numbers, self.options, new)

    def to_dataframe(self) -> DataFrame:
        """Table of the effects that were found, one row for each of their parameters.

        The columns are ``effect``, ``stage``, ``parameter``, ``mean``, ``sd``, ``unit`` and, for the whole effect,
        ``elpd_gain`` and ``elpd_gain_se`` (held-out log density) and ``explained_fraction``.
        """
        from bayestouch.diagnosis.plots import effect_table

        return effect_table(self.numbers)

    def to_arviz(self) -> Any:
        """Draws of the final calibration, including the parameters of the effects, as an ArviZ object."""
        return self.calibration_after.to_arviz()

    def plot_errors(self, axes: Axes | None = None) -> Axes:
        """Plot the rms residual of held-out touches by element, in percent of its peak, before and after.

        Raises
        ------
        InputError
            If no touches were held out.
        """
        from bayestouch.diagnosis.plots import plot_errors

        return plot_errors(self.traced, axes)

    def plot_candidates(self, number: int = 1, axes: Axes | None = None) -> Axes:
        """Plot, for one round of the search (from 1), the share that each effect explains of what can be explained.

        Raises
        ------
        InputError
            If there is no such round.
        """
        from bayestouch.diagnosis.plots import plot_candidates

        return plot_candidates(self.traced, number, axes)

    def __str__(self) -> str:
        return "\n".join(sentences(self.numbers))

    def _repr_html_(self) -> str:
        verdict, *lines = (html.escape(line) for line in sentences(self.numbers))
        return f"<p><strong>{verdict}</strong></p>" + "".join(f"<p>{line}</p>" for line in lines)

    def summary_lines(self) -> list[str]:
        """Lines that ``repr`` shows."""
        found = few(list(self.effects), 8) if self.effects else "none"
        causes = ", ".join(f"{each['name']} {each['text']}" for each in probable_causes(self.numbers, 3))
        return [
            f"Diagnosis of {self.calibration_before.sensor.in_short}",
            *worse_lines(self.numbers),
            verdict_sentence(self.numbers),
            f"effects found: {found}",
            f"probabilities of causes: {causes}",
            *before_and_after(self.numbers),
        ]
