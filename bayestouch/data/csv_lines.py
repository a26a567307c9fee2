"""Lines and records of a CSV file in order, with their line numbers."""

from __future__ import annotations

import csv
import io
import re
from collections import deque
from collections.abc import Iterator, Sequence
from pathlib import Path

from bayestouch.errors import InputError

SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}


class Lines:
    """Iterator over the lines of a text that counts them and lets the caller look ahead.

    When it takes a line that cannot be read, it raises `InputError` (line too long) or `UnicodeDecodeError`.

    Attributes
    ----------
    taken : int
        Number of lines taken.
    """

    def __init__(self, stream: io.TextIOBase, file: Path, longest: int) -> None:
        self.taken = 0
        self._stream, self._file, self._longest = stream, file, longest
        self._next: deque[str] = deque()
        self._fault: Exception | None = None

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        self._look(1)
        if not self._next:
            raise StopIteration if self._fault is None else self._fault
        self.taken += 1
        return self._next.popleft()

    def block(self, n: int) -> Sequence[str]:
        """Return the next n lines (or all that remain) without taking them; none if one of them cannot be read."""
        self._look(n)
        return () if self._fault is not None and len(self._next) < n else self._next

    def take_block(self) -> None:
        """Take the lines that `block` returned."""
        self.taken += len(self._next)
        self._next.clear()

    def _look(self, n: int) -> None:
        if self._fault is not None:
            return
        longest, readline, put = self._longest, self._stream.readline, self._next.append
        try:
            for _ in range(n - len(self._next)):
                if not (line := readline(longest + 1)):
                    return
                if len(line) > longest:
                    row = self.taken + len(self._next) + 1
                    raise InputError(f"expected a line of at most {longest} characters", file=self._file, row=row)
                put(line)
        except (InputError, UnicodeDecodeError) as fault:
            self._fault = fault


def separator_of(lines: Lines) -> str:
    """Return the separator that is most frequent in the header outside quotes; takes empty lines before the header."""
    while (block := lines.block(1)) and not block[0].strip():
        next(lines)
    bare = re.sub(r'"[^"]*("|$)', "", block[0]) if block else ""
    return max(SEPARATORS, key=bare.count)


def records(lines: Lines, separator: str, file: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and the cells of each record; empty lines are skipped.

    A line is taken only when its record is requested.
    """
    reader = csv.reader(lines, delimiter=separator, strict=True)
    while True:
        row = lines.taken + 1
        try:
            cells = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            raise InputError(f"expected cells of a table: {error}", file=file, row=row) from None
        if cells and not (len(cells) == 1 and not cells[0].strip()):
            yield row, cells
