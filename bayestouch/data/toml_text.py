"""Reading of TOML files, with limits of size and nesting that are checked before parsing."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from bayestouch.data.files import reading
from bayestouch.errors import InputError

#: Largest file: the description of one sensor is about a page of text.
MAX_BYTES = 1_000_000
MAX_PARTS = 50
#: Pattern of a key with too many parts. No text or number has so many dots without a blank or a comma.
_DEEP_KEY = re.compile(rf"(?:[\w\"'-]{{1,99}}[ \t]{{0,9}}\.[ \t]{{0,9}}){{{MAX_PARTS}}}")


def read_toml_text(path: str | Path) -> tuple[str, tuple[str, ...]]:
    """Return the text of a TOML file, and notes on irregularities.

    Raises
    ------
    InputError
        The file is missing, too large, or not UTF-8.
    """
    with reading(path) as file:
        if file.stat().st_size > MAX_BYTES:
            raise InputError(f"expected a description of at most {MAX_BYTES} bytes", file=file)
        data = file.read_bytes()
    mark = data.startswith(b"\xef\xbb\xbf")
    notes = (f"{file.name}: a byte order mark was skipped",) if mark else ()
    try:
        return data.decode("utf-8-sig"), notes
    except UnicodeDecodeError as error:
        row = data[: error.start].count(b"\n") + 1
        raise InputError(f"expected UTF-8 text, got the byte {data[error.start]:#04x}", file=file, row=row) from None


def tables_from_toml(text: str, file: str | Path | None = None) -> dict[str, Any]:
    """Return the parsed TOML tables; `file` is the name in error messages.

    Raises
    ------
    InputError
        The text is not TOML, or nested too deeply; with the line number if it can be found.
    """
    # The parsing time grows with the square of the number of parts of a key, and deeper nesting cannot be printed.
    if deep := _DEEP_KEY.search(text):
        line = text.count("\n", 0, deep.start()) + 1
        raise InputError(f"expected keys of at most {MAX_PARTS} parts", file=file, row=line)
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError("expected TOML, got arrays nested too deeply", file=file) from None
    except ValueError as error:  # TOMLDecodeError, and integers with more digits than Python converts
        at = re.search(r"\(at line (\d+)", str(error))
        raise InputError(f"expected TOML: {error}", file=file, row=int(at[1]) if at else None) from None
