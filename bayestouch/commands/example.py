"""bayestouch example."""

from __future__ import annotations

from pathlib import Path

import click

from bayestouch.commands.options import spoken
from bayestouch.commands.output import check_new_dataset, say


@click.command(short_help="Write an example data set.")
@click.argument("name")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Data set folder to write.")
@spoken
def example(name: str, output: Path, quiet: bool, as_json: bool) -> None:
    """Write a data set of the package: "finger" (simulated) or "fluid-oil-1.5" (measured, CC BY 4.0).

    \b
    Example: bayestouch example fluid-oil-1.5 -o channel
    """
    from bayestouch.simulation.examples import EXAMPLES, save_example

    check_new_dataset(output)
    dataset = save_example(name, output)
    count = dataset.touches.n_touches
    facts = {"folder": str(output), "touches": count, "source": dict(dataset.sensor.source)}
    say(f": {count} touches, {EXAMPLES[name].summary}", facts, head=str(output), quiet=quiet, as_json=as_json)
