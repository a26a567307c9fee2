"""bayestouch calibrate."""

from __future__ import annotations

from pathlib import Path

import click

from bayestouch.commands.arguments import dataset_at, model_at
from bayestouch.commands.options import CONTACTS, KERNELS, OneOf, grouped, seeded, spoken
from bayestouch.commands.output import check_output, say
from bayestouch.output.progress import progress_bar


@click.command(short_help="Calibrate a sensor from known touches.")
@click.argument("dataset", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Calibration file to write (.nc).")
@click.option("--contact", type=CONTACTS, default=None, help="Contact model of a finger. [default: layer]")
@click.option(
    "--e-map",
    type=OneOf(["auto", "model", "empirical"]),
    default=None,
    help="E map of a finger: model or empirical. On a pad: the kernel alone (model), an empirical map (empirical), or "
    "the one that predicts held-out readings better (auto). [default: model; on a pad auto]",
)
@click.option(
    "--discrepancy",
    type=OneOf(["auto", "none", "touch", "place"]),
    default=None,
    help="What a finger's readings may miss the model by: nothing, errors independent from touch to touch, or smooth "
    "functions of the place beside them. [default: auto, the one that predicts held-out places best]",
)
@click.option("--kernel", type=KERNELS, default=None, help="Kernel of a pad. [default: auto]")
@click.option(
    "--prior",
    "priors",
    multiple=True,
    metavar="NAME=KIND:A,B",
    help="Prior of a parameter, such as sigma=normal:0.47,0.01, r_s=uniform:9.6,10.4 or mu=log-normal:0.15,1.35 "
    "(median, factor), on a pad h=normal:6,0.1 or gain=log-normal:12,1.2; repeatable.",
)
@click.option(
    "--like",
    multiple=True,
    type=click.Path(path_type=Path),
    help="Calibration of an earlier finger of the same build, from which priors are learned; repeatable.",
)
@click.option(
    "--model",
    type=click.Path(path_type=Path),
    default=None,
    help="Effects of the sensor: model.toml from `bayestouch diagnose`.",
)
@click.option("--draws", type=click.IntRange(min=8), default=1000, show_default=True, help="Posterior draws to save.")
@grouped
@seeded
@spoken
def calibrate(
    dataset: Path,
    output: Path,
    contact: str | None,
    e_map: str | None,
    discrepancy: str | None,
    kernel: str | None,
    priors: tuple[str, ...],
    like: tuple[Path, ...],
    model: Path | None,
    draws: int,
    groups: str,
    seed: int,
    quiet: bool,
    as_json: bool,
) -> None:
    """Calibrate a sensor from touches with known indenter and location.

    \b
    Example: bayestouch calibrate my-finger -o calibration.nc
    """
    import bayestouch
    from bayestouch.data.dataset import dataset_files
    from bayestouch.effects import read_model
    from bayestouch.priors.prior_text import priors_from_text

    of_model = () if model is None else (model, model / "model.toml")
    check_output(output, *dataset_files(dataset), *like, *of_model)
    data = dataset_at(dataset)
    effects = None if model is None else read_model(model_at(model, dataset))
    stated = priors_from_text(priors)
    with progress_bar("calibrate", quiet) as advance:
        calibration = bayestouch.calibrate(
            data,
            contact=contact,
            e_map=e_map,
            discrepancy=discrepancy,
            kernel=kernel,
            priors=stated,
            like=like,
            model=effects,
            draws=draws,
            groups=groups,
            seed=seed,
            progress=advance,
        )
        calibration.save(output)
        advance(1.0)
    statistics = calibration.statistics
    numbers = ", ".join(f"{k.replace('_', ' ')} {v:.4g}" for k, v in statistics.items() if v == v)
    facts = {"file": str(output), "statistics": statistics, "settings": calibration.settings}
    say(f": {numbers}", facts, head=str(output), quiet=quiet, as_json=as_json, notes=calibration.notes)
