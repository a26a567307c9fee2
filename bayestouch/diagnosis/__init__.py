"""Diagnose: find what the model misses, trace it to an effect, add the effect, and report before and after."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bayestouch.errors import InputError
from bayestouch.progress import Progress

if TYPE_CHECKING:
    from bayestouch.dataset import DataSet
    from bayestouch.diagnosis.result import Diagnosis

__all__ = ["diagnose"]


def diagnose(
    dataset: DataSet,
    *,
    contact: str = "layer",
    draws: int = 1000,
    sample: bool = True,
    seed: int = 0,
    progress: Progress | None = None,
) -> Diagnosis:
    """Find what a calibrated sensor's model misses, trace it to an effect and add that.

    Parameters
    ----------
    dataset : DataSet
        Sensor and touches. Touches with known indenter and location are needed; half of those to be read are held out
        of every fit and every choice.
    contact : str
        Contact model of the base chain: ``"layer"``, ``"hertz"`` or ``"approximate frictionless"``.
    draws : int
        Draws kept of each calibration.
    sample : bool
        Read the held-out touches as unknown, before and after, for the errors of R, location and load and for
        coverage. Without, these are None; everything else is the same.
    seed : int
        Seed of every random number.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Diagnosis
        Verdict, effects with their parameters, errors before and after, calibrations before and after.

    Raises
    ------
    InputError
        The data cannot be diagnosed with: no touch has the references that a fit needs, or too few have.
    """
    from bayestouch.diagnosis.finger import trace_finger
    from bayestouch.diagnosis.result import Diagnosis
    from bayestouch.sensor import Finger

    if draws < 8:
        raise InputError(f"draws: expected at least 8, got {draws}")
    if not isinstance(dataset.sensor.body, Finger):
        raise InputError("diagnose reads fingers only as yet; this sensor is a pad")
    traced = trace_finger(dataset, contact=contact, draws=draws, sample=sample, seed=seed, progress=progress)
    return Diagnosis.of(traced, {"contact": contact, "draws": draws, "sample": sample, "seed": seed})
