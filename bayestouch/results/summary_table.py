"""A data frame that prints all its columns."""

from __future__ import annotations

from shutil import get_terminal_size

import pandas as pd

#: Rows that are printed; of longer tables the first and the last.
ROWS = 20
#: Characters of a line that are left for the names of the rows, beside a column of text.
MARGIN = 20


class SummaryTable(pd.DataFrame):
    """Data frame whose text has every column, in blocks of columns where the terminal is narrow.

    By default pandas replaces the columns in the middle by dots: of a table of touches the location.
    """

    @property
    def _constructor(self) -> type[SummaryTable]:
        return SummaryTable

    def __repr__(self) -> str:
        width = get_terminal_size().columns
        text = self.to_string(
            max_rows=ROWS, line_width=width, max_colwidth=max(width - MARGIN, MARGIN), float_format=_number, na_rep=""
        )
        units = [f"{name} {unit}" for name, unit in self.attrs.get("units", {}).items() if name in self]
        return f"{text}\nunits: {', '.join(units)}" if units else text


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1e4 else f"{value:.4g}"
