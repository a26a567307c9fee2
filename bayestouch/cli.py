"""Command line: calibrate, infer, diagnose, report, simulate."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from bayestouch import __version__
from bayestouch.errors import InputError
from bayestouch.progress import progress_bar

Command = TypeVar("Command", bound=Callable[..., Any])

CONTACTS = click.Choice(["layer", "hertz", "approximate frictionless"])
KERNELS = click.Choice(["auto", "layer", "layer-line", "half-space", "half-space-line", "gaussian"])


def _common(command: Command) -> Command:
    """Options every verb takes."""
    quiet = click.option("--quiet", is_flag=True, help="No progress and no summary.")
    seed = click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of all draws.")
    return quiet(seed(command))


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="bayestouch")
def cli() -> None:
    """How far a tactile sensor's readings can be trusted."""


@cli.command()
@click.argument("dataset", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Calibration to write (.nc).")
@click.option("--contact", type=CONTACTS, default=None, help="Contact model of a finger. [default: layer]")
@click.option(
    "--e-map", type=click.Choice(["model", "empirical"]), default=None, help="E map of a finger. [default: model]"
)
@click.option("--kernel", type=KERNELS, default=None, help="Kernel of a pad. [default: auto]")
@click.option(
    "--prior",
    "priors",
    multiple=True,
    metavar="NAME=KIND:A,B",
    help="Prior of a finger's parameter, such as sigma=normal:0.47,0.01, r_s=uniform:9.6,10.4 or "
    "mu=log-normal:0.15,1.35 (median, factor); repeatable.",
)
@click.option(
    "--model",
    type=click.Path(path_type=Path),
    default=None,
    help="Effects of a finger's chain: the model.toml of `bayestouch diagnose`.",
)
@click.option("--draws", type=click.IntRange(min=8), default=1000, show_default=True, help="Posterior draws kept.")
@_common
def calibrate(
    dataset: Path,
    output: Path,
    contact: str | None,
    e_map: str | None,
    kernel: str | None,
    priors: tuple[str, ...],
    model: Path | None,
    draws: int,
    seed: int,
    quiet: bool,
) -> None:
    """Calibrate a sensor from touches with known indenter and location.

    Example: bayestouch calibrate my-finger -o calibration.nc
    """
    import bayestouch
    from bayestouch.effects import read_model
    from bayestouch.prior_text import priors_from_text

    _check_output(output)
    effects = None if model is None else read_model(model)
    stated = priors_from_text(priors)
    with progress_bar("calibrate", quiet) as advance:
        calibration = bayestouch.calibrate(
            bayestouch.load_dataset(dataset),
            contact=contact,
            e_map=e_map,
            kernel=kernel,
            priors=stated,
            model=effects,
            draws=draws,
            seed=seed,
            progress=advance,
        )
        calibration.save(output)
        advance(1.0)
    if not quiet:
        numbers = ", ".join(f"{k.replace('_', ' ')} {v:.4g}" for k, v in calibration.statistics.items() if v == v)
        click.echo(f"{output}: {numbers}")
        _echo_notes(calibration.notes)


@cli.command()
@click.argument("touches", type=click.Path(path_type=Path))
@click.option(
    "--calibration", type=click.Path(path_type=Path), required=True, help="What `bayestouch calibrate` wrote."
)
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Posterior to write (.nc).")
@click.option(
    "--indenter",
    metavar="PRIOR",
    default=None,
    help="Prior over a finger's indenters: uniform (in R), curvature:SHARPEST, tips:0,0.5,2,inf (mm, with =WEIGHT "
    "if not equal), edge-or-round or edge-or-round:PROBABILITY, or a density such as r_c=log-normal:2,1.6. "
    "[default: uniform]",
)
@click.option("--plug-in", is_flag=True, help="Take the calibration as exact.")
@click.option("--no-load", is_flag=True, help="Do not use the force sensor's readings.")
@click.option("--no-check", is_flag=True, help="Do not look for faulty elements and a faulty force sensor.")
@click.option("--each-sample", is_flag=True, help="A posterior for each sample, not for each touch's mean.")
@click.option("--method", type=click.Choice(["emcee", "importance"]), default="emcee", show_default=True)
@click.option("--draws", type=click.IntRange(min=64), default=1024, show_default=True, help="Draws a touch.")
@click.option("--thin", type=click.IntRange(min=1), default=1, help="Save every so many-th draw. [default: all]")
@click.option("--summary-only", is_flag=True, help="Save means, sds, quantiles and grades, no draws.")
@_common
def infer(
    touches: Path,
    calibration: Path,
    output: Path,
    indenter: str | None,
    plug_in: bool,
    no_load: bool,
    no_check: bool,
    each_sample: bool,
    method: str,
    draws: int,
    thin: int,
    summary_only: bool,
    seed: int,
    quiet: bool,
) -> None:
    """Read touches: posterior of location, load and radius for each.

    The file is written block by block, however many touches there are. A run that was interrupted goes on where it
    stopped when the same command is given again.

    Example: bayestouch infer touches.csv --calibration calibration.nc -o posterior.nc
    """
    from bayestouch.indenter_text import indenter_from_text
    from bayestouch.inference import Kept, Options, infer_to_file
    from bayestouch.posterior import load_calibration, load_grades
    from bayestouch.touch_table import read_touches

    _check_output(output)
    options = Options(
        indenter=None if indenter is None else indenter_from_text(indenter),
        plug_in=plug_in,
        use_load=not no_load,
        check_sensor=not no_check,
        each_sample=each_sample,
        method=method,
        kept=Kept(draws, thin, summary_only),
        seed=seed,
    )
    calibrated = load_calibration(calibration)
    with progress_bar("infer", quiet) as advance:
        infer_to_file(read_touches(touches, calibrated.sensor), calibrated, output, options, progress=advance)
    if not quiet:
        stats, notes = load_grades(output)
        missed = int((stats["grade"] == 0).sum())
        click.echo(
            f"{output}: {len(stats['grade'])} touches, "
            f"bulk ESS {stats['ess_bulk'].min():.0f} or more, R-hat {stats['rhat'].max():.3f} or less; "
            + (f"{missed} missed the targets (grade 0 in sample_stats)" if missed else "all meet the targets")
        )
        _echo_notes(notes)


@cli.command()
@click.argument("dataset", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder to write.")
@click.option("--contact", type=CONTACTS, default="layer", show_default=True, help="Contact model to start from.")
@click.option("--json", "as_json", is_flag=True, help="Print diagnosis.json instead of words.")
@_common
def diagnose(dataset: Path, output: Path, contact: str, as_json: bool, seed: int, quiet: bool) -> None:
    """Find what the model misses, trace it to an effect, add that, and report before and after.

    Writes diagnosis.json, calibration_before.nc, calibration_after.nc, model.toml, figures and a script that
    repeats it.

    Example: bayestouch diagnose my-finger -o diagnosis
    """
    import json

    import bayestouch

    _check_folder(output)
    data = bayestouch.load_dataset(dataset)
    with progress_bar("diagnose", quiet) as advance:
        diagnosis = bayestouch.diagnose(data, contact=contact, seed=seed, progress=lambda part: advance(0.95 * part))
        diagnosis.save(output)
        advance(1.0)
    if as_json:
        click.echo(json.dumps(diagnosis.to_dict(), indent=1, ensure_ascii=False, allow_nan=False))
    elif not quiet:
        click.echo(f"{output}: {diagnosis}")
        _echo_notes(tuple(diagnosis.numbers["notes"]))


@cli.command()
@click.argument("dataset", type=click.Path(path_type=Path), required=False)
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder to write.")
@click.option("--plug-in", is_flag=True, help="Take the calibration as exact.")
@click.option("--draws", type=click.IntRange(min=64), default=1024, show_default=True, help="Draws a touch.")
@_common
def report(dataset: Path | None, output: Path, plug_in: bool, draws: int, seed: int, quiet: bool) -> None:
    """Calibrate, read all touches, and write a reliability report (index.html, report.json, figures).

    Without DATASET, the embedded simulated finger and the paper's tables are reported.

    Example: bayestouch report my-finger -o report
    """
    import bayestouch

    data = None if dataset is None else bayestouch.load_dataset(dataset)
    with progress_bar("report", quiet) as advance:
        bayestouch.report(data, output, seed=seed, draws=draws, plug_in=plug_in, progress=advance)
    if not quiet:
        click.echo(f"{output / 'index.html'}")


@cli.command()
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Data set folder to write.")
@click.option("--effect", "effects", multiple=True, metavar="NAME=VALUE", help="An effect and its size; repeatable.")
@click.option("--body", type=click.Choice(["finger", "pad"]), default="finger", show_default=True)
@_common
def simulate(output: Path, effects: tuple[str, ...], body: str, seed: int, quiet: bool) -> None:
    """Simulate a data set with known truth (written beside it as truth.json).

    Example: bayestouch simulate -o simulated-finger --effect crosstalk=0.04 --seed 3
    """
    from bayestouch.simulation import FingerDesign, PadDesign, save_simulated
    from bayestouch.simulation import simulate as simulate_dataset

    design = FingerDesign() if body == "finger" else PadDesign()
    with progress_bar("simulate", quiet) as advance:
        simulated = simulate_dataset(design, effects=_effects(effects), seed=seed)
        save_simulated(simulated, output)
        advance(1.0)
    if not quiet:
        click.echo(f"{output}: {simulated.dataset.touches.n_touches} touches, simulated with seed {seed}")


def _effects(pairs: tuple[str, ...]) -> dict[str, float]:
    effects: dict[str, float] = {}
    for pair in pairs:
        name, separator, text = pair.partition("=")
        try:
            value = float(text)
        except ValueError:
            separator = ""
        if not separator or not name:
            raise InputError(f"--effect: expected NAME=VALUE with a number, got {pair!r}")
        if name in effects:
            raise InputError(f"--effect: {name} is given twice")
        effects[name] = value
    return effects


def _check_output(path: Path) -> None:
    """Fail before the work, not after it."""
    if not path.parent.is_dir():
        raise InputError("the folder to write into does not exist", file=path.parent)
    if path.is_dir():
        raise InputError("expected the name of a file to write, this is a folder", file=path)


def _check_folder(path: Path) -> None:
    if path.exists() and not path.is_dir():
        raise InputError("expected the name of a folder to write, this is a file", file=path)


def _echo_notes(notes: tuple[str, ...]) -> None:
    for note in notes:
        click.echo(f"  note: {note}", err=True)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit status: 0 done, 2 wrong input or options, 1 anything else."""
    try:
        cli.main(args=arguments, prog_name="bayestouch", standalone_mode=False)
    except InputError as error:
        click.echo(f"bayestouch: {error}", err=True)
        return 2
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return 2
    except click.ClickException as error:
        click.echo(f"bayestouch: {' '.join(error.format_message().split())}", err=True)
        return 2
    except (click.Abort, KeyboardInterrupt):
        click.echo("bayestouch: stopped", err=True)
        return 130
    return 0


def run() -> None:
    """Entry point of the console script."""
    sys.exit(main())
