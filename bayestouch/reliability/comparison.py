"""Comparison of all numbers that the paper printed with those of this package."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised
from bayestouch.paper import published

_COLUMNS = ("number", "paper", "bayestouch", "90 %", "difference", "why")
_AFTER = ("after", "after, 90 %")


@dataclass(frozen=True, repr=False)
class Beside(Summarised):
    """A number of the paper and the corresponding number of this package.

    Attributes
    ----------
    key : str
        Key of `bayestouch.paper.published.number`.
    ours, low, high : float
        Number of this package, in the paper's unit, and its 90 % interval. The limits are NaN if there is no interval;
        all are NaN if the quantity has no counterpart here.
    why : str
        Reason for the difference, or basis of our number.
    put_in : bool
        True if our number is a setting of the simulation, so that agreement proves nothing.
    """

    key: str
    ours: float
    low: float = np.nan
    high: float = np.nan
    why: str = ""
    put_in: bool = False

    @property
    def paper(self) -> published.PublishedNumber:
        """The number as the paper printed it."""
        return published.number(self.key)

    @property
    def difference(self) -> float:
        """Our number minus the paper's."""
        return self.ours - self.paper.value

    @property
    def agrees(self) -> bool:
        """True if the printed number lies in our interval (or equals our number), allowing for its rounding."""
        low, high = (self.ours, self.ours) if np.isnan(self.low) else (self.low, self.high)
        slack = self.paper.rounding + 1e-9 * abs(self.paper.value)
        return bool(low - slack <= self.paper.value <= high + slack)


@dataclass(frozen=True, repr=False)
class PublishedComparison(Summarised):
    """All numbers that the paper printed, in its order, each with ours.

    Attributes
    ----------
    rows : tuple of Beside
        One row for each key of `bayestouch.paper.published.all_numbers`.
    """

    rows: tuple[Beside, ...]

    @classmethod
    def of(cls, rows: Iterable[Beside]) -> PublishedComparison:
        """Comparison with the rows in the order of the paper.

        Raises
        ------
        InputError
            If a printed number has no row, or more than one.
        """
        by_key: dict[str, Beside] = {}
        for row in rows:
            if row.key in by_key:
                raise InputError(f"two numbers to compare with {row.key}")
            by_key[row.key] = row
        keys = [number.key for number in published.all_numbers()]
        missing = [key for key in keys if key not in by_key]
        if missing:
            raise InputError(f"nothing to compare with {len(missing)} printed numbers: {', '.join(missing)}")
        return cls(tuple(by_key[key] for key in keys))

    @property
    def predicted(self) -> tuple[Beside, ...]:
        """Rows with a counterpart that is not a setting of the simulation."""
        return tuple(row for row in self.rows if not row.put_in and np.isfinite(row.ours))

    def counted(self) -> str:
        """Sentence with the number of rows of each kind."""
        predicted = self.predicted
        agree = sum(row.agrees for row in predicted)
        put_in = sum(row.put_in for row in self.rows)
        return (
            f"{len(self.rows)} printed numbers: {put_in} are settings of the simulation, "
            f"{len(self.rows) - put_in - len(predicted)} have no counterpart, and of the {len(predicted)} others "
            f"{agree} agree within rounding and the interval given."
        )

    def markdown(self, after: Mapping[str, Beside] | None = None) -> str:
        """Comparison as Markdown: a section for each table of the paper and one for its text.

        Parameters
        ----------
        after : mapping of Beside, optional
            Numbers by key as a second simulation has them, for two more columns; empty cells where it has none.
        """
        columns = _COLUMNS if after is None else (*_COLUMNS[:-1], *_AFTER, _COLUMNS[-1])
        header = f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}"
        sections = [("Table 1", "table_1."), ("Table 2", "table_2."), ("Table 3", "table_3["), ("Table 4", "table_4.")]
        out = [self.counted(), ""]
        done: set[str] = set()
        for title, start in sections:
            own = [row for row in self.rows if row.key.startswith(start)]
            rows = [row for row in own if row.paper.where.startswith(f"{title}, row")]
            done.update(row.key for row in rows)
            out += [f"## {title}", "", header, *(_line(row, after) for row in rows), ""]
        rest = [row for row in self.rows if row.key not in done]
        out += ["## Text and captions", "", header, *(_line(row, after) for row in rest)]
        return "\n".join(out) + "\n"


def shown_number(value: float, decimals: int = 0) -> str:
    """Number as text: three digits and at least `decimals` decimals, no exponent; a dash for NaN."""
    if np.isnan(value):
        return "–"
    if not np.isfinite(value) or abs(value - round(value)) < 1e-9:
        return f"{value:.0f}"
    return f"{value:.{max(decimals, 2 - int(np.floor(np.log10(abs(value)))))}f}"


def _line(row: Beside, after: Mapping[str, Beside] | None) -> str:
    unit = "" if row.paper.unit == "1" else f" {row.paper.unit}"
    ours, interval = _shown(row)
    sign = "+" if row.difference > 0 else ""
    difference = "0" if abs(row.difference) <= row.paper.rounding else sign + shown_number(row.difference)
    why = ("setting; " if row.put_in else "") + row.why
    second: tuple[str, ...] = ()
    if after is not None:
        second = _shown(after[row.key]) if row.key in after else ("", "")
    cells = (f"`{row.key}`", row.paper.printed + unit, ours, interval, difference, *second, why.rstrip("; "))
    return "| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |"


def _shown(row: Beside) -> tuple[str, str]:
    """Our number and its interval."""
    ours = shown_number(row.ours, len(row.paper.printed.partition(".")[2]))
    return ours, "" if np.isnan(row.low) else f"{shown_number(row.low)} to {shown_number(row.high)}"
