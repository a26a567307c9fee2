"""Names under which a calibration holds what a later step reads again: keys of its settings and of its extra arrays.

Each has one owner, which writes it and reads it; others ask the owner.
"""

from __future__ import annotations

import json
from collections.abc import Mapping

#: Setting, JSON: the effects of the chain, what they add to the noise, and the setting that they were fitted in.
#: Written and read by `bayestouch.model.effect_list.EffectList`; absent where there are no effects.
EFFECTS = "effects"
#: Arrays of a calibration with effects: the peaks (m,) that shares refer to; on a pad also readings without a signal
#: (m,) and the values of the effects one after the other (`bayestouch.pad.corrected.PadEffects`).
EFFECT_PEAK, EFFECT_ZERO, EFFECT_VALUES = "effect_peak", "effect_zero", "effect_values"
#: Array (m,): reading at rest that was subtracted from the calibration touches. Read by `CalibrationData.rest_reading`.
REST_READING = "rest_reading"
#: Setting: `MODEL_MAP`, or `IDENTIFIED_MAP` for a finger whose E map was found by regression; read by
#: `CalibrationData.has_identified_map`.
E_MAP, MODEL_MAP, IDENTIFIED_MAP = "e_map", "model", "empirical"
#: Array (m,): 1 for elements of a pad that responded in the calibration, else 0.
USABLE = "usable"


def effect_names(settings: Mapping[str, str | float]) -> list[str]:
    """Names of the effects of a calibration with these settings; none of a damaged text, which is refused in use."""
    try:
        return list(json.loads(str(settings.get(EFFECTS, "{}")))["parameters"])
    except (KeyError, TypeError, ValueError):
        return []
