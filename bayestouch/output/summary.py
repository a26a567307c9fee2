"""A short ``repr`` for objects with many numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from html import escape
from pathlib import Path
from textwrap import wrap
from typing import Any, ClassVar

import numpy as np

from bayestouch.errors import few
from bayestouch.output.text import number, plural

WIDTH = 80
#: Maximum number of lines; with `WIDTH` characters per line, less than 1000 characters in total.
LINES = 12
#: Tuples up to this length are shown completely.
_SHOWN = 6
_PLAIN = (str, int, float, type(None))


class Summarised:
    """Base class of dataclasses whose ``repr`` is a summary of a few lines; use it with ``repr=False``.

    A notebook shows the same lines. Tab completion and `dir` leave out the names in `internal`, which other parts of
    the package use and users do not need.
    """

    __slots__ = ()
    internal: ClassVar[frozenset[str]] = frozenset()

    def summary_lines(self) -> list[str]:
        """Return the summary as lines of plain text, by default one with the fields; the first names the object."""
        return [fields_in_short(self)]

    def _repr_html_(self) -> str:
        return summary_html(self)

    def __dir__(self) -> Iterable[str]:
        hidden = self.internal | {"internal", "summary_lines"}
        return [name for name in super().__dir__() if name not in hidden]

    def __repr__(self) -> str:
        first, *others = self.summary_lines()
        lines = [part for line in (first, *(f"  {line}" for line in others)) for part in _wrapped(line)]
        if len(lines) > LINES:
            lines = [*lines[: LINES - 1], f"  … {len(lines) - LINES + 1} more lines"]
        return "\n".join(lines)


def summary_html(result: Summarised) -> str:
    """Return the lines of the ``repr`` as HTML for a notebook, the first line bold."""
    first, *others = (escape(line) for line in result.summary_lines())
    return f"<p><strong>{first}</strong></p>" + "".join(f"<p>{line}</p>" for line in others)


def fields_in_short(value: Any) -> str:
    """Return the name of the class and a short form of each field."""
    inside = ", ".join(f"{each.name}={_short(getattr(value, each.name))}" for each in fields(value))
    return f"{type(value).__name__}({inside})"


def _short(value: Any) -> str:
    """Short form of the value of a field: type, size and range for arrays and long values."""
    if isinstance(value, np.ndarray):
        return f"array of {'×'.join(map(str, value.shape))}{span(value)}"
    if isinstance(value, Mapping):
        return f"{{{few([str(name) for name in value])}}}"
    if isinstance(value, tuple | list):
        if len(value) <= _SHOWN and all(isinstance(each, _PLAIN) for each in value):
            return f"({', '.join(map(_plain, value))})"
        return plural(len(value), "value") + span(value)
    if is_dataclass(value):
        plain = all(isinstance(getattr(value, each.name), _PLAIN) for each in fields(value))
        return fields_in_short(value) if plain else f"{type(value).__name__}(…)"
    return _plain(value)


def _plain(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else few([repr(value)], length=60)


def span(values: Any) -> str:
    """Return the text `` from LOW to HIGH`` of the finite values; empty if there are none."""
    try:
        known = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        return ""
    known = known[~np.isnan(known)]
    if not known.size:
        return ""
    low, high = size_in_short(known.min()), size_in_short(known.max())
    return f" all {low}" if low == high else f" from {low} to {high}"


def size_in_short(value: Any) -> str:
    """Return a number as text, with ∞ for infinity."""
    return "∞" if value == np.inf else number(float(value))


def notes_line(notes: tuple[str, ...]) -> list[str]:
    """Return a line with the number of notes, or no line if there are none."""
    return [f"{plural(len(notes), 'note')} in .notes"] if notes else []


def path_in_short(path: Path) -> str:
    """Return a path as text; of a long path only the end."""
    text = str(path)
    return text if len(text) <= 70 else f"…{text[-69:]}"


def _wrapped(line: str) -> list[str]:
    indent = " " * (len(line) - len(line.lstrip()))
    return wrap(line, WIDTH, subsequent_indent=f"{indent}  ")
