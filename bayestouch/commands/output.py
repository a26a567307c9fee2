"""What every verb prints, and how it ends."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from bayestouch.errors import InputError


class Interrupted(Exception):
    """Ctrl-C; the text says what to do about it."""

    def __init__(self, hint: str = "") -> None:
        super().__init__(f"stopped; {hint}" if hint else "stopped, nothing was written")


def check_output(path: Path) -> None:
    """Fail before the work, not after it."""
    if not path.parent.is_dir():
        raise InputError("the folder to write into does not exist", file=path.parent)
    if path.is_dir():
        raise InputError("expected the name of a file to write, this is a folder", file=path)


def check_folder(path: Path) -> None:
    """The same for a folder."""
    if path.exists() and not path.is_dir():
        raise InputError("expected the name of a folder to write, this is a file", file=path)


def say(
    text: str, facts: Mapping[str, Any], *, quiet: bool, as_json: bool, notes: Sequence[str] = (), head: str = ""
) -> None:
    """Print a summary: for people, or with `--json` the same facts (and notes) as one JSON object.

    Parameters
    ----------
    text : str
        What people read; `head`, in bold, comes before it.
    facts : mapping
        What programs read; numbers that are not finite become null.
    quiet : bool
        Print nothing, unless JSON is asked for.
    as_json : bool
        Print the facts instead of the text.
    notes : sequence of str
        Printed on standard error, so that they do not disturb what a pipe reads.
    """
    if as_json:
        from bayestouch.data.json_values import strict

        click.echo(json.dumps(strict({**facts, "notes": list(notes)}), ensure_ascii=False, allow_nan=False, indent=1))
        return
    if quiet:
        return
    click.echo(f"{click.style(head, bold=True)}{text}")
    for note in notes:
        click.echo(f"  {click.style('note:', fg='yellow')} {note}", err=True)
