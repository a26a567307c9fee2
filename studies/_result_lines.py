"""Results of a study in a file, one line of JSON each, as a run appends them; a killed run may leave half a line."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

Record = dict[str, Any]


def kept_lines(path: Path) -> list[Record]:
    """All results in a file, without a last line that was not written to its end; none if there is no file."""
    if not path.exists():
        return []
    whole = path.read_bytes().rpartition(b"\n")[0]
    return [json.loads(line) for line in whole.decode("utf-8").split("\n") if line]


@contextmanager
def appending(path: Path) -> Iterator[Callable[[Record], None]]:
    """Yield a function that appends a result to a file, and to the disk at once; half a last line is removed first."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.exists():
        text = path.read_bytes()
        unfinished = len(text.rpartition(b"\n")[2])
        if unfinished:
            with path.open("r+b") as file:
                file.truncate(len(text) - unfinished)
    with path.open("a", encoding="utf-8") as file:

        def append(record: Record) -> None:
            file.write(json.dumps(record) + "\n")
            file.flush()

        yield append
