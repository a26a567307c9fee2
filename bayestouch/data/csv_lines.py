"""Lines and records of a CSV file in order, with their line numbers."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

import numpy as np

from bayestouch.array_types import IntArray
from bayestouch.errors import InputError

SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
#: Byte order mark, which some programs write at the start of a file.
BOM = b"\xef\xbb\xbf"
#: Bytes that are read at a time, and the bytes above which a block is not made larger.
READ_AHEAD, MOST_HELD = 1 << 22, 1 << 26
_LINE = re.compile(rb"[^\r\n]*(?:\r\n|\r|\n)?")


class Lines:
    """Iterator over the lines of a file in UTF-8 that counts them and lets the caller look ahead.

    When it takes a line that cannot be read, it raises `InputError` (line too long) or `UnicodeDecodeError`.

    Parameters
    ----------
    stream : binary file
        Read from its present position; a byte order mark there is skipped.
    file : Path
        Named in error messages.
    longest : int
        Largest allowed number of characters in a line.

    Attributes
    ----------
    taken : int
        Number of lines taken.
    """

    def __init__(self, stream: BinaryIO, file: Path, longest: int) -> None:
        self.taken = 0
        self._stream, self._file, self._longest = stream, file, longest
        self._held, self._at, self._ended = b"", 0, False
        # positions after the newlines in `_held`, and number of those that are before `_at`
        self._ends: IntArray = np.empty(0, dtype=np.int64)
        self._passed = 0
        self._more()
        self._at = len(BOM) if self._held.startswith(BOM) else 0

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        line = self._line()
        if not line:
            raise StopIteration
        text = line.decode()
        if len(text) > self._longest:
            message = f"expected a line of at most {self._longest} characters"
            raise InputError(message, file=self._file, row=self.taken + 1)
        self.taken += 1
        self._at += len(line)
        self._passed += line.endswith(b"\n")
        return text

    def look(self) -> str:
        """Return the next line without taking it; empty if there is none or it cannot be read."""
        with suppress(UnicodeDecodeError):
            return text if len(text := self._line().decode()) <= self._longest else ""
        return ""

    def block(self, n: int) -> bytes:
        """Return the next n lines, or all that remain, without taking them; fewer lines if they are very long.

        Here only a newline ends a line, not a carriage return alone.
        """
        while not self._ended and len(self._ends) - self._passed < n and len(self._held) - self._at < MOST_HELD:
            self._more()
        ends = self._ends[self._passed : self._passed + n]
        whole = len(ends) == n or not self._ended
        return self._held[self._at : int(ends[-1]) if whole and len(ends) else len(self._held)]

    def take_block(self, block: bytes, n: int) -> None:
        """Take the n lines that `block` returned."""
        self.taken += n
        self._at += len(block)
        self._passed += n

    def _line(self) -> bytes:
        """Return the next line with its end; of a line that is too long, at least as much as shows that."""
        while True:
            match = _LINE.match(self._held, self._at)
            line = match[0] if match else b""
            # a line feed may follow the carriage return at the end of what was read
            if self._ended or len(line) > 4 * self._longest or self._at + len(line) < len(self._held):
                return line
            self._more()

    def _more(self) -> None:
        """Read more of the file, and drop what was taken."""
        more = self._stream.read(READ_AHEAD)
        held = self._held[self._at :]
        found = np.flatnonzero(np.frombuffer(more, np.uint8) == ord("\n")) + len(held) + 1
        self._ends = np.concatenate([self._ends[self._passed :] - self._at, found])
        self._held, self._at, self._passed, self._ended = held + more, 0, 0, not more


def separator_of(lines: Lines) -> str:
    """Return the separator that is most frequent in the header outside quotes; takes empty lines before the header."""
    while (line := lines.look()) and not line.strip():
        next(lines)
    bare = re.sub(r'"[^"]*("|$)', "", line)
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
