"""Reading and writing of Parquet tables; needs pyarrow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bayestouch.array_types import FloatArray
from bayestouch.data.cells import NumberReader
from bayestouch.data.files import reading
from bayestouch.data.tables import (
    CHUNK,
    MAX_BYTES,
    MAX_COLUMNS,
    Header,
    RawTable,
    Schema,
    check_names,
    joined,
    text_array,
    without_rows,
)
from bayestouch.errors import InputError, shown

#: Largest allowed ratio of the size in memory to the size of the file (columns with few distinct values are
#: small in the file), and the bytes to which the limit does not apply.
LARGEST_RATIO, FREE_BYTES = 500, 1 << 28
#: How the file is read: by default, pyarrow holds all that it has read until the file is closed.
IN_PARTS: Mapping[str, Any] = {"pre_buffer": False, "buffer_size": 1 << 20}
#: Characters of a number: the longest double has 767 digits.
MAX_NUMBER = 1000


def read_parquet(path: str | Path, schema: Schema) -> RawTable:
    """Return the table of a Parquet file; see `parquet_pieces`."""
    return joined(parquet_pieces(path, schema))


def parquet_pieces(path: str | Path, schema: Schema) -> Iterator[RawTable]:
    """Yield the table of a Parquet file in pieces; rows are numbered as in CSV (the first is row 2).

    The notes come with the last piece, which has no rows.

    Raises
    ------
    InputError
        pyarrow is not installed; the file is missing, too large or not Parquet; a column name occurs twice;
        a column of numbers contains something else; or an error that `schema` raises.
    """
    with reading(path) as file:
        pa, pq = _pyarrow(file)
        if file.stat().st_size > MAX_BYTES:
            raise InputError(f"expected a table of at most {MAX_BYTES} bytes: split it", file=file)
        with _parquet_errors(file), pq.ParquetFile(file, **IN_PARTS) as parquet:
            header = Header(check_names(parquet.schema_arrow.names, file, 1), file, 1)
            wanted = set(schema(header))
            _check_size(parquet, file)
            kinds = parquet.schema_arrow.types
            _check_kinds(pa, dict(zip(header.names, kinds, strict=True)), wanted, file)
        # Texts are read as indices of their distinct values, because a small file can contain very many equal texts.
        texts_of = [name for name, kind in zip(header.names, kinds, strict=True) if _is_text(pa, kind)]
        reader, rows = NumberReader(file, decimal_comma=False), 0
        with _parquet_errors(file), pq.ParquetFile(file, read_dictionary=texts_of, **IN_PARTS) as parquet:
            for batch in parquet.iter_batches(batch_size=CHUNK):
                if batch.num_rows:
                    line = np.arange(2 + rows, 2 + rows + batch.num_rows, dtype=np.int64)
                    yield _piece(pa, pa.Table.from_batches([batch]), header, wanted, reader, line)
                rows += batch.num_rows
        if rows == 0:
            raise InputError("expected at least one row, got none", file=file)
        yield without_rows(header, wanted, reader.notes())


@contextmanager
def _parquet_errors(file: Path) -> Iterator[None]:
    try:
        yield
    except (InputError, GeneratorExit):
        raise
    # With a damaged file the library may raise any exception.
    except Exception as error:
        raise InputError(f"expected a Parquet file: {' '.join(str(error).split())[:200]}", file=file) from None


def _piece(
    pa: Any, table: Any, header: Header, wanted: set[str], reader: NumberReader, line: npt.NDArray[np.int64]
) -> RawTable:
    numbers: dict[str, FloatArray] = {}
    texts = {}
    for name, column in zip(header.names, table.columns, strict=True):
        if name not in wanted:
            texts[name] = text_array(_cells(pa, column))
        elif pa.types.is_dictionary(column.type) and _is_text(pa, column.type.value_type):
            cells = _cells(pa, column)
            if (longest := max(map(len, cells))) > MAX_NUMBER:
                message = f"expected numbers, got a text of {longest} characters"
                raise InputError(message, file=header.file, column=name)
            numbers[name] = reader.numbers(cells, name, line.tolist())
        else:
            try:
                floats = column.cast(pa.float64(), safe=False).to_numpy()
            except pa.ArrowException:
                message = f"expected numbers, got {column.type}"
                raise InputError(message, file=header.file, column=name) from None
            numbers[name] = np.array(floats, dtype=np.float64)
    return RawTable(header=header, numbers=numbers, texts=texts, line=line, notes=())


def _check_size(parquet: Any, file: Path) -> None:
    """Raise an error for a table that is much larger in memory than in the file."""
    rows, columns = int(parquet.metadata.num_rows), int(parquet.metadata.num_columns)
    held = sum(int(parquet.metadata.row_group(i).num_rows) for i in range(parquet.metadata.num_row_groups))
    if columns > MAX_COLUMNS or held != rows or rows < 0:
        raise InputError(f"expected a Parquet table, got one that claims {rows} rows, {columns} columns", file=file)
    if 8 * rows * columns > FREE_BYTES + LARGEST_RATIO * file.stat().st_size:
        raise InputError(f"declares {rows} rows of {columns} columns, more than it can hold", file=file)


def _check_kinds(pa: Any, kinds: Mapping[str, Any], wanted: set[str], file: Path) -> None:
    """Raise an error for types that no table of numbers contains: lists in cells and types of other libraries."""
    types = pa.types
    tests = (types.is_integer, types.is_floating, types.is_boolean, types.is_decimal, types.is_temporal, types.is_null)
    for name, kind in kinds.items():
        held = kind.value_type if types.is_dictionary(kind) else kind
        if not _is_text(pa, held) and not any(test(held) for test in tests):
            expected = "numbers" if name in wanted else "numbers or text"
            raise InputError(f"expected {expected}, got {str(kind)[:80]}", file=file, column=name)


def _is_text(pa: Any, kind: Any) -> bool:
    types = pa.types
    tests = (types.is_string, types.is_large_string, types.is_binary, types.is_large_binary)
    # pyarrow 15 has no test for views.
    return any(test(kind) for test in tests) or str(kind) in ("string_view", "binary_view")


def _cells(pa: Any, column: Any) -> list[str]:
    """Text of every value, empty where missing; in a dictionary column equal texts share their memory."""
    if not pa.types.is_dictionary(column.type):
        return [_text(value) for value in column.to_pylist()]
    cells: list[str] = []
    for chunk in column.chunks:
        distinct = [_text(value) for value in chunk.dictionary.to_pylist()]
        cells += ["" if place is None else distinct[place] for place in chunk.indices.to_pylist()]
    return cells


def _text(value: object) -> str:
    """Text of one value, empty where it is missing."""
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    return "" if value is None else str(value)


def write_parquet(path: str | Path, columns: Mapping[str, npt.NDArray[Any]]) -> None:
    """Write columns as Parquet; reading returns the same numbers bit for bit.

    Raises
    ------
    InputError
        pyarrow is not installed, or a text cannot be written in UTF-8.
    """
    pa, pq = _pyarrow(None)
    try:
        table = pa.table(
            {
                name: pa.array(values.tolist(), type=pa.string()) if values.dtype.kind == "O" else pa.array(values)
                for name, values in columns.items()
            }
        )
    except UnicodeEncodeError as error:
        raise InputError(f"text that UTF-8 cannot hold: {shown(error.object)}") from None
    # Row groups, so that a reader can load one at a time.
    pq.write_table(table, path, row_group_size=CHUNK)


def _pyarrow(file: Path | None) -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        message = "Parquet needs pyarrow, which is not installed: pip install 'bayestouch[parquet]', or use CSV"
        raise InputError(message, file=file) from None
    return pyarrow, pyarrow.parquet
