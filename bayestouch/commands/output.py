"""Printed summary of a command, checks of its output path, and interruption."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from bayestouch.errors import InputError


class Interrupted(Exception):
    """The user pressed Ctrl-C; `hint` says what to do next."""

    def __init__(self, hint: str = "") -> None:
        super().__init__(f"stopped; {hint}" if hint else "stopped, nothing was written")


def check_output(path: Path, *inputs: Path) -> None:
    """Raise an error if a file cannot be written at this path, or is an input, before the computation starts."""
    from bayestouch.data.files import check_not_read, check_writable, file_to_write

    target = file_to_write(path)
    if not target.parent.exists():
        folder = shlex.quote(str(target.parent))
        raise InputError(
            f"the folder to write into does not exist; make it with: mkdir -p {folder}", file=target.parent
        )
    check_writable(target)
    check_not_read(path, inputs)


def check_folder(path: Path) -> None:
    """Raise an error if a folder cannot be written at this path, before the computation starts."""
    from bayestouch.data.files import check_writable

    if path.exists() and not path.is_dir():
        raise InputError("expected the name of a folder to write, this is a file", file=path)
    check_writable(path)
    if path.is_dir():  # its files are replaced one by one
        check_writable(path / "index.html")


def check_new_dataset(folder: Path) -> None:
    """Raise an error if a folder holds a data set that is not simulated: what was measured cannot be made again."""
    from bayestouch.data.dataset import dataset_files
    from bayestouch.simulation import TRUTH

    if (folder / TRUTH).is_file():
        return
    for file in dataset_files(folder):
        if file.is_file():
            why = f"the data set is not simulated (no {TRUTH} beside it)"
            raise InputError(f"exists already and is not replaced: {why}; give another folder", file=file)


def say(
    text: str, facts: Mapping[str, Any], *, quiet: bool, as_json: bool, notes: Sequence[str] = (), head: str = ""
) -> None:
    """Print a summary as text or, with `--json`, as one JSON object with facts and notes.

    Parameters
    ----------
    text : str
        Text of the summary; `head` is printed before it in bold.
    facts : mapping
        Content of the JSON object; numbers that are not finite become null.
    quiet : bool
        Print nothing, except JSON with `as_json`.
    as_json : bool
        Print the facts instead of the text.
    notes : sequence of str
        Notes, printed on standard error to keep standard output clean for pipes.
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


def show_page(page: Path) -> None:
    """Open a page in the browser of the user; where there is none, say so on standard error."""
    import webbrowser

    try:
        opened = webbrowser.open(page.resolve().as_uri())
    except webbrowser.Error:
        opened = False
    if not opened:
        click.echo(f"  {click.style('note:', fg='yellow')} no browser was found; open {page} yourself", err=True)


def say_next_step(folder: Path) -> None:
    """Print what a folder holds and the commands that come next."""
    from bayestouch.commands.folders import next_step_in

    step = next_step_in(folder)
    click.echo(step.found)
    for command, purpose in step.commands:
        click.echo(f"\n  {click.style(command, bold=True)}\n      {purpose}")
    click.echo("\nAll commands: bayestouch --help")
