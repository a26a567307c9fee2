"""Infer: the touches are unknown, the sensor is known up to its posterior."""

from __future__ import annotations

from pathlib import Path

from bayestouch.data.survey import survey
from bayestouch.data.touch_source import InMemory, Scattered, TouchSource, source_of
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.model.body import body_of
from bayestouch.priors.indenters import IndenterPrior
from bayestouch.progress import Progress
from bayestouch.reading.driver import (
    Executor,
    TouchRun,
    cluster_executor,
    fingerprint,
    local_executor,
    read_in_memory,
    read_to_file,
)
from bayestouch.reading.options import Kept, Options
from bayestouch.reading.run import touch_run
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.results.reading import load_touches

__all__ = ["Kept", "Options", "infer", "infer_to_file"]


def infer(
    touches: Touches | str | Path,
    calibration: Calibration,
    *,
    indenter: IndenterPrior | None = None,
    plug_in: bool = False,
    use_load: bool = True,
    check_sensor: bool = True,
    each_sample: bool = False,
    method: str = "emcee",
    draws: int = 1024,
    thin: int = 1,
    summary_only: bool = False,
    output: str | Path | None = None,
    seed: int = 0,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> TouchPosteriors:
    """Posterior of every touch: on a finger r_c, R, θ_c and P; on a pad x, y and P.

    Parameters
    ----------
    touches : Touches, str or Path
        What was read, or the file that holds it, of which no more than a piece is then in memory. Reference locations
        and radii are carried along, never used.
    calibration : Calibration
        The calibrated sensor.
    indenter : IndenterPrior, optional
        What is known of the indenters beforehand (fingers only): `UniformRadius` (the default), `UniformCurvature`,
        `IndenterDistribution`, `KnownTips` or `EdgeOrRound`. With the last two the result's `tips` says how
        probable each is for each touch, and the draws of R and r_c take the tips' values.
    plug_in : bool
        Take the calibration at its mode instead of integrating over what it leaves uncertain.
    use_load : bool
        Use the force sensor's reading where there is one. The P of a result is the true load; what the force sensor
        read is in `TouchPosteriors.rows`.
    check_sensor : bool
        Look for elements (dead, stuck, swapped, of another gain or zero) and a force sensor that no longer read as
        calibrated, and go on without them; the notes say which. Fingers, and pads of three elements and more.
    each_sample : bool
        A posterior for each sample in place of one for each touch's mean (fingers only).
    method : {"emcee", "importance"}
        Markov chains by emcee, or Pareto-smoothed importance sampling that falls back to them where a touch's
        weights are poor (fingers only).
    draws : int
        Draws a touch, over all chains.
    thin : int
        Of each chain every so many-th draw is kept. Grades and `TouchPosteriors.summary` are of all draws.
    summary_only : bool
        Keep no draws: means, standard deviations, quantiles and grades alone.
    output : str or Path, optional
        Posterior file to write block by block, so that memory holds one block of draws however many touches there
        are. An interrupted run leaves ``OUTPUT.partial``; the same call goes on from it, and its result is the same
        to the last bit. What is returned is the file, opened: of draws beyond 1 GB each parameter is read when it is
        asked for.
    seed : int
        Seed of every random number; a touch's draws depend on it and on the touch's place in the table alone.
    workers : int, optional
        Processes; as many as there are cores by default. The result does not depend on it.
    scheduler : str, optional
        Address of the scheduler of a Dask cluster that reads the blocks instead of this machine, such as
        ``tcp://10.0.0.5:8786``. The result is the same.
    progress : callable, optional
        Called with the fraction done.

    Raises
    ------
    InputError
        If the table does not fit the calibrated sensor or no row is in contact, the output cannot be written, or the
        cluster cannot be reached.
    """
    kept = Kept(draws, thin, summary_only, summarised=output is not None)
    options = Options(indenter, plug_in, use_load, check_sensor, each_sample, method, kept, seed)
    if output is not None:
        infer_to_file(touches, calibration, output, options, workers=workers, scheduler=scheduler, progress=progress)
        return load_touches(output)
    run, _ = _run(touches, calibration, options)
    return read_in_memory(run, kept, _executor(workers, scheduler), progress)


def infer_to_file(
    touches: Touches | str | Path,
    calibration: Calibration,
    output: str | Path,
    options: Options,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> None:
    """Write the posterior of every touch to a file, block by block; as `infer`, which then opens it."""
    path = Path(output)
    if path.is_dir():
        raise InputError("expected the name of a file to write, this is a folder", file=path)
    run, source = _run(touches, calibration, options)
    mark = fingerprint(source, calibration, options)
    read_to_file(run, options.kept, _executor(workers, scheduler), path, mark, progress)


def _executor(workers: int | None, scheduler: str | None) -> Executor:
    if scheduler is None:
        return local_executor(workers)
    return cluster_executor(scheduler)


def _run(touches: Touches | str | Path, calibration: Calibration, options: Options) -> tuple[TouchRun, TouchSource]:
    """Touches ready to be read, and where they come from."""
    source = InMemory(touches) if isinstance(touches, Touches) else source_of(touches, calibration.sensor)
    options.check(source, calibration)
    body = body_of(calibration.sensor)
    body.own(options.of_some_bodies)
    try:
        found = survey(source)
    except Scattered:
        source = InMemory(source.whole())
        found = survey(source)
    if not found.n_touches:
        raise InputError("no row of the table is in contact: there is nothing to infer")
    return touch_run(body.reader(calibration, options), source, found, calibration, options), source
