"""Model and options of a calibration of a finger, with which its fit can be repeated."""

from __future__ import annotations

from typing import Any

from bayestouch.effects.stated import StatedModel
from bayestouch.errors import InputError
from bayestouch.finger.correction_table import CorrectionTable
from bayestouch.finger.place.fit import DISCREPANCY_SETTING, NO_DISCREPANCY
from bayestouch.finger.place.posterior import PlacePosterior
from bayestouch.finger.priors import DISCREPANCY, FIELDS, IN_UNITS
from bayestouch.model.effect_list import stated_effects
from bayestouch.priors.parameters import Parameter
from bayestouch.results.objects import Calibration


def stated_of(calibration: Calibration) -> tuple[StatedModel, dict[str, Any]]:
    """Effects of a calibration with their values, and the options of its fit.

    Raises
    ------
    InputError
        If the calibration has an identified E map, or was made with ``discrepancy="none"``.
    """
    if calibration.has_identified_map:
        raise InputError("this calibration has an identified E map; its parameters have no density of their own")
    if calibration.settings.get(DISCREPANCY_SETTING) == NO_DISCREPANCY:
        raise InputError('this calibration was made with discrepancy="none"; its density is not offered as a function')
    contact = str(calibration.settings["contact"])
    corrected = CorrectionTable.from_arrays(calibration.extra) is not None
    priors = {p.name: p.prior for p in calibration.parameters if p.name in FIELDS and not _default(p)}
    places = PlacePosterior.from_arrays(calibration.extra)
    options: dict[str, Any] = {"contact": contact, "priors": priors}
    if places is not None:
        options["functions"] = places.functions
    return StatedModel("finger", contact, stated_effects(calibration), corrected), options


def _default(parameter: Parameter) -> bool:
    """Whether a prior is the default discrepancy, or a default in units that depend on the readings."""
    # The prior of the discrepancy always has such units.
    if parameter.name == "discrepancy_sd":
        return parameter.prior == DISCREPANCY
    return IN_UNITS in parameter.description
