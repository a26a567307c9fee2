"""Errors of posteriors of held-out touches on a pad, which are read as unknown touches."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.pad import COORDINATES
from bayestouch.data.touches import Touches
from bayestouch.model.effect_list import EffectList
from bayestouch.model.held_out import HeldOut
from bayestouch.model.split_data import SplitData
from bayestouch.model.touch_errors import (
    COVERAGE,
    DRAWS,
    Infer,
    TouchReading,
    rows_of_held_out,
)
from bayestouch.pad.corrected import PadEffects
from bayestouch.reading.options import Kept, Options
from bayestouch.results.objects import Calibration


def read_held_out(infer: Infer, calibration: Calibration, data: SplitData, held: HeldOut, *, seed: int) -> TouchReading:
    """Errors of the posteriors that `infer` gives for the held-out touches with a calibration.

    No effect of a pad changes a location. The reference of a load is the reading of the force sensor, corrected for the
    effects of the force sensor. If effects depend on earlier touches, the touches in between are read too.

    Errors have the keys ``location_rms_mm``, the distance between inferred and reference location, with the load of the
    force sensor given if there is one; ``P_rms_N``, the difference between the load inferred from the elements alone
    and the reference; ``coverage_90``, whether the location is in the smallest region with 90 % of the posterior; and
    ``P_coverage_90``, whether the load of the force sensor is in the central 90 % of what the load inferred from the
    elements alone predicts for it: the posterior with the noise of the force sensor.
    """
    # The rest reading is already subtracted from the table.
    plain = calibration.with_rest_reading(None)
    table = _to_be_read(calibration, data)
    read = infer(table, plain, Options(kept=Kept(DRAWS, summarised=False), seed=seed))
    index = rows_of_held_out(read, held)
    axes = [name for name in COORDINATES if name in held.stated]
    squares = np.sum([(read.mean(name)[index] - held.stated[name]) ** 2 for name in axes], axis=0)
    level = np.asarray(read.sample_stats["reference_level"])[index]
    unknown = np.full(len(index), np.nan)
    draws, effects = _loads(infer, table, plain, held, index, seed), PadEffects.of(calibration)
    load, stated = draws.mean(axis=0), held.stated["P"]
    reference = stated if effects is None else effects.pressed(stated)
    noise = calibration.noise.mean_load_sd(held.observed.means.reads_of_load)
    # With effects it is that of an acting load; an offset, the one effect of the rig on all loads, does not change it.
    noise = noise if effects is None else noise / effects.load_slope
    by_touch = {
        "location_rms_mm": np.sqrt(squares),
        "P_rms_N": load - stated,
        "coverage_90": (level <= COVERAGE).astype(float),
        "P_coverage_90": inside(stated, draws, noise),
    }
    corrected = {**by_touch, "P_rms_N": load - reference, "P_coverage_90": inside(reference, draws, noise)}
    return TouchReading(unknown, unknown, unknown, by_touch, corrected)


def _loads(
    infer: Infer, table: Touches, calibration: Calibration, held: HeldOut, index: IntArray, seed: int
) -> FloatArray:
    """Draws of the loads inferred without the force sensor, N, (draws, t).

    NaN for all touches if the force sensor measured none of them, or none of the calibration.
    """
    if not (np.isfinite(held.stated["P"]).any() and calibration.settings["load_measured"]):
        return np.full((1, len(index)), np.nan)
    read = infer(table, calibration, Options(use_load=False, kept=Kept(DRAWS, summarised=False), seed=seed))
    draws = read.posterior["P"]
    return np.asarray(draws.reshape(-1, draws.shape[-1])[:, index])


def inside(measured: FloatArray, draws: FloatArray, noise: FloatArray) -> FloatArray:
    """1 where the central 90 % of what draws predict for a measured value contain it, else 0; NaN where not known.

    Parameters
    ----------
    measured : (t,) array
        Measured values.
    draws : (draws, t) array
        Draws of the true values.
    noise : (t,) array
        Standard deviation of the noise of the measured values.
    """
    # Without noise each draw is below or above.
    with np.errstate(divide="ignore"):
        below = ndtr((measured - draws) / noise).mean(axis=0)
    return np.where(np.isfinite(below), np.abs(below - 0.5) <= COVERAGE / 2, np.nan)


def _to_be_read(calibration: Calibration, data: SplitData) -> Touches:
    listed = EffectList.of(calibration)
    if listed is not None and any(effect.needs_samples for effect in listed.plain):
        return data.table
    return data.table.select(data.held_out)
