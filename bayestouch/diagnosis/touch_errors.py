"""Errors of touches that are read as unknown, on touches that no fit and no choice has seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.touches import Touches
from bayestouch.diagnosis.data import DiagnosisData
from bayestouch.diagnosis.held_out import HeldOut
from bayestouch.inference import infer
from bayestouch.model.effect_list import EffectList
from bayestouch.progress import Progress
from bayestouch.results.objects import Calibration, TouchPosteriors

COVERAGE = 0.9
# Of central intervals to a few parts in a hundred of their width, which is far below what hundreds of touches tell.
DRAWS = 512


@dataclass(frozen=True)
class TouchErrors:
    """Posterior mean minus reference over held-out touches; NaN what the data cannot give.

    Attributes
    ----------
    R_bias_mm, R_rms_mm : float
        Of the composite radius. Touches are read with the force sensor's load, as a user reads them.
    theta_rms_deg : float
        Of the location, from the same reading.
    P_rms_N_per_m : float
        Of the load that is inferred from the elements alone, against the force sensor: a load that was inferred with
        the force sensor's reading repeats that reading, and its distance from it says nothing.
    coverage_90 : float
        Share of the touches whose R lies in the central 90 % of its posterior. Edges and flats are not counted: they
        are at the ends of the prior, where no central interval reaches.
    """

    R_bias_mm: float
    R_rms_mm: float
    theta_rms_deg: float
    P_rms_N_per_m: float
    coverage_90: float


@dataclass(frozen=True, eq=False)
class TouchReading:
    """Held-out touches as read: their errors, and R of each with its central 90 %.

    Attributes
    ----------
    errors, against_stated : TouchErrors
        Summary, against references as the model corrects them and as the data set states them.
    R_mm, low_mm, high_mm : (t,) arrays
        Posterior mean, and ends of the interval.
    by_touch : mapping of (t,) arrays
        Error of each touch against the stated reference, by the key of its summary; NaN unknown. For coverage 1 where
        the interval holds the reference, 0 where it does not.
    """

    errors: TouchErrors
    against_stated: TouchErrors
    R_mm: FloatArray
    low_mm: FloatArray
    high_mm: FloatArray
    by_touch: Mapping[str, FloatArray] = field(default_factory=dict)


def read_held_out(
    calibration: Calibration, data: DiagnosisData, held: HeldOut, *, seed: int, progress: Progress | None = None
) -> TouchReading:
    """Read the held-out touches with a calibration and compare with their references.

    They are read twice: with the load of the force sensor for R and location, without it for the load. Where effects
    depend on what came before, the touches in between are read too: they are in the same file, and reading one as
    unknown uses none of its references.
    """
    # The table has had its rest reading subtracted.
    plain = calibration.with_rest_reading(None)
    table = _to_be_read(calibration, data)

    def read(use_load: bool) -> TouchPosteriors:
        return infer(table, plain, method="importance", draws=DRAWS, seed=seed, use_load=use_load, progress=progress)

    with_load = read(True)
    measured = np.isfinite(held.stated["P"]).any()
    index = _index(with_load, held)
    estimate = {name: with_load.mean(name)[index] for name in ("R", "theta_c")}
    estimate["P"] = read(False).mean("P")[index] if measured else np.full(len(index), np.nan)
    low, high = (end[index] for end in with_load.interval("R", COVERAGE))
    tip = held.observed.means.indenter_radius_mm
    return TouchReading(
        errors=_summary(errors_by_touch(estimate, low, high, held.reference, tip)),
        against_stated=_summary(errors_by_touch(estimate, low, high, held.stated, tip)),
        R_mm=estimate["R"],
        low_mm=low,
        high_mm=high,
        by_touch=errors_by_touch(estimate, low, high, held.stated, tip),
    )


def errors_by_touch(
    estimate: Mapping[str, FloatArray],
    low: FloatArray,
    high: FloatArray,
    reference: Mapping[str, FloatArray],
    tip_mm: FloatArray,
) -> dict[str, FloatArray]:
    """Error of each touch by the key of its summary, see `TouchReading.by_touch`.

    Parameters
    ----------
    estimate, reference : mappings of (t,) arrays
        Posterior means and references of R (mm), theta_c (degree) and P (N/m).
    low, high : (t,) arrays
        Ends of the interval of R, mm.
    tip_mm : (t,) array
        Radius of the tip as stated, mm: intervals of round tips alone count.
    """
    error = {name: estimate[name] - reference[name] for name in ("R", "theta_c", "P")}
    inside = ((low <= reference["R"]) & (reference["R"] <= high)).astype(float)
    return {
        "R_bias_mm": error["R"],
        "R_rms_mm": error["R"],
        "theta_rms_deg": error["theta_c"],
        "P_rms_N_per_m": error["P"],
        "coverage_90": np.where((tip_mm > 0) & np.isfinite(tip_mm), inside, np.nan),
    }


def _summary(by_touch: Mapping[str, FloatArray]) -> TouchErrors:
    return TouchErrors(**{key: summarised(key, values) for key, values in by_touch.items()})


def summarised(key: str, values: FloatArray) -> float:
    """Root mean square of errors by touch where the key says rms, else their mean; NaN where none is known."""
    values = values[np.isfinite(values)]
    if not len(values):
        return float("nan")
    return float(np.sqrt((values**2).mean())) if "rms" in key else float(values.mean())


def _index(read: TouchPosteriors, held: HeldOut) -> IntArray:
    """Where the held-out touches are among those that were read."""
    place = {int(touch): i for i, touch in enumerate(read.rows.touch)}
    return np.array([place[int(touch)] for touch in held.observed.means.touch])


def _to_be_read(calibration: Calibration, data: DiagnosisData) -> Touches:
    listed = EffectList.of(calibration)
    if listed is None or not (listed.drifts or any(effect.needs_samples for effect in listed.plain)):
        return data.table.select(data.held_out)
    return data.table.select(np.isin(data.session, data.session[data.held_out]))
