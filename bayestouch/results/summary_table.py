"""A data frame that prints all its columns."""

from __future__ import annotations

from shutil import get_terminal_size
from textwrap import fill
from typing import Any

import pandas as pd

#: Rows that are printed; of longer tables the first and the last.
ROWS = 20
#: Characters of a line that are left for the names of the rows, beside a column of text.
MARGIN = 20


class SummaryTable(pd.DataFrame):
    """Data frame whose text has every column, in blocks of columns where the terminal is narrow.

    By default pandas replaces the columns in the middle by dots: of a table of touches the location. A column of long
    texts is below the others, one text a line, where pandas would cut the texts.
    """

    @property
    def _constructor(self) -> type[SummaryTable]:
        return SummaryTable

    def __repr__(self) -> str:
        if not self.columns.is_unique:  # two tables side by side
            return super().__repr__()
        width = get_terminal_size().columns
        long = [name for name in self.columns if self[name].map(lambda value: _length(value) > width / 2).any()]
        table = self.drop(columns=long) if len(self) <= ROWS else self
        text = table.to_string(
            max_rows=ROWS, line_width=width, max_colwidth=max(width - MARGIN, MARGIN), float_format=_number, na_rep=""
        )
        for name in (each for each in long if each not in table):
            rows = (f"{row}: {value}" for row, value in self[name].items() if value)
            lines = (fill(row, max(width, MARGIN), initial_indent="  ", subsequent_indent="    ") for row in rows)
            text = "\n".join([text, f"{name}:", *lines])
        units = [f"{name} {unit}" for name, unit in self.attrs.get("units", {}).items() if name in self]
        return f"{text}\nunits: {', '.join(units)}" if units else text


def _length(value: Any) -> int:
    """Number of characters of a text; 0 for a number."""
    return len(value) if isinstance(value, str) else 0


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1e4 else f"{value:.4g}"
