"""Reading of CSV tables of numbers; errors name the row and the column.

This module reads any table. See `bayestouch.data.table_writing` for writing, `bayestouch.data.parquet` for Parquet
and `bayestouch.data.touch_columns` for the meaning of the columns.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from bayestouch.array_types import FloatArray, IntArray, ObjectArray
from bayestouch.data.cells import NumberReader
from bayestouch.data.csv_lines import BOM, SEPARATORS, Lines, records, separator_of
from bayestouch.data.files import reading
from bayestouch.data.plain_rows import plain_rows
from bayestouch.errors import InputError

#: Limits of a touch table: larger files are not read, because they would fill the memory.
MAX_BYTES = 4 * 2**30
MAX_LINE = 1_000_000
MAX_COLUMNS = 10_000

#: Number of rows converted at a time: large enough for speed, small enough for the memory.
CHUNK = 20_000


class Header(NamedTuple):
    """Column names of a table, with the file and the row in which they were found."""

    names: tuple[str, ...]
    file: Path
    row: int


#: Function that checks a header, raises `InputError` if it is not valid, and returns the names of the number columns.
Schema = Callable[[Header], Collection[str]]


@dataclass(frozen=True, eq=False)
class RawTable:
    """Columns of a table as read from a file.

    Attributes
    ----------
    header : Header
    numbers : mapping of str to float array, shape (n_rows,)
        The columns that the schema requires as numbers; NaN for an empty cell.
    texts : mapping of str to object array of str, shape (n_rows,)
        Every other column, unchanged.
    line : int array, shape (n_rows,)
        Line of each row in the file; the header is line 1. (In Parquet as if written as CSV.)
    notes : tuple of str
        Irregularities that were corrected while reading.
    """

    header: Header
    numbers: Mapping[str, FloatArray]
    texts: Mapping[str, ObjectArray]
    line: IntArray
    notes: tuple[str, ...]


def read_csv(path: str | Path, schema: Schema) -> RawTable:
    """Return a table in UTF-8, separated by commas, semicolons or tabs; see `csv_pieces`."""
    return joined(csv_pieces(path, schema))


def csv_pieces(path: str | Path, schema: Schema) -> Iterator[RawTable]:
    """Yield a table in UTF-8, separated by commas, semicolons or tabs, in pieces.

    The reader accepts, with a note: a byte order mark, Windows line ends, separators other than the comma, decimal
    commas (if the comma is not the separator), empty lines and words for a missing number (``nan``, ``NA``). The
    notes come with the last piece, which has no rows. pandas reads pieces of plain rows; other pieces are read row by
    row. Values, notes and errors are the same.

    Raises
    ------
    InputError
        The file is missing, empty, too large, not UTF-8; a column name occurs twice; a row has more or fewer
        cells than the header; a cell of a number column is not a number; or an error that `schema` raises.
    """
    with reading(path) as file:
        size = file.stat().st_size
        if size > MAX_BYTES:
            raise InputError(f"expected a table of at most {MAX_BYTES} bytes, got {size}: split it", file=file)
        notes = list(_byte_notes(file))
        try:
            with file.open("rb") as stream:
                yield from _parse(stream, file, schema, notes)
        except UnicodeDecodeError:
            raise _not_utf8(file) from None


def _parse(stream: BinaryIO, file: Path, schema: Schema, notes: list[str]) -> Iterator[RawTable]:
    lines = Lines(stream, file, MAX_LINE)
    separator = separator_of(lines)
    rows = records(lines, separator, file)
    if (first := next(rows, None)) is None:
        raise InputError("expected a header with column names, got an empty file", file=file)
    if separator != ",":
        notes.append(f"{file.name}: read with {SEPARATORS[separator]} between the columns")
    header = Header(check_names(first[1], file, first[0]), file, first[0])
    wanted = set(schema(header))
    reader = NumberReader(file, decimal_comma=separator != ",")
    empty, some = 0, False
    while True:
        block, at = lines.block(CHUNK), lines.taken + 1
        if block and (plain := plain_rows(block, at, header.names, wanted, separator, reader)):
            lines.take_block(block, plain.n_rows)
            some = True
            yield RawTable(header, plain.numbers, plain.texts, np.arange(at, at + plain.n_rows), notes=())
        elif chunk := list(islice(rows, CHUNK)):
            empty += _check_widths(chunk, len(header.names), file)
            if full := [(at, cells) for at, cells in chunk if not _is_empty(cells)]:
                some = True
                yield _row_by_row(full, header, wanted, reader)
        else:
            break
    if empty:
        notes.append(f"{file.name}: {empty} empty {'row' if empty == 1 else 'rows'} skipped")
    if not some:
        raise InputError("expected at least one row under the header, got none", file=file, row=header.row)
    yield without_rows(header, wanted, (*notes, *reader.notes()))


def _row_by_row(
    rows: Sequence[tuple[int, list[str]]], header: Header, wanted: Collection[str], reader: NumberReader
) -> RawTable:
    at = [at for at, _ in rows]
    columns = dict(zip(header.names, zip(*(cells for _, cells in rows), strict=True), strict=True))
    return RawTable(
        header=header,
        numbers={name: reader.numbers(cells, name, at) for name, cells in columns.items() if name in wanted},
        texts={name: text_array(cells) for name, cells in columns.items() if name not in wanted},
        line=np.array(at, dtype=np.int64),
        notes=(),
    )


def without_rows(header: Header, wanted: Collection[str], notes: tuple[str, ...]) -> RawTable:
    """Return the last piece: no rows, and the notes on all pieces."""
    return RawTable(
        header=header,
        numbers={name: np.empty(0) for name in header.names if name in wanted},
        texts={name: text_array(()) for name in header.names if name not in wanted},
        line=np.empty(0, dtype=np.int64),
        notes=notes,
    )


def joined(pieces: Iterable[RawTable]) -> RawTable:
    """Return one table from its pieces."""
    parts = list(pieces)
    return RawTable(
        header=parts[0].header,
        numbers={name: np.concatenate([part.numbers[name] for part in parts]) for name in parts[0].numbers},
        texts={name: np.concatenate([part.texts[name] for part in parts]) for name in parts[0].texts},
        line=np.concatenate([part.line for part in parts]),
        notes=tuple(note for part in parts for note in part.notes),
    )


def text_array(values: Sequence[str]) -> ObjectArray:
    """Return texts as an object array, so that one long cell does not increase the size of all."""
    array = np.empty(len(values), dtype=object)
    array[:] = values
    return array


def check_names(cells: Sequence[str], file: Path, row: int) -> tuple[str, ...]:
    """Return the column names, each once; an unnamed column gets a name with its number.

    Raises
    ------
    InputError
        A name occurs twice, or there are more than `MAX_COLUMNS`.
    """
    if len(cells) > MAX_COLUMNS:
        raise InputError(f"expected at most {MAX_COLUMNS} columns, got {len(cells)}", file=file, row=row)
    names = tuple(cell.strip() or f"column_{i}" for i, cell in enumerate(cells, start=1))
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise InputError("expected every column once, got this name twice", file=file, row=row, column=name)
        seen.add(name)
    return names


def _byte_notes(file: Path) -> Iterator[str]:
    with file.open("rb") as stream:
        start = stream.readline(MAX_LINE)
    if start.startswith(BOM):
        yield f"{file.name}: a byte order mark was skipped"
    if start.endswith(b"\r\n"):
        yield f"{file.name}: read with Windows line ends"


def _check_widths(chunk: Sequence[tuple[int, list[str]]], width: int, file: Path) -> int:
    for row, cells in chunk:
        if len(cells) != width:
            raise InputError(f"expected {width} cells as in the header, got {len(cells)}", file=file, row=row)
    return sum(_is_empty(cells) for _, cells in chunk)


def _is_empty(cells: Sequence[str]) -> bool:
    """True for a row with nothing but spaces in its cells."""
    return not any(cell.strip() for cell in cells)


def _not_utf8(file: Path) -> InputError:
    with file.open("rb") as stream:
        for row, line in enumerate(stream, start=1):
            try:
                line.decode("utf-8")
            except UnicodeDecodeError as error:
                byte = line[error.start]
                return InputError(f"expected UTF-8 text, got the byte {byte:#04x}", file=file, row=row)
    return InputError("expected UTF-8 text", file=file)
