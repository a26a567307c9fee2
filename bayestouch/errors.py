"""The exception for input or options that cannot be used, and helpers for its messages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: Longest list of names that a message shows beside its suggestion, so that it stays one line on a screen.
_FEW_NAMES = 6


class InputError(ValueError):
    """Input or options cannot be used; the message is one line.

    Parameters
    ----------
    message : str
        What is wrong and what was expected.
    file : str or Path, optional
        File with the error; the message shows the path as given.
    row : int, optional
        Line number in the file; the header is line 1. Of a table in memory, its index from 0.
    column : str, optional
        Column or key with the error.

    Examples
    --------
    >>> import bayestouch
    >>> print(bayestouch.InputError("the load is negative", file="touches.csv", row=3, column="load"))
    touches.csv, row 3, column load: the load is negative
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
        # Errors are pickled to return from worker processes. The default would use the complete line as the message
        # and lose file, row and column.
        return (_rebuild, (self.message, self.file, self.row, self.column))


def _rebuild(message: str, file: str | None, row: int | None, column: str | None) -> InputError:
    return InputError(message, file=file, row=row, column=column)


@contextmanager
def about(file: str | Path | None) -> Iterator[None]:
    """Add `file` to an `InputError` from the ``with`` block that names no file."""
    try:
        yield
    except InputError as error:
        if file is None or error.file is not None:
            raise
        raise InputError(error.message, file=file, row=error.row, column=error.column) from error


def shown(value: object, length: int = 40) -> str:
    """Return a value as quoted text on one line, at most `length` characters, for an error message."""
    text = repr(value)
    return _cut(text, length)


def few(names: Sequence[str], count: int = 6, length: int = 30) -> str:
    """Return the first `count` names as text, each at most `length` characters, for a message."""
    return ", ".join(_cut(name, length) for name in names[:count]) + (" …" if len(names) > count else "")


def similar(name: str, known: Iterable[str]) -> list[str]:
    """Return the known name that is most similar to an unknown one, in a list; empty if none is.

    Letters in upper case and the signs between words do not count. If the unknown name is a word of known ones, as
    ``drift`` is of ``gain_drift``, the list has up to three of these.
    """
    plain = {_plain(each): each for each in known}
    wanted = _plain(name)
    found = [each for each in plain if wanted in each.split()][:3] or get_close_matches(wanted, list(plain), n=1)
    return [plain[each] for each in found]


def nearest(name: str, known: Iterable[str]) -> str:
    """Return a question with the known names that are `similar` to an unknown one, for a message; empty if none is."""
    found = similar(name, known)
    return f"; did you mean {' or '.join(found)}?" if found else ""


def unknown_name(what: str, name: object, known: Iterable[str], column: str | None = None) -> InputError:
    """Return the error that a name is unknown, with the most similar name; if there is none or few names, with all."""
    names = list(known)
    question = nearest(str(name), names)
    known_are = f"; known are {', '.join(names)}" if len(names) <= _FEW_NAMES or not question else ""
    return InputError(f"unknown {what} {shown(name)}{known_are}{question}", column=column)


def misspelt(name: str, unknown: Iterable[str]) -> str:
    """Return a question with the unknown name most similar to a missing one, for a message; empty if none is."""
    found = get_close_matches(name, list(unknown), n=1)
    return f"; is it {found[0]}?" if found else ""


def require_whole(name: str, value: object, least: int) -> None:
    """Raise an error unless an option is a whole number, `least` or more.

    Raises
    ------
    InputError
        It is another value; the message names the option.
    """
    # `Integral` has the integers of numpy, too; True is one of Python's.
    if not isinstance(value, Integral) or isinstance(value, bool) or value < least:
        raise InputError(f"{name}: expected a whole number, at least {least}, got {shown(value)}")


def number_array(name: str, value: object, *dimensions: int) -> NDArray[np.float64]:
    """Return the number or numbers of an argument as an array; NaN and infinite ones count as numbers.

    Parameters
    ----------
    name : str
        Name of the argument, for the message.
    value : object
        What was given.
    *dimensions : int
        Numbers of dimensions that are allowed: 0 a single number, 1 a list.

    Raises
    ------
    InputError
        It is something else, such as text; the message names the argument.
    """
    import numpy as np  # here, so that the command line begins without it

    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        array = np.array(None)
    if array.dtype.kind not in "iuf" or array.ndim not in dimensions:
        expected = "a number" if dimensions == (0,) else "a list of numbers"
        raise InputError(f"{name}: expected {expected}, got {shown(value)}")
    return array.astype(float)


def not_a(expected: str, value: object, how: str) -> InputError:
    """Return the error that an argument is something else than expected, with how to get it."""
    got = shown(str(value)) if isinstance(value, str | Path) else type(value).__name__
    return InputError(f"expected {expected}, got {got}; {how}")


def _plain(name: str) -> str:
    """Words of a name in lower case, with one space between them."""
    return " ".join(name.lower().replace("_", " ").replace("-", " ").split())


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else text[: length - 1] + "…"
