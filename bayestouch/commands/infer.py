"""bayestouch infer."""

from __future__ import annotations

import math
from pathlib import Path

import click

from bayestouch.commands.arguments import calibration_at, table_at
from bayestouch.commands.options import OneOf, clustered, grouped, seeded, spoken
from bayestouch.commands.output import Interrupted, check_output, say
from bayestouch.output.progress import progress_bar


def mixing(largest_rhat: float) -> str:
    """Largest R-hat of the touches in words. It is not finite where the chains of a touch did not move."""
    return f"R-hat {largest_rhat:.3f} or less" if math.isfinite(largest_rhat) else "chains not mixed"


@click.command(short_help="Read touches: location, load and radius.")
@click.argument("touches", type=click.Path(path_type=Path))
@click.option(
    "--calibration",
    type=click.Path(path_type=Path),
    required=True,
    help="Calibration from `bayestouch calibrate`.",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Posterior file to write (.nc).")
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
@click.option("--no-check", is_flag=True, help="Do not check for faulty elements and a faulty force sensor.")
@click.option("--each-sample", is_flag=True, help="Compute a posterior for each sample instead of each touch's mean.")
@click.option("--method", type=OneOf(["emcee", "importance"]), default="emcee", show_default=True)
@click.option("--draws", type=click.IntRange(min=64), default=1024, show_default=True, help="Draws per touch.")
@click.option("--thin", type=click.IntRange(min=1), default=1, help="Save one draw out of this many. [default: all]")
@click.option("--summary-only", is_flag=True, help="Save means, sds, quantiles and grades, but no draws.")
@grouped
@clustered
@seeded
@spoken
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
    groups: str,
    scheduler: str | None,
    seed: int,
    quiet: bool,
    as_json: bool,
) -> None:
    """Read touches: compute the posterior of location, load and radius of each touch.

    The file is written block by block, so that the number of touches is not limited by memory. To continue an
    interrupted run, repeat the same command.

    \b
    Example: bayestouch infer touches.csv --calibration calibration.nc -o posterior.nc
    """
    from bayestouch.inference import Kept, Options, infer_to_file
    from bayestouch.priors.indenter_text import indenter_from_text
    from bayestouch.results.data import poor_touches
    from bayestouch.results.reading import load_grades
    from bayestouch.results.schema import chosen_groups

    check_output(output, touches, calibration)
    options = Options(
        indenter=None if indenter is None else indenter_from_text(indenter),
        plug_in=plug_in,
        use_load=not no_load,
        check_sensor=not no_check,
        each_sample=each_sample,
        method=method,
        kept=Kept(draws, thin, summary_only),
        seed=seed,
        groups=chosen_groups(groups),
    )
    calibrated = calibration_at(calibration, table_at(touches))
    try:
        with progress_bar("infer", quiet) as advance:
            infer_to_file(touches, calibrated, output, options, scheduler=scheduler, progress=advance)
    except KeyboardInterrupt:
        raise Interrupted("repeat the same command to continue") from None
    stats, notes = load_grades(output)
    (unread, beyond, missed), count = poor_touches(stats), len(stats["grade"])
    facts = {
        "file": str(output),
        "touches": count,
        "missed_targets": missed,
        "beyond_priors": beyond,
        "without_reading": unread,
        "ess_bulk_least": stats["ess_bulk"].min(),
        "rhat_most": stats["rhat"].max(),
    }
    poor = [
        *([f"{unread} have no reading (grade 0)"] if unread else []),
        *([f"{beyond} are beyond the loads or places of the calibration (grade 0)"] if beyond else []),
        *([f"{missed} missed the targets (grade 0 in sample_stats)"] if missed else []),
    ]
    text = f": {count} touches, bulk ESS {facts['ess_bulk_least']:.0f} or more, {mixing(facts['rhat_most'])}; " + (
        "; ".join(poor) or "all meet the targets"
    )
    say(text, facts, head=str(output), quiet=quiet, as_json=as_json, notes=notes)
