"""The posterior density of the calibration of a pad as a `LogDensity`, and the model to which it belongs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.effects.stated import StatedModel
from bayestouch.model.effect_list import stated_effects
from bayestouch.model.log_density import LogDensity
from bayestouch.pad.density import PadDensity
from bayestouch.pad.priors import stated_priors
from bayestouch.pad.requested import by_name
from bayestouch.results.keys import STATED_MAP
from bayestouch.results.objects import Calibration


def stated_pad(calibration: Calibration) -> tuple[StatedModel, dict[str, Any]]:
    """Effects of a calibration with their values, and the options of its fit."""
    settings = calibration.settings
    priors = stated_priors(calibration)
    options = {"kernel": str(settings["kernel"]), "e_map": str(settings.get(STATED_MAP, "auto")), "priors": priors}
    return StatedModel("pad", "", stated_effects(calibration), False), options


def public_density(density: PadDensity, reading_unit: str, load_unit: str) -> LogDensity:
    """Density of a pad, with or without effects, for any sampler."""
    m, dimensions = density.model.pad.position.shape
    per_load = f"{reading_unit}/{load_unit}" if load_unit else reading_unit
    own = [per_load] * m + [reading_unit] * m + ["mm"] * (m * dimensions)
    effects = [each.unit for effect in density.model.effects for each in effect.parameters]
    drifts = [each.unit for each in density.drifts.parameters]

    def coordinates(values: Mapping[str, FloatArray]) -> FloatArray:
        names = by_name(density, density.mode[None])
        columns = [values[name].reshape(len(values[name]), -1) for name in names]
        flat = np.concatenate(columns, axis=1)
        return np.where(density.logarithmic, np.log(np.where(density.logarithmic, flat, 1.0)), flat)

    logarithmic = zip(density.names, density.logarithmic, strict=True)
    return LogDensity(
        names=tuple(f"log {name}" if log else name for name, log in logarithmic),
        units=(*own, *(each.unit for each in density.model.pad.kernel.parameters), *effects, *drifts),
        start=density.mode,
        covariance=density.covariance,
        bounds=density.bounds,
        posterior=density.__call__,
        prior=density.log_prior,
        touches=None if density.tied else density.touch_log_likelihood,
        values=lambda points: by_name(density, density.values(points)),
        coordinates=coordinates,
    )
