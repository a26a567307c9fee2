"""Writing of CSV tables; reading returns every number bit for bit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy.typing as npt

from bayestouch.data.tables import CHUNK
from bayestouch.errors import InputError, shown

#: Longest cell to write: the csv module of Python reads at most 131,072 characters.
MAX_CELL = 100_000


def write_csv(path: str | Path, columns: Mapping[str, npt.NDArray[Any]]) -> None:
    """Write columns as CSV; reading returns the same numbers bit for bit. NaN becomes an empty cell.

    Parameters
    ----------
    columns : mapping of str to array, shape (n_rows,)
        Float, integer or text (object) columns, in the order to be written.

    Raises
    ------
    InputError
        A text cannot be written in UTF-8 or is too long to be read again.
    """
    n_rows = len(next(iter(columns.values())))
    with Path(path).open("w", encoding="utf-8", newline="") as stream:
        try:
            stream.write(",".join(_quoted(name) for name in columns) + "\n")
            for start in range(0, n_rows, CHUNK):
                cells = (_cells(values[start : start + CHUNK]) for values in columns.values())
                stream.writelines(",".join(row) + "\n" for row in zip(*cells, strict=True))
        except UnicodeEncodeError as error:
            raise InputError(f"text that UTF-8 cannot hold: {shown(error.object)}") from None


def _cells(values: npt.NDArray[Any]) -> list[str]:
    if values.dtype.kind == "f":
        return ["" if number != number else repr(number) for number in values.tolist()]
    if values.dtype.kind == "i":
        return [str(number) for number in values.tolist()]
    return [_quoted(text) for text in values]


def _quoted(text: str) -> str:
    if len(text) > MAX_CELL:
        raise InputError(f"expected text of at most {MAX_CELL} characters, got {shown(text)}")
    if not any(mark in text for mark in ',;"\t\r\n'):
        return text
    return '"' + text.replace('"', '""') + '"'
