"""A short ``repr`` for objects that hold many numbers."""

from __future__ import annotations

from html import escape
from textwrap import wrap

WIDTH = 80
#: With lines of `WIDTH` characters, below 1000 characters in all.
LINES = 12


class Summarised:
    """Base of dataclasses whose ``repr`` is a summary in a few lines.

    The dataclass is made with ``repr=False``. `bayestouch.summary_lines` says what the lines are.
    """

    __slots__ = ()

    def __repr__(self) -> str:
        from bayestouch.summary_lines import lines_of

        first, *others = lines_of(self)
        lines = [part for line in (first, *(f"  {line}" for line in others)) for part in _wrapped(line)]
        if len(lines) > LINES:
            lines = [*lines[: LINES - 1], f"  … {len(lines) - LINES + 1} more lines"]
        return "\n".join(lines)


def summary_html(result: Summarised) -> str:
    """The lines of the ``repr`` for a notebook, the first one bold."""
    from bayestouch.summary_lines import lines_of

    first, *others = (escape(line) for line in lines_of(result))
    return f"<p><strong>{first}</strong></p>" + "".join(f"<p>{line}</p>" for line in others)


def _wrapped(line: str) -> list[str]:
    indent = " " * (len(line) - len(line.lstrip()))
    return wrap(line, WIDTH, subsequent_indent=f"{indent}  ")
