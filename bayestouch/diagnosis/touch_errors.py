"""Errors of touches that are read as unknown, on touches that no fit and no choice has seen."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.affected.effect_list import KEY, EffectList
from bayestouch.diagnosis.data import DiagnosisData
from bayestouch.diagnosis.held_out import HeldOut
from bayestouch.inference import infer
from bayestouch.progress import Progress
from bayestouch.results import Calibration, TouchPosteriors
from bayestouch.touches import Touches

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

COVERAGE = 0.9
# Of central intervals to a few parts in a hundred of their width, which is far below what hundreds of touches tell.
DRAWS = 512


@dataclass(frozen=True)
class TouchErrors:
    """Posterior mean minus reference over held-out touches; NaN what the data cannot give.

    Attributes
    ----------
    R_bias_mm, R_rms_mm : float
        Of the composite radius.
    theta_rms_deg, P_rms_N_per_m : float
        Of location and load, the latter against the force sensor.
    coverage_90 : float
        Share of the touches whose R lies in the central 90 % of its posterior. Edges and flats are not counted: they
        are at the ends of the prior, where no central interval reaches.
    """

    R_bias_mm: float
    R_rms_mm: float
    theta_rms_deg: float
    P_rms_N_per_m: float
    coverage_90: float

    @classmethod
    def of(cls, read: TouchPosteriors, held: HeldOut) -> TouchErrors:
        """Errors of the posteriors of the held-out touches among those that were read."""
        index = _index(read, held)
        reference = held.reference
        error = {name: read.mean(name)[index] - reference[name] for name in reference}
        low, high = (end[index] for end in read.interval("R", COVERAGE))
        tip = held.observed.means.indenter_radius_mm
        round_tip = (tip > 0) & np.isfinite(tip)
        inside = ((low <= reference["R"]) & (reference["R"] <= high))[round_tip]
        return cls(
            R_bias_mm=float(error["R"].mean()),
            R_rms_mm=_rms(error["R"]),
            theta_rms_deg=_rms(error["theta_c"]),
            P_rms_N_per_m=_rms(error["P"]),
            coverage_90=float(inside.mean()) if inside.size else float("nan"),
        )


@dataclass(frozen=True, eq=False)
class TouchReading:
    """Held-out touches as read: their errors, and R of each with its central 90 %.

    Attributes
    ----------
    errors : TouchErrors
        Summary.
    R_mm, low_mm, high_mm : (t,) arrays
        Posterior mean, and ends of the interval.
    """

    errors: TouchErrors
    R_mm: FloatArray
    low_mm: FloatArray
    high_mm: FloatArray


def read_held_out(
    calibration: Calibration, data: DiagnosisData, held: HeldOut, *, seed: int, progress: Progress | None = None
) -> TouchReading:
    """Read the held-out touches with a calibration and compare with their references.

    Where effects depend on what came before, the touches in between are read too: they are in the same file, and
    reading one as unknown uses none of its references.
    """
    # The table has had its rest reading subtracted.
    plain = replace(calibration, extra={k: v for k, v in calibration.extra.items() if k != "rest_reading"})
    read = infer(_to_be_read(calibration, data), plain, method="importance", draws=DRAWS, seed=seed, progress=progress)
    index = _index(read, held)
    low, high = (end[index] for end in read.interval("R", COVERAGE))
    return TouchReading(TouchErrors.of(read, held), read.mean("R")[index], low, high)


def _index(read: TouchPosteriors, held: HeldOut) -> IntArray:
    """Where the held-out touches are among those that were read."""
    place = {int(touch): i for i, touch in enumerate(read.rows.touch)}
    return np.array([place[int(touch)] for touch in held.observed.means.touch])


def _to_be_read(calibration: Calibration, data: DiagnosisData) -> Touches:
    listed = EffectList.from_text(str(calibration.settings[KEY]))
    if not listed.drifts and not any(effect.needs_samples for effect in listed.plain):
        return data.table.select(data.held_out)
    return data.table.select(np.isin(data.session, data.session[data.held_out]))


def _rms(values: FloatArray) -> float:
    values = values[np.isfinite(values)]
    return float(np.sqrt((values**2).mean())) if len(values) else float("nan")
