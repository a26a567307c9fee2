"""Errors of touches on a pad that are read as unknown, on touches that no fit and no choice has seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.touches import Touches
from bayestouch.model.effect_list import KEY, EffectList
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
    without_rest,
)
from bayestouch.results.objects import Calibration


@dataclass(frozen=True)
class PadTouchErrors(TouchErrors):
    """Posterior mean minus reference over held-out touches on a pad; NaN what the data cannot give.

    Attributes
    ----------
    location_rms_mm : float
        Of the location, all coordinates together. Touches are read with the force sensor's load where there is one.
    P_rms_N : float
        Of the load that is inferred from the elements alone, against the force sensor.
    coverage_90 : float
        Share of the touches whose location is in the smallest region that holds 90 % of its posterior.
    """

    location_rms_mm: float
    P_rms_N: float


def read_held_out(infer: Infer, calibration: Calibration, data: SplitData, held: HeldOut, *, seed: int) -> TouchReading:
    """Read the held-out touches with a calibration, by `infer`, and compare with their references.

    No effect on a pad moves a location, and a load is what the force sensor reads: references are those stated. Where
    effects depend on what came before, the touches in between are read too.
    """
    plain = without_rest(calibration)
    table = _to_be_read(calibration, data)
    read = infer(table, plain, draws=DRAWS, seed=seed)
    index = rows_of_held_out(read, held)
    axes = [name for name in ("x", "y") if name in held.stated]
    squares = np.sum([(read.mean(name)[index] - held.stated[name]) ** 2 for name in axes], axis=0)
    level = np.asarray(read.sample_stats["reference_level"])[index]
    unknown = np.full(len(index), np.nan)
    by_touch = {
        "location_rms_mm": np.sqrt(squares),
        "P_rms_N": _load_error(infer, table, plain, held, index, seed),
        "coverage_90": (level <= COVERAGE).astype(float),
    }
    of_a_finger = dict.fromkeys(("R_bias_mm", "R_rms_mm", "theta_rms_deg", "P_rms_N_per_m"), float("nan"))
    errors = PadTouchErrors(**of_a_finger, **{key: summarised(key, values) for key, values in by_touch.items()})
    return TouchReading(errors, errors, unknown, unknown, unknown, by_touch)


def _load_error(
    infer: Infer, table: Touches, calibration: Calibration, held: HeldOut, index: IntArray, seed: int
) -> FloatArray:
    """Load read without the force sensor less its reading, (t,); NaN where it was not read."""
    if not (np.isfinite(held.stated["P"]).all() and calibration.settings["load_measured"]):
        return np.full(len(index), np.nan)
    read = infer(table, calibration, draws=DRAWS, seed=seed, use_load=False)
    return np.asarray(read.mean("P")[index] - held.stated["P"])


def _to_be_read(calibration: Calibration, data: SplitData) -> Touches:
    if KEY in calibration.settings:
        listed = EffectList.from_text(str(calibration.settings[KEY]))
        if any(effect.needs_samples for effect in listed.plain):
            return data.table
    return data.table.select(data.held_out)
