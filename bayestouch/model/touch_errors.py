"""Errors of touches that are read as unknown, on touches that no fit and no choice has seen."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.model.held_out import HeldOut
from bayestouch.results.objects import TouchPosteriors

COVERAGE = 0.9
# Of central intervals to a few parts in a hundred of their width, which is far below what hundreds of touches tell.
DRAWS = 512


@dataclass(frozen=True)
class TouchErrors:
    """Posterior mean minus reference over held-out touches; NaN what the data, or the body, cannot give.

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


#: `bayestouch.infer`, which stands above the bodies.
Infer = Callable[..., TouchPosteriors]


def rows_of_held_out(read: TouchPosteriors, held: HeldOut) -> IntArray:
    """Where the held-out touches are among those that were read."""
    place = {int(touch): i for i, touch in enumerate(read.rows.touch)}
    return np.array([place[int(touch)] for touch in held.observed.means.touch])


def summarised(key: str, values: FloatArray) -> float:
    """Root mean square of errors by touch where the key says rms, else their mean; NaN where none is known."""
    values = values[np.isfinite(values)]
    if not len(values):
        return float("nan")
    return float(np.sqrt((values**2).mean())) if "rms" in key else float(values.mean())
