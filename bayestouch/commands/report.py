"""bayestouch report."""

from __future__ import annotations

from pathlib import Path

import click

from bayestouch.commands.options import seeded, spoken
from bayestouch.commands.output import say
from bayestouch.errors import InputError
from bayestouch.progress import progress_bar


@click.command(short_help="Write a reliability report.")
@click.argument("dataset", type=click.Path(path_type=Path), required=False)
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder to write.")
@click.option("--plug-in", is_flag=True, help="Take the calibration as exact.")
@click.option(
    "--diagnosis", type=click.Path(path_type=Path), default=None, help="Folder of a saved diagnosis to tell of."
)
@click.option("--no-diagnosis", is_flag=True, help="Do not search for effects that the model misses.")
@click.option("--draws", type=click.IntRange(min=64), default=1024, show_default=True, help="Draws a touch.")
@seeded
@spoken
def report(
    dataset: Path | None,
    output: Path,
    plug_in: bool,
    diagnosis: Path | None,
    no_diagnosis: bool,
    draws: int,
    seed: int,
    quiet: bool,
    as_json: bool,
) -> None:
    """Calibrate, read all touches, and write a reliability report (index.html, report.json, figures).

    Without DATASET, the embedded simulated finger and the paper's tables are reported.

    \b
    Example: bayestouch report my-finger -o report
    """
    import bayestouch

    if no_diagnosis and diagnosis is not None:
        raise InputError("--diagnosis and --no-diagnosis exclude each other")
    wanted = not no_diagnosis if diagnosis is None else diagnosis
    data = None if dataset is None else bayestouch.load_dataset(dataset)
    with progress_bar("report", quiet) as advance:
        written = bayestouch.report(
            data, output, seed=seed, draws=draws, plug_in=plug_in, diagnosis=wanted, progress=advance
        )
    facts = {
        "page": str(output / "index.html"),
        "numbers": str(output / "report.json"),
        "answer": written.numbers["answer"],
    }
    say("", facts, head=str(output / "index.html"), quiet=quiet, as_json=as_json)
