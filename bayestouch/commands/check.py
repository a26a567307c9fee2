"""bayestouch check."""

from __future__ import annotations

from pathlib import Path

import click

from bayestouch.commands.arguments import dataset_at
from bayestouch.commands.options import spoken
from bayestouch.commands.output import check_output, say


@click.command(short_help="Show the contents of a data set and what is missing.")
@click.argument("dataset", type=click.Path(path_type=Path))
@click.option("--plot", type=click.Path(path_type=Path), default=None, help="Image file to write (.png, .svg, .pdf).")
@spoken
def check(dataset: Path, plot: Path | None, quiet: bool, as_json: bool) -> None:
    """Validate a data set and show its contents, unusual features and missing information.

    \b
    Example: bayestouch check my-finger --plot my-finger.png
    """
    import bayestouch
    from bayestouch.data.dataset import dataset_files

    if plot is not None:
        check_output(plot, *dataset_files(dataset))
    checked = bayestouch.check(dataset_at(dataset))
    if plot is not None:
        checked.save_plot(plot)
    say(checked.text, checked.facts, head=checked.title, quiet=quiet, as_json=as_json, notes=checked.notes)
