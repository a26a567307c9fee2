"""The one error a user causes: input or options that cannot be used."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path


class InputError(ValueError):
    """Input or options that cannot be used, told in one line.

    Parameters
    ----------
    message : str
        What is wrong and what was expected.
    file : str or Path, optional
        File at fault; only its name and folder as given are shown.
    row : int, optional
        Line number in the file; the header is line 1.
    column : str, optional
        Column or key at fault.
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | Path | None = None,
        row: int | None = None,
        column: str | None = None,
    ) -> None:
        self.message = message
        self.file = None if file is None else str(file)
        self.row = row
        self.column = column
        place = ", ".join(
            part
            for part in (
                self.file,
                None if row is None else f"row {row}",
                None if column is None else f"column {_cut(column, 80)}",
            )
            if part
        )
        line = f"{place}: {message}" if place else message
        super().__init__(" ".join(line.split()))

    def __reduce__(self) -> tuple[object, ...]:
        # The default would call the class with the finished line as its message and forget the place,
        # and errors cross from worker processes by pickling.
        return (_rebuild, (self.message, self.file, self.row, self.column))


def _rebuild(message: str, file: str | None, row: int | None, column: str | None) -> InputError:
    return InputError(message, file=file, row=row, column=column)


@contextmanager
def about(file: str | Path | None) -> Iterator[None]:
    """Errors that come from within and name no file name this one; the folder of a data set, say."""
    try:
        yield
    except InputError as error:
        if file is None or error.file is not None:
            raise
        raise InputError(error.message, file=file, row=error.row, column=error.column) from error


def shown(value: object, length: int = 40) -> str:
    """Show what was found in place of what was expected: quoted, on one line, never longer than `length`."""
    text = repr(value)
    return _cut(text, length)


def few(names: Sequence[str], count: int = 6, length: int = 30) -> str:
    """List the first names only, none of them long: a header may hold anything."""
    return ", ".join(_cut(name, length) for name in names[:count]) + (" …" if len(names) > count else "")


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else text[: length - 1] + "…"
