"""Inference: posteriors of unknown touches, with the sensor known up to its calibration posterior."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bayestouch.data.dataset import DataSet
from bayestouch.data.files import check_not_read, file_to_write
from bayestouch.data.survey import survey
from bayestouch.data.touch_columns import check_in_memory
from bayestouch.data.touch_source import InMemory, Scattered, TouchSource, source_of
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError, not_a, require_whole
from bayestouch.model.body import body_of
from bayestouch.output.progress import Progress, require_progress
from bayestouch.parallel.cluster import require_address
from bayestouch.priors.indenters import IndenterPrior
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
from bayestouch.results.data import require_calibration
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.results.reading import load_touches
from bayestouch.results.schema import chosen_groups

__all__ = ["Kept", "Options", "infer", "infer_to_file", "infer_with"]


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
    groups: str | Sequence[str] = (),
    output: str | Path | None = None,
    seed: int = 0,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> TouchPosteriors:
    """Posteriors of touches: r_c, R, θ_c and P on a finger; x, y and P on a pad.

    Parameters
    ----------
    touches : Touches, str or Path
        The touches, or the path of their file, which is read piece by piece. Reference locations and radii are copied
        to the result but not used. If the calibration has `memory` or a drift, give the whole table: a touch is read
        with the touches before it, and without them its standard deviations are larger.
    calibration : Calibration
        The calibrated sensor.
    indenter : IndenterPrior, optional
        Prior of the indenter radius (fingers only): `UniformRadius` (the default), `UniformCurvature`,
        `IndenterDistribution`, `KnownTips` or `EdgeOrRound`. With the last two, `tips` of the result holds the
        probability of each tip for each touch, and the draws of R and r_c have the values of the tips.
    plug_in : bool
        Use the mode of the calibration and ignore the uncertainty of the calibration. A pad's error of the place, which
        is not of the calibration, remains.
    use_load : bool
        Use the reading of the force sensor if there is one. P in the result is the true load; the readings of the
        force sensor are in `TouchPosteriors.rows`.
    check_sensor : bool
        Look for elements (dead, stuck, swapped, changed gain or zero) and a force sensor that no longer read as in the
        calibration, and leave them out; the notes name them. For fingers, and for pads with at least three elements.
    each_sample : bool
        Infer a posterior for each sample, not for the mean of each touch (fingers only). The coordinate ``sample`` and
        ``rows.sample`` say which one it is.
    method : {"emcee", "importance"}
        Markov chains by emcee, or Pareto-smoothed importance sampling, which uses Markov chains for touches with poor
        weights (fingers only).
    draws : int
        Draws of a touch, over all chains.
    thin : int
        Keep every `thin`-th draw of each chain. Grades and `TouchPosteriors.estimates` use all draws.
    summary_only : bool
        Keep no draws, only means, standard deviations, quantiles and grades.
    groups : str or sequence of str
        Further groups of the ArviZ schema, for every draw that is kept: some of ``"log_likelihood"``, ``"log_prior"``,
        ``"prior"``, ``"prior_predictive"``, ``"posterior_predictive"``, or ``"all"``. Groups of readings take 4 bytes
        for each draw, touch and element: 66 MB for 1,000 touches of 16 elements with 1,024 draws.
    output : str or Path, optional
        Posterior file to write block by block, so that only one block of draws is in memory. An interrupted run
        leaves a folder ``OUTPUT.partial``; the same call continues it, and the result is identical to the last bit.
        The value returned is read from the file: draws larger than 1 GB stay on file, and each parameter is read
        when it is used.
    seed : int
        Seed of every random number. The random numbers of a touch depend only on it and on how many touches are before
        the touch in the table, not on its id.
    workers : int, optional
        Number of processes; by default the number of cores. The result does not depend on it.
    scheduler : str, optional
        Address of the scheduler of a Dask cluster that computes the blocks instead of this machine, such as
        ``tcp://10.0.0.5:8786``. The result is the same.
    progress : callable, optional
        Function that is called with the fraction of the work that is done.

    Returns
    -------
    TouchPosteriors
        Draws and grades, in mm, degree and N/m on a finger, in mm and N on a pad.

    Raises
    ------
    InputError
        If the table does not fit the calibrated sensor, has a value that files may not have or no row in contact, the
        output cannot be written or is the file of the touches, or the cluster cannot be reached.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> touches = bayestouch.infer(dataset.touches, calibration, draws=256)
    >>> touches.mean("theta_c")[[0, 4]].round()  # location, degree
    array([-20.,  20.])
    >>> bool((touches.sd("theta_c") < 0.1).all())
    True
    >>> touches.save("posterior.nc")
    """
    require_calibration(calibration)
    require_progress(progress)
    require_address(scheduler)
    if not isinstance(touches, Touches | str | Path):
        is_whole = isinstance(touches, DataSet)
        how = "use its attribute touches" if is_whole else "give the path of their file, or a table of a data set"
        raise not_a("touches", touches, how)
    kept = Kept(draws, thin, summary_only, summarised=output is not None)
    chosen = chosen_groups(groups)
    options = Options(indenter, plug_in, use_load, check_sensor, each_sample, method, kept, seed, chosen)
    if output is not None:
        infer_to_file(touches, calibration, output, options, workers=workers, scheduler=scheduler, progress=progress)
        return load_touches(output)
    executor = _executor(workers, scheduler)
    run, _ = _run(touches, calibration, options)
    return read_in_memory(run, kept, executor, progress)


def infer_with(touches: Touches, calibration: Calibration, options: Options) -> TouchPosteriors:
    """Posteriors of a table in memory by all cores, as of `infer`, with options that it does not have."""
    run, _ = _run(touches, calibration, options)
    return read_in_memory(run, options.kept, _executor(None, None), None)


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
    """Write the posteriors of all touches to a file, block by block; `infer` does this and then opens the file."""
    path = file_to_write(output)
    if not isinstance(touches, Touches):
        check_not_read(path, [touches])
    executor = _executor(workers, scheduler)
    run, source = _run(touches, calibration, options)
    mark = fingerprint(source, calibration, options)
    read_to_file(run, options.kept, executor, path, mark, progress)


def _executor(workers: int | None, scheduler: str | None) -> Executor:
    if workers is not None:
        require_whole("workers", workers, 1)
    if scheduler is None:
        return local_executor(workers)
    return cluster_executor(scheduler)


def _run(touches: Touches | str | Path, calibration: Calibration, options: Options) -> tuple[TouchRun, TouchSource]:
    """Prepared touches, and their source."""
    source = InMemory(touches) if isinstance(touches, Touches) else source_of(touches, calibration.sensor)
    options.check(source, calibration)
    if isinstance(touches, Touches):  # those of a file are checked where they are read
        check_in_memory(touches)
    body = body_of(calibration.sensor)
    body.own(options.of_some_bodies)
    try:
        found = survey(source)
    except Scattered:
        source = InMemory(source.whole())
        found = survey(source)
    if not found.n_touches:
        file = None if isinstance(touches, Touches) else touches
        raise InputError("no row of the table is in contact: there is nothing to infer", file=file)
    return touch_run(body.reader(calibration, options), source, found, calibration, options), source
