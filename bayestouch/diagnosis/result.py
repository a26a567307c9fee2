"""What `bayestouch.diagnose` returns."""

from __future__ import annotations

import copy
import html
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayestouch.diagnosis.numbers import diagnosis_numbers
from bayestouch.diagnosis.outcome import sentences
from bayestouch.diagnosis.traced import Traced
from bayestouch.errors import few
from bayestouch.output.summary import Summarised
from bayestouch.results.objects import Calibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Summarised):
    """A diagnosed sensor.

    Attributes
    ----------
    numbers : mapping
        What ``diagnosis.json`` holds.
    calibration_before, calibration_after : Calibration
        Without effects, and with all that was found; `bayestouch.infer` uses either.
    options : mapping
        With which `bayestouch.diagnose` was called.
    traced : Traced
        Models, residuals and rounds of the search behind the numbers.
    """

    numbers: Mapping[str, Any]
    calibration_before: Calibration
    calibration_after: Calibration
    options: Mapping[str, Any]
    traced: Traced

    @classmethod
    def of(cls, traced: Traced, options: Mapping[str, Any]) -> Diagnosis:
        """Sum up what was traced."""
        return cls(diagnosis_numbers(traced), traced.before.calibration, traced.after.calibration, options, traced)

    @property
    def verdict(self) -> str:
        """``adequate``, ``explained``, ``partly explained`` or ``unattributed``."""
        return str(self.numbers["verdict"])

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that were found, in the order in which they were added."""
        return tuple(each["name"] for each in self.numbers["effects"])

    def to_dict(self) -> dict[str, Any]:
        """What ``diagnosis.json`` holds."""
        return copy.deepcopy(dict(self.numbers))

    def save(self, folder: str | Path) -> None:
        """Write calibrations, ``model.toml``, ``diagnosis.json``, figures and ``repeat.py`` into a folder.

        The files are written to a temporary folder first, which is moved when complete.

        Raises
        ------
        InputError
            The folder cannot be written to.
        """
        from bayestouch.diagnosis.writing import write_diagnosis
        from bayestouch.output.files import new_folder

        with new_folder(Path(folder)) as new:
            write_diagnosis(self.traced, self.numbers, self.options, new)

    def to_dataframe(self) -> DataFrame:
        """Effects that were found, a row for each of their parameters.

        Columns ``effect``, ``stage``, ``parameter``, ``mean``, ``sd``, ``unit``, and of the effect ``elpd_gain`` with
        ``elpd_gain_se`` (held-out log density) and ``explained_fraction``.
        """
        from bayestouch.diagnosis.plots import effect_table

        return effect_table(self.numbers)

    def to_arviz(self) -> Any:
        """Draws of the calibration after, effects' parameters among them."""
        return self.calibration_after.to_arviz()

    def plot_errors(self, axes: Axes | None = None) -> Axes:
        """Rms residual of held-out touches by element in percent of its peak, before and after.

        Raises
        ------
        InputError
            No touches were held out.
        """
        from bayestouch.diagnosis.plots import plot_errors

        return plot_errors(self.traced, axes)

    def plot_candidates(self, number: int = 1, axes: Axes | None = None) -> Axes:
        """What each effect that was tried explains of what can be explained, in one round (from 1) of the search.

        Raises
        ------
        InputError
            There was no such round.
        """
        from bayestouch.diagnosis.plots import plot_candidates

        return plot_candidates(self.traced, number, axes)

    def __str__(self) -> str:
        return "\n".join(sentences(self.numbers))

    def _repr_html_(self) -> str:
        verdict, *lines = (html.escape(line) for line in sentences(self.numbers))
        return f"<p><strong>{verdict}</strong></p>" + "".join(f"<p>{line}</p>" for line in lines)

    def summary_lines(self) -> list[str]:
        """Lines of the ``repr``."""
        verdict, *_, errors = sentences(self.numbers)
        found = few(list(self.effects), 8) if self.effects else "none"
        return [
            f"Diagnosis of {self.calibration_before.sensor.in_short}",
            verdict,
            f"effects found: {found}",
            errors,
        ]
