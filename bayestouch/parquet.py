"""Tables in Parquet, by pyarrow where it is installed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bayestouch.arrays import FloatArray
from bayestouch.cells import NumberReader
from bayestouch.errors import InputError, shown
from bayestouch.files import reading
from bayestouch.tables import MAX_BYTES, Header, RawTable, Schema, check_names, text_array


def read_parquet(path: str | Path, schema: Schema) -> RawTable:
    """Read a table from Parquet; rows are counted as if it were CSV (the first one is row 2).

    Raises
    ------
    InputError
        pyarrow is not installed; the file is missing, too large or no Parquet; a name is there twice; a
        column that must hold numbers holds something else; or what `schema` raises.
    """
    with reading(path) as file:
        pa, pq = _pyarrow(file)
        if file.stat().st_size > MAX_BYTES:
            raise InputError(f"expected a table of at most {MAX_BYTES} bytes: split it", file=file)
        try:
            with pq.ParquetFile(file) as parquet:
                header = Header(check_names(parquet.schema_arrow.names, file, 1), file, 1)
                wanted = set(schema(header))
                table = parquet.read()
        except (pa.ArrowException, OSError) as error:
            raise InputError(f"expected a Parquet file: {error}", file=file) from None
    if table.num_rows == 0:
        raise InputError("expected at least one row, got none", file=file)
    line = np.arange(2, table.num_rows + 2, dtype=np.int64)
    reader = NumberReader(file, decimal_comma=False)
    numbers: dict[str, FloatArray] = {}
    texts = {}
    for name, column in zip(header.names, table.columns, strict=True):
        if name not in wanted:
            cells = ["" if value is None else str(value) for value in column.to_pylist()]
            texts[name] = text_array(cells)
        elif pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
            cells = [value or "" for value in column.to_pylist()]
            numbers[name] = reader.numbers(cells, name, line.tolist())
        else:
            try:
                floats = column.cast(pa.float64(), safe=False).to_numpy()
            except pa.ArrowException:
                raise InputError(f"expected numbers, got {column.type}", file=file, column=name) from None
            numbers[name] = np.array(floats, dtype=np.float64)
    return RawTable(header=header, numbers=numbers, texts=texts, line=line, notes=reader.notes())


def write_parquet(path: str | Path, columns: Mapping[str, npt.NDArray[Any]]) -> None:
    """Write columns as Parquet; numbers come back bit for bit.

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
    pq.write_table(table, path)


def _pyarrow(file: Path | None) -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        message = "Parquet needs pyarrow, which is not installed: pip install 'bayestouch[parquet]', or use CSV"
        raise InputError(message, file=file) from None
    return pyarrow, pyarrow.parquet
