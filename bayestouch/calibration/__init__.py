"""Calibrate: the sensor is unknown, the touches are known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Finger, Pad
from bayestouch.data.splits import with_calibration
from bayestouch.errors import InputError, about
from bayestouch.priors.parameters import Prior
from bayestouch.progress import Progress
from bayestouch.results.objects import Calibration

if TYPE_CHECKING:
    from bayestouch.effects.stated import StatedModel

__all__ = ["calibrate"]


def calibrate(
    dataset: DataSet,
    *,
    contact: str | None = None,
    e_map: str | None = None,
    kernel: str | None = None,
    priors: Mapping[str, Prior] | None = None,
    model: StatedModel | None = None,
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
    priors : mapping of str to Prior, optional
        Priors of a finger's parameters in place of the default ones, by name: ``sigma``, ``mu`` (MPa), ``r_s`` (mm),
        ``theta_s`` (departure from the angle as built, degree), ``response`` (its size, reading per N/m),
        ``noise_sd`` (of one raw reading), ``discrepancy_sd`` (multiple of the noise of a touch's mean) and
        ``force_noise_sd`` (N/m). See `bayestouch.priors.parameters` for the kinds.
    model : StatedModel, optional
        Effects that a finger's chain has (`bayestouch.effects.read_model` reads the ``model.toml`` of a diagnosis); the
        posterior is then the normal approximation about the mode.
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
        If an option does not fit the body, a prior contradicts what is possible or how the finger was built, or the
        touches cannot identify the parameters.
    """
    if draws < 8:
        raise InputError(f"draws: expected at least 8, got {draws}")
    if model is not None:
        if contact or e_map or kernel or priors:
            raise InputError("contact, e_map, kernel and priors cannot be given beside a model")
        if model.body != dataset.sensor.body.kind:
            raise InputError(f"the model is that of a {model.body}, this sensor is a {dataset.sensor.body.kind}")
        if not isinstance(dataset.sensor.body, Finger):
            raise InputError("a model with effects is an option of fingers; this sensor is a pad")
        from bayestouch.diagnosis.stated_fit import calibrate_with_effects

        with about(dataset.path):
            return calibrate_with_effects(dataset, model, draws=draws, seed=seed, progress=progress)
    with about(dataset.path):
        dataset = with_calibration(dataset)
    if isinstance(dataset.sensor.body, Finger):
        if kernel is not None:
            raise InputError("kernel is an option of pads; this sensor is a finger (its option is the contact model)")
        from bayestouch.finger.calibration import calibrate_finger

        if e_map not in (None, "model", "empirical"):
            raise InputError(f"e_map: expected model or empirical, got {e_map!r}")
        with about(dataset.path):
            return calibrate_finger(
                dataset,
                contact=contact or "layer",
                e_map=e_map or "model",
                stated=priors,
                draws=draws,
                seed=seed,
                progress=progress,
            )
    assert isinstance(dataset.sensor.body, Pad)
    if contact is not None or e_map is not None or priors:
        raise InputError(
            "contact, e_map and priors are options of fingers; this sensor is a pad (its option is the kernel)"
        )
    from bayestouch.pad.calibration import calibrate_pad

    with about(dataset.path):
        return calibrate_pad(dataset, kernel=kernel or "auto", draws=draws, seed=seed, progress=progress)
