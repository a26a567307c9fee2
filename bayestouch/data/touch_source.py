"""Sources of touches to be read in pieces: a table in memory, or a file that may be larger than the memory."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from bayestouch.array_types import IntArray
from bayestouch.data.arrays import read_only
from bayestouch.data.copies import notes_on_copies
from bayestouch.data.files import reading
from bayestouch.data.parquet import parquet_pieces
from bayestouch.data.remarks import Tally
from bayestouch.data.sensor import Sensor
from bayestouch.data.tables import Header, RawTable, csv_pieces, joined
from bayestouch.data.touch_columns import Columns, check_values, understand
from bayestouch.data.touch_table import notes_on, read_touches, touches_of_table
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError

#: A file up to this size in bytes is read completely.
READ_WHOLE = 1 << 24
#: A table up to this size in bytes stays in memory after the first reading; a larger one is read again.
ROOM = 1 << 27


class Scattered(Exception):
    """The rows of a touch are not consecutive, so that the table must be read completely."""


class TouchSource(Protocol):
    """Source of touches to be read."""

    @property
    def n_elements(self) -> int:
        """How many elements."""
        ...

    def pieces(self) -> Iterator[Touches]:
        """Yield the table in pieces; all rows of a touch are in one piece.

        Raises
        ------
        Scattered
            The rows of a touch are not consecutive.
        """
        ...

    def whole(self) -> Touches:
        """The table in memory."""
        ...

    def mark(self) -> Any:
        """Return a value that identifies the data, for a fingerprint."""
        ...

    def remarks(self, tally: Tally) -> tuple[str, ...]:
        """Return remarks on the whole table that are not among the notes of its pieces."""
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
        """Return every column by name."""
        return {each.name: getattr(self.touches, each.name) for each in fields(self.touches)}

    def remarks(self, tally: Tally) -> tuple[str, ...]:
        """Return no remarks: the notes of the table contain them."""
        return ()


@dataclass(frozen=True, eq=False)
class OnFile:
    """A table in a file; one piece at a time is in memory, or all pieces if they are not larger than `ROOM`.

    Attributes
    ----------
    path : Path
        CSV, or Parquet where the name ends in ``.parquet``.
    sensor : Sensor
        Sensor that was touched.
    header : Header
        Names of the columns.
    columns : Columns
        Meaning of the columns.
    state : (int, int)
        Size of the file and time of its last change.
    held : list of Touches
        All pieces after the first reading, if they are not larger than `ROOM`.
    """

    path: Path
    sensor: Sensor
    header: Header
    columns: Columns
    state: tuple[int, int]
    held: list[Touches] = field(default_factory=list)

    @classmethod
    def of(cls, path: Path, sensor: Sensor) -> OnFile:
        """Return the source of a file; reads its header.

        Raises
        ------
        InputError
            The file cannot be read, or its header is not valid.
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
        """Yield the table in pieces; all rows of a touch are in one piece. The last piece has the notes on the file.

        Raises
        ------
        InputError
            As `bayestouch.data.touch_table.read_touches`, or the file has changed.
        Scattered
            The rows of a touch are not consecutive.
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
        return joined_touches(self.held) if self.held else _read_whole(self.path, self.sensor)

    def mark(self) -> tuple[str, str]:
        """Return the hash of the file."""
        with reading(self.path) as file, file.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
        self._check()
        return "file", digest

    def remarks(self, tally: Tally) -> tuple[str, ...]:
        """Return the remarks that `bayestouch.data.touch_table.read_touches` adds to its notes, and those on copies.

        Copies are looked for only if all pieces are in memory.
        """
        copies = notes_on_copies(None, joined_touches(self.held), ("", self.path.name)) if self.held else ()
        return (*notes_on(self.header, self.columns, tally), *copies)

    def _read(self) -> Iterator[Touches]:
        self._check()
        held: RawTable | None = None
        seen = _EarlierTouches()
        for piece in _raw_pieces(self.path, lambda _: self.columns.numeric):
            table = piece if held is None else joined([held, piece])
            ids = table.numbers["touch"]
            last = len(piece.line) == 0
            # the last touch may continue in the next piece
            others = np.flatnonzero(ids != ids[-1])
            cut = len(ids) if last else int(others[-1]) + 1 if len(others) else 0
            held = _rows(table, slice(cut, None), ())
            if cut:
                yield self._touches(_rows(table, slice(0, cut), table.notes if last else ()), seen)

    def _check(self) -> None:
        if _state(self.path) != self.state:
            raise InputError("has changed while it was read", file=self.path)

    def _touches(self, table: RawTable, seen: _EarlierTouches) -> Touches:
        check_values(table.numbers, file=self.header.file, line=table.line)
        # columns without a meaning here are dropped
        known = RawTable(table.header, table.numbers, {}, table.line, table.notes)
        touches = touches_of_table(known, self.columns, self.sensor)
        seen.add(np.unique(touches.touch))
        return touches


class _EarlierTouches:
    """Ids of the touches in earlier pieces, 8 bytes each."""

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
    """Return the source of the touches in a file; a small file is read completely.

    Raises
    ------
    InputError
        As `bayestouch.data.touch_table.read_touches`.
    """
    with reading(path) as file:
        if file.stat().st_size <= READ_WHOLE:
            return InMemory(_read_whole(Path(path), sensor))
    return OnFile.of(Path(path), sensor)


def _read_whole(path: Path, sensor: Sensor) -> Touches:
    """Return the table in a file, with notes on copies among its touches."""
    touches = read_touches(path, sensor)
    return touches.with_(notes=(*touches.notes, *notes_on_copies(None, touches, ("", path.name))))


def joined_touches(parts: Sequence[Touches]) -> Touches:
    """Return one table from its pieces."""
    if len(parts) == 1:
        return parts[0]
    values: dict[str, Any] = {}
    for each in fields(Touches):
        if each.name not in ("extra", "notes"):
            columns = [getattr(part, each.name) for part in parts]
            values[each.name] = None if columns[0] is None else read_only(np.concatenate(columns))
    extra = {name: read_only(np.concatenate([part.extra[name] for part in parts])) for name in parts[0].extra}
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
