"""Fast reading of CSV rows with plain cells only: pandas reads many rows at a time.

Rows that are ambiguous or wrong are read one by one in `bayestouch.data.tables`.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Sequence
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from bayestouch.array_types import BoolArray, FloatArray, IntArray, ObjectArray
from bayestouch.data.cells import MISSING, NumberReader

#: Words that pandas reads as a missing number.
_WORDS = ["", "NaN", "+NaN", "-NaN", *(form(word) for word in MISSING for form in (str, str.upper, str.capitalize))]


class PlainRows(NamedTuple):
    """Columns by name: numbers (NaN where missing) and texts, shape (n_rows,) each."""

    numbers: dict[str, FloatArray]
    texts: dict[str, ObjectArray]


def plain_rows(
    lines: Sequence[str],
    first: int,
    names: Sequence[str],
    wanted: Collection[str],
    separator: str,
    reader: NumberReader,
) -> PlainRows | None:
    """Return the columns of lines that are one row each.

    Parameters
    ----------
    lines : sequence of str
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

    if (cells := _Cells.of(lines, len(names), separator)) is None:
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
    words = {k: np.flatnonzero(np.isnan(numbers[name]) & ~cells.empty[:, k]).tolist() for k, name in numeric.items()}
    if any(cells.text(row, k).strip().lower() not in MISSING for k, rows in words.items() for row in rows):
        return None
    for k, rows in words.items():
        reader.take_words(len(rows), numeric[k], [first + row for row in rows[:1]])
    if reader.decimal_comma and marks:
        reader.decimal = marks[0]
    return PlainRows(numbers, {name: np.array(frame[k]) for k, name in enumerate(names) if k not in numeric})


class _Cells(NamedTuple):
    """Rows as bytes, and the positions of their cells.

    Attributes
    ----------
    data : bytes
        Rows in UTF-8, each with a newline at its end.
    marks : int array, shape (n_rows * width,)
        Position after the last byte of each cell.
    empty : bool array, shape (n_rows, width)
        True for cells without content.
    """

    data: bytes
    marks: IntArray
    empty: BoolArray

    @classmethod
    def of(cls, lines: Sequence[str], width: int, separator: str) -> Self | None:
        """Return rows of `width` plain cells; None if a row has another number of cells or a cell is not plain."""
        data = "".join(lines).encode().replace(b"\r\n", b"\n")
        data += b"" if data.endswith(b"\n") else b"\n"
        # quotes may contain separators and line ends; pandas ends a cell at a zero byte, and skips a byte order mark in
        # every block
        if width < 2 or any(mark in data for mark in (b'"', b"\r", b"\0")) or data.startswith(b"\xef\xbb\xbf"):
            return None
        raw = np.frombuffer(data, np.uint8)
        marks = np.flatnonzero((raw == ord(separator)) | (raw == ord("\n")))
        if len(marks) != len(lines) * width or not (raw[marks[width - 1 :: width]] == ord("\n")).all():
            return None
        lengths = np.diff(marks, prepend=-1).reshape(-1, width) - 1
        empty = lengths == 0
        return None if lengths.max() > csv.field_size_limit() or empty.all(axis=1).any() else cls(data, marks, empty)

    def hold(self, mark: str, columns: npt.ArrayLike) -> bool:
        """Return True if a character occurs in a cell of these columns."""
        if mark.encode() not in self.data:
            return False
        places = np.flatnonzero(np.frombuffer(self.data, np.uint8) == ord(mark))
        return bool(np.isin(np.searchsorted(self.marks, places) % self.empty.shape[1], columns).any())

    def text(self, row: int, column: int) -> str:
        """Return the text of a cell."""
        k = row * self.empty.shape[1] + column
        return self.data[self.marks[k - 1] + 1 if k else 0 : self.marks[k]].decode()


def _version(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(".")[:2])
