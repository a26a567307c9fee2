"""bayestouch init."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from bayestouch.commands.options import OneOf, spoken
from bayestouch.commands.output import say
from bayestouch.data.geometry import BODIES


@click.command(short_help="Write a template of a data set.")
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--body", type=OneOf(tuple(BODIES)), default="finger", show_default=True)
@click.option("--elements", type=click.IntRange(min=1), default=8, show_default=True, help="Number of elements.")
@spoken
def init(folder: Path, body: str, elements: int, quiet: bool, as_json: bool) -> None:
    """Write a template of a data set: a sensor.toml with comments and empty tables to fill in.

    \b
    Example: bayestouch init my-finger --elements 16
    """
    from bayestouch.data.template import new_dataset

    files = new_dataset(folder, body=body, elements=elements)
    text = (
        f": {', '.join(file.name for file in files)}\n"
        f"Fill them in, then look at what was read: {shlex.join(('bayestouch', 'check', str(folder)))}"
    )
    say(text, {"files": [str(file) for file in files]}, head=str(folder), quiet=quiet, as_json=as_json)
