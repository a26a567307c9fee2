"""Fast reading of CSV rows with plain cells only: pandas reads many rows at a time.

Rows that are ambiguous or wrong are read one by one in `bayestouch.data.tables`.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from bayestouch.array_types import BoolArray, FloatArray, IntArray, ObjectArray
from bayestouch.data.cells import MISSING, NumberReader
from bayestouch.data.csv_lines import BOM

#: Words that pandas reads as a missing number.
_WORDS = ["", "NaN", "+NaN", "-NaN", *(form(word) for word in MISSING for form in (str, str.upper, str.capitalize))]


class PlainRows(NamedTuple):
    """Columns by name: numbers (NaN where missing) and texts, shape (n_rows,) each; and the number of rows."""

    numbers: dict[str, FloatArray]
    texts: dict[str, ObjectArray]
    n_rows: int


def plain_rows(
    block: bytes,
    first: int,
    names: Sequence[str],
    wanted: Collection[str],
    separator: str,
    reader: NumberReader,
) -> PlainRows | None:
    """Return the columns of lines that are one row each.

    Parameters
    ----------
    block : bytes
        Lines with their line ends.
    first : int
        Number of the first line in the file, counted from 1.
    names : sequence of str
        Names of the columns.
    wanted : collection of str
        Names of the columns that contain numbers.
    separator : str
        Separator between cells.
    reader : NumberReader
        Records the irregularities that are corrected.

    Returns
    -------
    PlainRows or None
        Numbers equal those of Python's `float`, to the last bit. None if a line is not a row of plain cells.
    """
    import pandas as pd

    if (cells := _Cells.of(block, len(names), separator)) is None:
        return None
    numeric = {k: name for k, name in enumerate(names) if name in wanted}
    # pandas reads a column of True and False as numbers, and may use Python's float, which accepts 1_000
    if any(cells.hold(letter, list(numeric)) for letter in "rRsS_"):
        return None
    marks = [mark for mark in ",." if cells.hold(mark, list(numeric))] if reader.decimal_comma else ["."]
    if len(marks) > 1 or (marks and reader.decimal not in (None, *marks)):
        return None
    options: dict[str, Any] = {
        "dtype": {k: np.float64 if k in numeric else object for k in range(len(names))},
        "na_values": dict.fromkeys(numeric, _WORDS),
        "keep_default_na": False,
        "decimal": marks[0] if marks else ".",
        "quoting": csv.QUOTE_NONE,
        "skip_blank_lines": False,
        "index_col": False,
        "low_memory": False,
    }
    # From version 3.1 pandas has only one number converter, which is exact, and warns if one is selected.
    if _version(pd.__version__) < (3, 1):
        options["float_precision"] = "round_trip"
    try:
        frame: pd.DataFrame = pd.read_csv(
            io.BytesIO(cells.data), sep=separator, header=None, names=range(len(names)), engine="c", **options
        )
    except ValueError:
        return None
    numbers = {name: np.array(frame[k], dtype=np.float64) for k, name in numeric.items()}
    missing = {k: rows for k, name in numeric.items() if len(rows := np.flatnonzero(np.isnan(numbers[name])))}
    # Only where a number is missing may a row be empty, or a cell hold a word.
    if (missing or not numeric) and cells.some_row_is_blank:
        return None
    words = {k: rows[~cells.empty[rows, k]].tolist() for k, rows in missing.items()}
    if any(cells.text(row, k).strip().lower() not in MISSING for k, rows in words.items() for row in rows):
        return None
    for k, rows in words.items():
        reader.take_words(len(rows), numeric[k], [first + row for row in rows[:1]])
    if reader.decimal_comma and marks:
        reader.decimal = marks[0]
    texts = {name: np.array(frame[k]) for k, name in enumerate(names) if k not in numeric}
    return PlainRows(numbers, texts, cells.n_rows)


@dataclass(frozen=True, eq=False)
class _Cells:
    """Rows as bytes, and the positions of their cells.

    Attributes
    ----------
    data : bytes
        Rows in UTF-8, each with a newline at its end.
    n_rows, width : int
        Number of rows and of columns.
    separator : str
        Separator between cells.
    """

    data: bytes
    n_rows: int
    width: int
    separator: str

    @classmethod
    def of(cls, data: bytes, width: int, separator: str) -> Self | None:
        """Return rows of `width` plain cells; None if a cell is not plain or the number of cells is not right.

        pandas has to find out that a row other than the first has more cells than the first, which it refuses.
        """
        data = data.replace(b"\r\n", b"\n") if b"\r" in data else data
        data += b"" if data.endswith(b"\n") else b"\n"
        # quotes may contain separators and line ends; pandas ends a cell at a zero byte, and skips a byte order mark in
        # every block
        if (
            width < 2
            or any(mark in data for mark in (b'"', b"\r", b"\0"))
            or data.startswith(BOM)
            or not _is_utf8(data)
        ):
            return None
        raw = np.frombuffer(data, np.uint8)
        ends = np.flatnonzero(raw == ord("\n"))
        if np.diff(ends, prepend=-1).max() > csv.field_size_limit():
            return None
        separators, in_first = (np.count_nonzero(part == ord(separator)) for part in (raw, raw[: ends[0]]))
        right = separators == (width - 1) * len(ends) and in_first == width - 1
        return cls(data, len(ends), width, separator) if right else None

    @cached_property
    def marks(self) -> IntArray:
        """Position after the last byte of each cell, shape (n_rows * width,)."""
        raw = np.frombuffer(self.data, np.uint8)
        return np.flatnonzero((raw == ord(self.separator)) | (raw == ord("\n")))

    @cached_property
    def empty(self) -> BoolArray:
        """True for cells without content, shape (n_rows, width)."""
        return np.asarray(np.diff(self.marks, prepend=-1).reshape(-1, self.width) == 1)

    @property
    def some_row_is_blank(self) -> bool:
        """True if a row has nothing but spaces in its cells."""
        raw = np.frombuffer(self.data, np.uint8)
        ends = np.flatnonzero(raw == ord("\n"))
        ink = ~np.isin(raw, np.frombuffer(f" \t\n{self.separator}".encode(), np.uint8))
        return not np.logical_or.reduceat(ink, np.append(0, ends[:-1] + 1)).all()

    def hold(self, mark: str, columns: npt.ArrayLike) -> bool:
        """Return True if a character occurs in a cell of these columns."""
        if mark.encode() not in self.data:
            return False
        places = np.flatnonzero(np.frombuffer(self.data, np.uint8) == ord(mark))
        return bool(np.isin(np.searchsorted(self.marks, places) % self.width, columns).any())

    def text(self, row: int, column: int) -> str:
        """Return the text of a cell."""
        k = row * self.width + column
        return self.data[self.marks[k - 1] + 1 if k else 0 : self.marks[k]].decode()


def _is_utf8(data: bytes) -> bool:
    try:
        return data.isascii() or bool(data.decode())
    except UnicodeDecodeError:
        return False


def _version(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(".")[:2])
