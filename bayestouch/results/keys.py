"""Keys of the settings and of the extra arrays of a calibration that a later step reads again.

One class or function writes and reads each of them; other code uses that class or function.
"""

from __future__ import annotations

import json
from collections.abc import Mapping

#: Setting, JSON: effects of the model, what they add to the noise, and the setting in which they were fitted.
#: Written and read by `bayestouch.model.effect_list.EffectList`; absent if there are no effects.
EFFECTS = "effects"
#: Arrays of a calibration with effects: the peaks (m,) that shares refer to; on a pad also the readings without a
#: signal (m,) and the values of the effects one after the other (`bayestouch.pad.corrected.PadEffects`).
EFFECT_PEAK, EFFECT_ZERO, EFFECT_VALUES = "effect_peak", "effect_zero", "effect_values"
#: Array (q, q) of a pad with effects: lower Cholesky factor of the covariance of the values of effects that readings
#: are corrected for, in the coordinates that fits move. Absent in files of version 0.1: there the values are exact.
EFFECT_ROOT = "effect_root"
#: Array (m,) of a pad with effects of the noise: noise of one reading. If it is there, the noise of the calibration is
#: that without these effects. Absent in files of version 0.1: there it is all noise.
EFFECT_NOISE_SD = "effect_noise_sd"
#: Array (m,): reading at rest that was subtracted from the calibration touches. Read by `CalibrationData.rest_reading`.
REST_READING = "rest_reading"
#: Array (m,) of a pad: number of raw reads behind the reading at rest that its calibration touches share; NaN where
#: they share none. Its error is in the offsets of the calibration. Read by `CalibrationData.rest_reads`.
REST_READS = "rest_reads"
#: Setting: `MODEL_MAP`, or `IDENTIFIED_MAP` for a finger whose E map was identified by regression; read by
#: `CalibrationData.has_identified_map`.
E_MAP, MODEL_MAP, IDENTIFIED_MAP = "e_map", "model", "empirical"
#: Array (m,): 1 for elements of a pad that responded in the calibration, otherwise 0.
USABLE = "usable"
#: Setting: names of the earlier calibrations from which priors were learned; absent if there were none. Written by
#: `bayestouch.calibration.like.Learned`.
LIKE = "like"
#: Settings of a pad: names of the parameters with stated priors, and the option `e_map` if it was given; each is absent
#: otherwise. Read by `bayestouch.pad.log_density.stated_pad`.
STATED_PRIORS, STATED_MAP = "stated_priors", "stated_e_map"
#: Setting of a pad that was calibrated with a correction, 1: touches are read with a finer map; absent otherwise.
#: Written and read by `bayestouch.pad.calibration_with_effects`.
FINER_MAP = "finer_map"


def effect_names(settings: Mapping[str, str | float]) -> list[str]:
    """Names of the effects in these settings of a calibration; empty if the text is damaged (refused in use)."""
    try:
        return list(json.loads(str(settings.get(EFFECTS, "{}")))["parameters"])
    except (KeyError, TypeError, ValueError):
        return []
