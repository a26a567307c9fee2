"""Errors of posteriors of held-out touches on a pad, which are read as unknown touches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

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
    TouchErrors,
    TouchReading,
    rows_of_held_out,
    summarised,
)
from bayestouch.pad.corrected import PadEffects
from bayestouch.reading.options import Kept, Options
from bayestouch.results.objects import Calibration


@dataclass(frozen=True)
class PadTouchErrors(TouchErrors):
    """Posterior mean minus reference over held-out touches on a pad; NaN for a quantity that the data do not have.

    Attributes
    ----------
    location_rms_mm : float
        Rms distance between inferred and reference location, with the load of the force sensor given if there is one.
    P_rms_N : float
        Rms difference between the load inferred from the elements alone and the load of the force sensor, which is
        corrected for its effects.
    coverage_90 : float
        Share of the touches whose location is in the smallest region with 90 % of the posterior.
    P_coverage_90 : float
        Share of the touches whose load, inferred as for `P_rms_N`, is in the central 90 % of its posterior.
    """

    location_rms_mm: float
    P_rms_N: float
    P_coverage_90: float


def read_held_out(infer: Infer, calibration: Calibration, data: SplitData, held: HeldOut, *, seed: int) -> TouchReading:
    """Errors of the posteriors that `infer` gives for the held-out touches with a calibration.

    No effect of a pad changes a location. The reference of a load is the reading of the force sensor, corrected for the
    effects of the force sensor. If effects depend on earlier touches, the touches in between are read too.
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
    (load, low, high), effects = _loads(infer, table, plain, held, index, seed), PadEffects.of(calibration)
    stated = held.stated["P"]
    reference = stated if effects is None else effects.pressed(stated)
    by_touch = {
        "location_rms_mm": np.sqrt(squares),
        "P_rms_N": load - stated,
        "coverage_90": (level <= COVERAGE).astype(float),
        "P_coverage_90": _inside(stated, low, high),
    }
    corrected = {**by_touch, "P_rms_N": load - reference, "P_coverage_90": _inside(reference, low, high)}
    return TouchReading(_errors(corrected), _errors(by_touch), unknown, unknown, unknown, by_touch, corrected)


def _errors(by_touch: Mapping[str, FloatArray]) -> PadTouchErrors:
    of_a_finger = dict.fromkeys(("R_bias_mm", "R_rms_mm", "theta_rms_deg", "P_rms_N_per_m"), float("nan"))
    return PadTouchErrors(**of_a_finger, **{key: summarised(key, values) for key, values in by_touch.items()})


def _loads(
    infer: Infer, table: Touches, calibration: Calibration, held: HeldOut, index: IntArray, seed: int
) -> tuple[FloatArray, ...]:
    """Loads inferred without the force sensor, N: posterior means and ends of the central 90 %, three (t,) arrays.

    NaN for all touches if the force sensor measured none of them, or none of the calibration.
    """
    if not (np.isfinite(held.stated["P"]).any() and calibration.settings["load_measured"]):
        return (np.full(len(index), np.nan),) * 3
    read = infer(table, calibration, Options(use_load=False, kept=Kept(DRAWS, summarised=False), seed=seed))
    low, high = read.interval("P", COVERAGE)
    return tuple(np.asarray(each)[index] for each in (read.mean("P"), low, high))


def _inside(values: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """1 where a value is between the ends, 0 where it is not, NaN where the value or an end is not known."""
    known = np.isfinite(values) & np.isfinite(low)
    return np.where(known, (values >= low) & (values <= high), np.nan)


def _to_be_read(calibration: Calibration, data: SplitData) -> Touches:
    listed = EffectList.of(calibration)
    if listed is not None and any(effect.needs_samples for effect in listed.plain):
        return data.table
    return data.table.select(data.held_out)
