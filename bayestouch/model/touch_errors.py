"""Errors of posteriors of held-out touches, which are read as unknown touches."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.model.held_out import HeldOut
from bayestouch.results.objects import TouchPosteriors

COVERAGE = 0.9
# Draws per touch. Ends of central intervals then have an error of a few per cent of their width, which is negligible in
# means over hundreds of touches.
DRAWS = 512


#: Errors (posterior mean minus reference over touches) that every ``diagnosis.json`` has, in this order. Further ones
#: of a pad follow, see `bayestouch.pad.touch_errors.read_held_out`.
KEYS = (
    # Mean and rms error of the composite radius, with the load of the force sensor given.
    "R_bias_mm",
    "R_rms_mm",
    # Rms error of the location, with the load given.
    "theta_rms_deg",
    # Rms difference between the load inferred from the elements alone and the load of the force sensor. (A load that is
    # inferred with the reading of the force sensor only repeats this reading.)
    "P_rms_N_per_m",
    # Share of the touches whose R is in the central 90 % of its posterior. Edges and flats are not counted: their R is
    # at an end of the prior, and a central interval never contains an end. On a pad it is that of locations.
    "coverage_90",
)


@dataclass(frozen=True, eq=False)
class TouchReading:
    """Errors of the posteriors of held-out touches, and R of each touch with its central 90 % interval.

    Attributes
    ----------
    R_mm, low_mm, high_mm : (t,) arrays
        Posterior mean of R and ends of its interval, mm.
    by_touch, by_touch_corrected : mappings of (t,) arrays
        Error of each touch relative to the references as stated in the data set, and as corrected by the model, by key
        of ``diagnosis.json``; NaN unknown. For coverage: 1 if the interval contains the reference, else 0.
    with_edge : (t,) bool array or None
        Touches with a knife edge, by the data set; None on a pad.
    """

    R_mm: FloatArray
    low_mm: FloatArray
    high_mm: FloatArray
    by_touch: Mapping[str, FloatArray]
    by_touch_corrected: Mapping[str, FloatArray]
    with_edge: BoolArray | None = None

    @property
    def errors(self) -> dict[str, float]:
        """Errors over the touches relative to the references as corrected by the model; NaN where not known."""
        return _over_touches(self.by_touch_corrected)

    @property
    def against_stated(self) -> dict[str, float]:
        """Errors over the touches relative to the references as stated in the data set; NaN where not known."""
        return _over_touches(self.by_touch)


#: Type of `bayestouch.inference.infer_with`, which is in a higher layer.
Infer = Callable[..., TouchPosteriors]


def rows_of_held_out(read: TouchPosteriors, held: HeldOut) -> IntArray:
    """Indices of the held-out touches in the posteriors `read`, (t,)."""
    place = {int(touch): i for i, touch in enumerate(read.rows.touch)}
    return np.array([place[int(touch)] for touch in held.observed.means.touch])


def summarised(key: str, values: FloatArray) -> float:
    """Summary of errors by touch: root mean square if ``rms`` is in the key, else the mean; NaN if all are NaN."""
    values = values[np.isfinite(values)]
    if not len(values):
        return float("nan")
    return float(np.sqrt((values**2).mean())) if "rms" in key else float(values.mean())


def _over_touches(by_touch: Mapping[str, FloatArray]) -> dict[str, float]:
    return dict.fromkeys(KEYS, float("nan")) | {key: summarised(key, values) for key, values in by_touch.items()}
