"""bayestouch diagnose."""

from __future__ import annotations

from pathlib import Path

import click

from bayestouch.commands.arguments import dataset_at
from bayestouch.commands.options import CONTACTS, KERNELS, clustered, seeded, spoken
from bayestouch.commands.output import check_folder, say
from bayestouch.output.progress import progress_bar, staged


@click.command(short_help="Find the effects that explain the model error, and add them.")
@click.argument("dataset", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder to write.")
@click.option("--contact", type=CONTACTS, default=None, help="Contact model of a finger. [default: layer]")
@click.option("--kernel", type=KERNELS, default=None, help="Kernel of a pad. [default: auto]")
@seeded
@clustered
@spoken
def diagnose(
    dataset: Path,
    output: Path,
    contact: str | None,
    kernel: str | None,
    seed: int,
    scheduler: str | None,
    quiet: bool,
    as_json: bool,
) -> None:
    """Find the effects that explain the model error, add them to the model, and compare before and after.

    Writes diagnosis.json, calibration_before.nc, calibration_after.nc, model.toml, figures and a script that
    repeats the diagnosis. With --json the output is diagnosis.json.

    \b
    Example: bayestouch diagnose my-finger -o diagnosis
    """
    import bayestouch

    check_folder(output)
    data = dataset_at(dataset)
    with progress_bar("diagnose", quiet) as advance:
        diagnosis = bayestouch.diagnose(
            data,
            contact=contact,
            kernel=kernel,
            seed=seed,
            scheduler=scheduler,
            progress=staged(advance, 0.0, 0.95),
        )
        diagnosis.save(output)
        advance(1.0)
    numbers = diagnosis.to_dict()
    say(f": {diagnosis}", numbers, head=str(output), quiet=quiet, as_json=as_json, notes=numbers["notes"])
