"""Computations for a report: calibration, inference of the touches, search for missing effects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import pad_of
from bayestouch.data.splits import with_calibration
from bayestouch.errors import InputError
from bayestouch.model.body import body_of
from bayestouch.output.progress import Progress, Stage, staged
from bayestouch.parallel.beside import both
from bayestouch.reporting.bodies import PAGES
from bayestouch.reporting.checks import CALIBRATION_GROUPS, MOST_PREDICTED, TOUCH_GROUPS
from bayestouch.reporting.diagnosed import Diagnosed, light_diagnosis, saved_diagnosis
from bayestouch.reporting.evidence import Evidence
from bayestouch.results.objects import TouchPosteriors

Draft = TypeVar("Draft")
# Fractions of the total time, for the progress bar.
_CALIBRATED, _READ, _DRAFTED, GATHERED = 0.2, 0.35, 0.5, 0.95
# Draws of a calibration and of a touch that `bayestouch.calibrate` and `bayestouch.report` make by default.
_DRAWS, _DRAWS_OF_TOUCH = 1000, 1024


def gather(
    dataset: DataSet | None,
    draft: Callable[[Evidence, Progress | None], Draft],
    *,
    seed: int,
    draws: int,
    plug_in: bool,
    diagnosis: bool | Path = False,
    baselines: bool = False,
    progress: Progress | None = None,
) -> tuple[Draft, Diagnosed | None]:
    """What a report makes of calibration and posteriors, and the diagnosis if requested.

    Parameters
    ----------
    dataset : DataSet or None
        Data set; None for the simulated finger of the package.
    draft : callable
        Function of the evidence without the diagnosis, and of its own progress. It is called while the search for
        effects is still at work in another process.
    seed, draws, plug_in
        As in `bayestouch.infer`.
    diagnosis : bool or Path
        True to search for effects, or the folder of a saved diagnosis.
    baselines : bool
        Read the held-out touches of the diagnosis by regression without physics too; for pads.
    progress : callable, optional
        Function that is called with the fraction of the whole report that is done.

    Raises
    ------
    InputError
        As in `bayestouch.calibrate` and `bayestouch.infer`, or if `baselines` cannot be had.
    """
    embedded, truth = dataset is None, {}
    if dataset is None:
        from bayestouch.simulation import embedded_dataset

        simulated = embedded_dataset()
        dataset, truth = simulated.dataset, dict(simulated.truth)
    if baselines:
        # At once, not after minutes.
        _require_baselines(dataset, diagnosis)
    if dataset.sensor.body.kind not in PAGES:
        raise InputError(f"there is no report of a {dataset.sensor.body.kind}, only of {' and '.join(PAGES)}")
    _require_readings(dataset)
    given, dataset = dataset, with_calibration(dataset)
    # Read the saved diagnosis first, so that a wrong folder is reported at once.
    saved = saved_diagnosis(diagnosis, given) if isinstance(diagnosis, Path) else None
    searched = saved is None and diagnosis is not False

    def reads() -> Draft:
        evidence = _read(dataset, embedded, truth, seed, draws, plug_in, progress)
        return draft(evidence, staged(progress, _READ, _DRAFTED if searched else GATHERED, "draw the figures"))

    if not searched:
        return reads(), saved
    # The search splits the touches as `bayestouch diagnose` does: a scan of a pad into blocks in time.
    read = PAGES[dataset.sensor.body.kind].reads_held_out
    searches = partial(light_diagnosis, given, seed, read=read, baselines=baselines)
    return both(reads, searches, None if progress is None else Stage(progress, _DRAFTED, GATHERED, "diagnose"))


def calibration_draws(draws: int) -> int:
    """Draws of the calibration of a report with so many draws of a touch: its own default, or as many more."""
    return max(_DRAWS, round(_DRAWS * draws / _DRAWS_OF_TOUCH))


def _read(
    dataset: DataSet,
    embedded: bool,
    truth: Mapping[str, Any],
    seed: int,
    draws: int,
    plug_in: bool,
    progress: Progress | None,
) -> Evidence:
    """Calibration and posteriors; arguments as of `gather` and attributes of `Evidence`."""
    from bayestouch.calibration import calibrate
    from bayestouch.inference import infer

    body = body_of(dataset.sensor)
    groups = CALIBRATION_GROUPS if "groups" in body.options else ()
    calibration = calibrate(
        dataset,
        groups=groups,
        draws=calibration_draws(draws),
        seed=seed,
        progress=staged(progress, 0.0, _CALIBRATED, "calibrate"),
    )
    both_ways = bool(PAGES[dataset.sensor.body.kind].plug_in_compared)
    part = (_READ - _CALIBRATED) / (4 if both_ways else 2)

    predicted = len(np.unique(dataset.touches.touch)) * dataset.sensor.n_elements * draws

    def read(exact: bool, use_load: bool, run: int) -> TouchPosteriors:
        return infer(
            dataset.touches,
            calibration,
            plug_in=exact,
            use_load=use_load,
            groups=TOUCH_GROUPS if run == 0 and predicted <= MOST_PREDICTED else (),
            draws=draws,
            seed=seed,
            progress=staged(progress, _CALIBRATED + part * run, _CALIBRATED + part * (run + 1), "read touches"),
        )

    def infer_with_and_without_load(exact: bool, run: int) -> tuple[TouchPosteriors, TouchPosteriors | None]:
        posteriors = read(exact, True, run)
        measured = np.isfinite(posteriors.rows.load).any()
        return posteriors, read(exact, False, run + 1) if measured else None

    with_load, no_load = infer_with_and_without_load(plug_in, 0)
    evidence = Evidence(dataset, calibration, with_load, no_load, embedded, truth, seed, draws, plug_in)
    if both_ways:
        with_load, no_load = infer_with_and_without_load(not plug_in, 2)
        other = replace(evidence, posteriors=with_load, without_load=no_load, plug_in=not plug_in)
        evidence = replace(evidence, counterpart=other)
    return evidence


def _require_readings(dataset: DataSet) -> None:
    """Raise an error for a finger whose touches have fewer readings than unknowns, at once and not after minutes."""
    fitted = dataset.touches if dataset.calibration is None else dataset.calibration
    # Nothing is read from a dead element.
    readings = int(fitted.usable_elements.sum()) + bool(np.isfinite(dataset.touches.load).any())
    if dataset.sensor.body.reads_radius and readings < 3:
        raise InputError(
            "a report of a finger needs three readings of a touch for radius, location and load: more elements, or "
            "measured loads"
        )


def _require_baselines(dataset: DataSet, diagnosis: bool | Path) -> None:
    """Raise an error unless regressions can read the held-out touches of a diagnosis that is made now."""
    from bayestouch.baselines import require_scikit_learn

    pad_of(dataset.sensor, "a report with baselines")
    if diagnosis is not True:
        got = "a saved one" if diagnosis else "none"
        raise InputError(f"baselines: expected a diagnosis that is made with the report (diagnosis=True), got {got}")
    require_scikit_learn()
