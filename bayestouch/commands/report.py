"""bayestouch report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from bayestouch.commands.arguments import calibration_at, dataset_at, diagnosis_at
from bayestouch.commands.options import seeded, spoken
from bayestouch.commands.output import check_folder, say, show_page
from bayestouch.errors import InputError
from bayestouch.output.progress import progress_bar


@click.command(short_help="Write a reliability report.")
@click.argument("datasets", nargs=-1, metavar="[DATASET] [SECOND]", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder to write.")
@click.option("--plug-in", is_flag=True, help="Take the calibration as exact.")
@click.option(
    "--diagnosis", type=click.Path(path_type=Path), default=None, help="Folder of a saved diagnosis to include."
)
@click.option("--no-diagnosis", is_flag=True, help="Do not search for effects that are not in the model.")
@click.option(
    "--baselines",
    is_flag=True,
    help="On a pad, also read held-out touches by regression without physics (needs scikit-learn).",
)
@click.option("--open", "open_page", is_flag=True, help="Open the page in a browser when it is written.")
@click.option("--draws", type=click.IntRange(min=64), default=1024, show_default=True, help="Draws per touch.")
@seeded
@spoken
def report(
    datasets: tuple[Path, ...],
    output: Path,
    plug_in: bool,
    diagnosis: Path | None,
    no_diagnosis: bool,
    baselines: bool,
    open_page: bool,
    draws: int,
    seed: int,
    quiet: bool,
    as_json: bool,
) -> None:
    """Calibrate, read all touches, and write a reliability report (index.html, report.json, figures).

    Without DATASET, the report is on the embedded simulated finger and the tables of the paper. With two data sets,
    or two calibrations (.nc), the report compares them.

    \b
    Example: bayestouch report my-finger -o report
    """
    import bayestouch

    check_folder(output)
    if no_diagnosis and diagnosis is not None:
        raise InputError("--diagnosis and --no-diagnosis exclude each other")
    if baselines and (no_diagnosis or diagnosis is not None):
        other = "--no-diagnosis" if no_diagnosis else "--diagnosis"
        raise InputError(f"--baselines and {other} exclude each other: touches of a diagnosis made now are read")
    if len(datasets) > 2:
        raise InputError(f"expected at most two data sets or calibrations to compare, got {len(datasets)}")
    if len(datasets) == 2:
        if plug_in or baselines or diagnosis is not None:
            raise InputError("--plug-in, --baselines and --diagnosis are options of a report on one data set")
        first, second = (_side(each) for each in datasets)
        with progress_bar("compare", quiet) as advance:
            compared = bayestouch.compare(
                first, second, output, seed=seed, draws=draws, diagnosis=not no_diagnosis, progress=advance
            )
        facts = {"page": str(output / "index.html"), "sentences": compared.numbers["sentences"]}
        say(f": {compared}", facts, head=str(output / "index.html"), quiet=quiet, as_json=as_json)
        if open_page:
            show_page(output / "index.html")
        return
    data = dataset_at(datasets[0]) if datasets else None
    wanted = not no_diagnosis if diagnosis is None else diagnosis_at(diagnosis, datasets[0] if datasets else None)
    with progress_bar("report", quiet) as advance:
        written = bayestouch.report(
            data,
            output,
            seed=seed,
            draws=draws,
            plug_in=plug_in,
            diagnosis=wanted,
            baselines=baselines,
            progress=advance,
        )
    facts = {
        "page": str(output / "index.html"),
        "numbers": str(output / "report.json"),
        "answer": written.numbers["answer"],
    }
    say("", facts, head=str(output / "index.html"), quiet=quiet, as_json=as_json)
    if open_page:
        show_page(output / "index.html")


def _side(path: Path) -> Any:
    """Load a data set, or a calibration if the path is a .nc file."""
    return calibration_at(path) if path.suffix == ".nc" else dataset_at(path)
