"""Errors of posteriors of held-out touches on a finger, which are read as unknown touches."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.data.arrays import nearest_turn
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.reading.true_load import changing_in_time
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
from bayestouch.reading.fault_notes import is_sound
from bayestouch.reading.options import Kept, Options
from bayestouch.results.objects import Calibration, TouchPosteriors


def read_held_out(infer: Infer, calibration: Calibration, data: SplitData, held: HeldOut, *, seed: int) -> TouchReading:
    """Errors of the posteriors that `infer` gives for the held-out touches with a calibration.

    Touches are read twice: with the load of the force sensor for R and location, and without it for the load. With
    drifts, or effects that differ between samples, all touches of the same sessions are read too, without references.
    Effects that change with time act as at the times of the touches, which belong to the recording of the calibration.
    """
    # The rest reading is already subtracted from the table.
    plain = calibration.with_rest_reading(None)
    rows = _to_be_read(calibration, data)
    table = data.table.select(rows)

    def read(use_load: bool, check: bool) -> TouchPosteriors:
        options = Options(
            use_load=use_load,
            check_sensor=check,
            method="importance",
            kept=Kept(DRAWS, summarised=False),
            seed=seed,
            recorded_s=data.time_s[rows] if _change_in_time(calibration) else None,
        )
        return infer(table, plain, options)

    with_load = read(True, check=True)
    # Without faults the second reading does not need the check, which takes as long as the reading.
    sound = is_sound(with_load.settings)
    measured = np.isfinite(held.stated["P"]).any()
    index = rows_of_held_out(with_load, held)
    estimate = {name: with_load.mean(name)[index] for name in ("R", "theta_c")}
    estimate["P"] = read(False, check=not sound).mean("P")[index] if measured else np.full(len(index), np.nan)
    low, high = (end[index] for end in with_load.interval("R", COVERAGE))
    tip = held.observed.means.indenter_radius_mm
    corrected, stated = (errors_by_touch(estimate, low, high, each, tip) for each in (held.reference, held.stated))
    return TouchReading(
        R_mm=estimate["R"],
        low_mm=low,
        high_mm=high,
        by_touch=stated,
        by_touch_corrected=corrected,
        with_edge=tip == 0,
    )


def errors_by_touch(
    estimate: Mapping[str, FloatArray],
    low: FloatArray,
    high: FloatArray,
    reference: Mapping[str, FloatArray],
    tip_mm: FloatArray,
) -> dict[str, FloatArray]:
    """Error of each touch by the `KEYS` of `bayestouch.model.touch_errors`, see `TouchReading.by_touch`.

    Parameters
    ----------
    estimate, reference : mappings of (t,) arrays
        Posterior means and references of R (mm), theta_c (degree) and P (N/m). An error of theta_c is the way around
        the finger that is shorter.
    low, high : (t,) arrays
        Ends of the interval of R, mm.
    tip_mm : (t,) array
        Stated radius of the tip, mm: only intervals of round tips count.
    """
    error = {name: estimate[name] - reference[name] for name in ("R", "theta_c", "P")}
    error["theta_c"] = nearest_turn(error["theta_c"], 0.0)
    inside = ((low <= reference["R"]) & (reference["R"] <= high)).astype(float)
    return {
        "R_bias_mm": error["R"],
        "R_rms_mm": error["R"],
        "theta_rms_deg": error["theta_c"],
        "P_rms_N_per_m": error["P"],
        "coverage_90": np.where((tip_mm > 0) & np.isfinite(tip_mm), inside, np.nan),
    }


def _to_be_read(calibration: Calibration, data: SplitData) -> BoolArray:
    listed = EffectList.of(calibration)
    if listed is None or not (listed.drifts or any(effect.needs_samples for effect in listed.plain)):
        return data.held_out
    return np.isin(data.session, data.session[data.held_out])


def _change_in_time(calibration: Calibration) -> bool:
    return calibration.has_effects and bool(changing_in_time(ChainWithEffects.of(calibration)))
