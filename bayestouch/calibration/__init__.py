"""Calibrate: the sensor is unknown, the touches are known."""

from __future__ import annotations

from bayestouch.dataset import DataSet
from bayestouch.errors import InputError
from bayestouch.progress import Progress
from bayestouch.results import Calibration
from bayestouch.sensor import Finger, Pad
from bayestouch.splits import with_calibration

__all__ = ["calibrate"]


def calibrate(
    dataset: DataSet,
    *,
    contact: str | None = None,
    e_map: str | None = None,
    kernel: str | None = None,
    draws: int = 1000,
    seed: int = 0,
    progress: Progress | None = None,
) -> Calibration:
    """Calibrate a sensor from touches with known indenter, location and load.

    Parameters
    ----------
    dataset : DataSet
        Sensor and touches. Without calibration touches the touches are split, and the notes say how.
    contact : {"layer", "hertz", "approximate frictionless"}, optional
        Contact model of a finger; the exact contact on the bonded layer by default.
    e_map : {"model", "empirical"}, optional
        E map of a finger: that of the elastic model (default), or identified directly about it.
    kernel : {"auto", "layer", "layer-line", "half-space", "half-space-line", "gaussian"}, optional
        Kernel of a pad; chosen by cross-validation on the calibration touches by default.
    draws : int
        Posterior draws to keep.
    seed : int
        Seed of every random number.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If an option does not fit the body, or the touches cannot identify the parameters.
    """
    if draws < 8:
        raise InputError(f"draws: expected at least 8, got {draws}")
    dataset = with_calibration(dataset)
    if isinstance(dataset.sensor.body, Finger):
        if kernel is not None:
            raise InputError("kernel is an option of pads; this sensor is a finger (its option is the contact model)")
        from bayestouch.calibration.finger_posterior import calibrate_finger

        if e_map not in (None, "model", "empirical"):
            raise InputError(f"e_map: expected model or empirical, got {e_map!r}")
        return calibrate_finger(
            dataset, contact=contact or "layer", e_map=e_map or "model", draws=draws, seed=seed, progress=progress
        )
    assert isinstance(dataset.sensor.body, Pad)
    if contact is not None or e_map is not None:
        raise InputError("contact and e_map are options of fingers; this sensor is a pad (its option is the kernel)")
    from bayestouch.calibration.pad import calibrate_pad

    return calibrate_pad(dataset, kernel=kernel or "auto", draws=draws, seed=seed, progress=progress)
