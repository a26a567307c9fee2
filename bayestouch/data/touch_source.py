"""Touches to be read, piece by piece: a table in memory, or a file that need not fit there."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from bayestouch.array_types import IntArray
from bayestouch.data.files import reading
from bayestouch.data.parquet import parquet_pieces
from bayestouch.data.remarks import Tally
from bayestouch.data.sensor import Sensor
from bayestouch.data.tables import Header, RawTable, csv_pieces, joined
from bayestouch.data.touch_columns import Columns, check_values, understand
from bayestouch.data.touch_table import notes_on, read_touches, touches_of_table
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError

#: A file up to this size is read whole, bytes.
READ_WHOLE = 1 << 24
#: A table up to this size stays in memory once its pieces were read, bytes; a larger one is read again.
ROOM = 1 << 27


class Scattered(Exception):
    """The rows of a touch do not stand together: only the whole table tells a touch."""


class TouchSource(Protocol):
    """Touches to be read."""

    @property
    def n_elements(self) -> int:
        """How many elements."""
        ...

    def pieces(self) -> Iterator[Touches]:
        """The table in pieces that hold their touches whole.

        Raises
        ------
        Scattered
            There are no such pieces.
        """
        ...

    def whole(self) -> Touches:
        """The table in memory."""
        ...

    def mark(self) -> Any:
        """What tells its data from others, for a fingerprint."""
        ...

    def remarks(self, tally: Tally) -> tuple[str, ...]:
        """What is to be said of the whole, beyond the notes of its pieces."""
        ...


@dataclass(frozen=True, eq=False)
class InMemory:
    """A table in memory."""

    touches: Touches

    @property
    def n_elements(self) -> int:
        """How many elements."""
        return self.touches.n_elements

    def pieces(self) -> Iterator[Touches]:
        """The table."""
        yield self.touches

    def whole(self) -> Touches:
        """The table."""
        return self.touches

    def mark(self) -> Mapping[str, Any]:
        """Every column."""
        return {each.name: getattr(self.touches, each.name) for each in fields(self.touches)}

    def remarks(self, tally: Tally) -> tuple[str, ...]:
        """None: they are in the notes."""
        return ()


@dataclass(frozen=True, eq=False)
class OnFile:
    """A table on file, of which one piece at a time is in memory, or all of them where there is `ROOM` for them.

    Attributes
    ----------
    path : Path
        CSV, or Parquet where the name ends in ``.parquet``.
    sensor : Sensor
        Whose touches they are.
    header : Header
        Names of the columns.
    columns : Columns
        What they mean.
    state : (int, int)
        Size of the file and time of its change.
    held : list of Touches
        All pieces, once they were read and where there is room for them.
    """

    path: Path
    sensor: Sensor
    header: Header
    columns: Columns
    state: tuple[int, int]
    held: list[Touches] = field(default_factory=list)

    @classmethod
    def of(cls, path: Path, sensor: Sensor) -> OnFile:
        """Look at a file.

        Raises
        ------
        InputError
            It cannot be read, or its header will not do.
        """
        state = _state(path)
        found: list[Columns] = []

        def schema(header: Header) -> frozenset[str]:
            found.append(understand(header, sensor, location=False))
            return found[0].numeric

        header = next(_raw_pieces(path, schema)).header
        return cls(path, sensor, header, found[0], state)

    @property
    def n_elements(self) -> int:
        """How many elements."""
        return self.sensor.n_elements

    def pieces(self) -> Iterator[Touches]:
        """The table in pieces that hold their touches whole; the notes on the file come with the last.

        Raises
        ------
        InputError
            As `bayestouch.data.touch_table.read_touches`, or the file has changed.
        Scattered
            Touches do not stand together.
        """
        if self.held:
            yield from self.held
            return
        parts: list[Touches] = []
        size = 0
        for piece in self._read():
            size += _bytes(piece)
            parts = [*parts, piece] if size <= ROOM else []
            yield piece
        self.held.extend(parts)

    def whole(self) -> Touches:
        """The table in memory."""
        return joined_touches(self.held) if self.held else read_touches(self.path, self.sensor)

    def mark(self) -> tuple[str, str]:
        """Hash of the file."""
        with reading(self.path) as file, file.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
        self._check()
        return "file", digest

    def remarks(self, tally: Tally) -> tuple[str, ...]:
        """As in the notes of `bayestouch.data.touch_table.read_touches`."""
        return notes_on(self.header, self.columns, tally)

    def _read(self) -> Iterator[Touches]:
        self._check()
        held: RawTable | None = None
        seen = _Seen()
        for piece in _raw_pieces(self.path, lambda _: self.columns.numeric):
            table = piece if held is None else joined([held, piece])
            ids = table.numbers["touch"]
            last = len(piece.line) == 0
            # the last touch may go on in the next piece
            others = np.flatnonzero(ids != ids[-1])
            cut = len(ids) if last else int(others[-1]) + 1 if len(others) else 0
            held = _rows(table, slice(cut, None), ())
            if cut:
                yield self._touches(_rows(table, slice(0, cut), table.notes if last else ()), seen)

    def _check(self) -> None:
        if _state(self.path) != self.state:
            raise InputError("has changed while it was read", file=self.path)

    def _touches(self, table: RawTable, seen: _Seen) -> Touches:
        check_values(table.numbers, file=self.header.file, line=table.line)
        # columns that mean nothing here are not carried along
        known = RawTable(table.header, table.numbers, {}, table.line, table.notes)
        touches = touches_of_table(known, self.columns, self.sensor)
        seen.add(np.unique(touches.touch))
        return touches


class _Seen:
    """Touches that came before, 8 bytes each."""

    def __init__(self) -> None:
        self._all: list[IntArray] = []
        self._last: int | None = None

    def add(self, ids: IntArray) -> None:
        """Add the touches of a piece."""
        if self._last is not None and ids[0] <= self._last and any(np.isin(ids, other).any() for other in self._all):
            raise Scattered
        self._all.append(ids)
        self._last = int(ids[-1]) if self._last is None else max(self._last, int(ids[-1]))


def source_of(path: str | Path, sensor: Sensor) -> TouchSource:
    """Touches in a file: read whole where it is small.

    Raises
    ------
    InputError
        As `bayestouch.data.touch_table.read_touches`.
    """
    with reading(path) as file:
        if file.stat().st_size <= READ_WHOLE:
            return InMemory(read_touches(path, sensor))
    return OnFile.of(Path(path), sensor)


def joined_touches(parts: Sequence[Touches]) -> Touches:
    """One table of several pieces of it."""
    if len(parts) == 1:
        return parts[0]
    values: dict[str, Any] = {}
    for each in fields(Touches):
        if each.name not in ("extra", "notes"):
            columns = [getattr(part, each.name) for part in parts]
            values[each.name] = None if columns[0] is None else np.concatenate(columns)
    extra = {name: np.concatenate([part.extra[name] for part in parts]) for name in parts[0].extra}
    return Touches(**values, extra=extra, notes=tuple(dict.fromkeys(note for part in parts for note in part.notes)))


def _raw_pieces(path: Path, schema: Callable[[Header], Any]) -> Iterator[RawTable]:
    return (parquet_pieces if path.suffix == ".parquet" else csv_pieces)(path, schema)


def _rows(table: RawTable, rows: slice, notes: tuple[str, ...]) -> RawTable:
    return RawTable(
        header=table.header,
        numbers={name: values[rows] for name, values in table.numbers.items()},
        texts={name: values[rows] for name, values in table.texts.items()},
        line=table.line[rows],
        notes=notes,
    )


def _state(path: Path) -> tuple[int, int]:
    with reading(path) as file:
        state = file.stat()
        return state.st_size, state.st_mtime_ns


def _bytes(touches: Touches) -> int:
    arrays = (getattr(touches, each.name) for each in fields(touches))
    return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))
