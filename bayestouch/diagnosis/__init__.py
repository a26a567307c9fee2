"""Diagnose: find what the model misses, trace it to an effect, add the effect, and report before and after."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bayestouch.errors import InputError, about
from bayestouch.progress import Progress

if TYPE_CHECKING:
    from bayestouch.data.dataset import DataSet
    from bayestouch.diagnosis.result import Diagnosis

__all__ = ["diagnose"]


def diagnose(
    dataset: DataSet,
    *,
    contact: str | None = None,
    kernel: str | None = None,
    draws: int = 1000,
    sample: bool = True,
    seed: int = 0,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Find what a calibrated sensor's model misses, trace it to an effect and add that.

    Parameters
    ----------
    dataset : DataSet
        Sensor and touches. Touches with known indenter (on a finger) and location are needed; half of those to be read
        are held out of every fit and every choice, or on a pad without calibration table every fourth block of touches.
    contact : {"layer", "hertz", "approximate frictionless"}, optional
        Contact model of a finger's base chain; the exact contact on the bonded layer by default.
    kernel : str, optional
        Kernel of a pad's base chain, as of `bayestouch.calibrate`; chosen by cross-validation by default.
    draws : int
        Draws kept of each calibration.
    sample : bool
        Read the held-out touches as unknown, before and after, for the errors of R, location and load and for
        coverage. Without, these are None; everything else is the same.
    seed : int
        Seed of every random number.
    scheduler : str, optional
        Address of the scheduler of a Dask cluster that refits the leading candidates of each round instead of this
        process, such as ``tcp://10.0.0.5:8786``. The result is the same.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Diagnosis
        Verdict, effects with their parameters, errors before and after, calibrations before and after.

    Raises
    ------
    InputError
        The data cannot be diagnosed with: no touch has the references that a fit needs, or too few have; or an option
        does not fit the body, or the cluster cannot be reached.
    """
    from bayestouch.diagnosis.follow import trace
    from bayestouch.diagnosis.result import Diagnosis
    from bayestouch.model.body import body_of

    if draws < 8:
        raise InputError(f"draws: expected at least 8, got {draws}")
    body = body_of(dataset.sensor)
    options = {**body.own({"contact": contact, "kernel": kernel}), "draws": draws, "sample": sample, "seed": seed}
    with about(dataset.path):
        traced = trace(dataset, body, **options, scheduler=scheduler, progress=progress)
    return Diagnosis.of(traced, options)
