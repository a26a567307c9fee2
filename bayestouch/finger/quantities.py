"""Quantities on which the residuals of touches on a finger may depend."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.model.observations import Observations
from bayestouch.model.quantities import Quantity, previous_readings


def quantities(
    observed: Observations,
    element_deg: FloatArray,
    angle_deg: FloatArray,
    radius_mm: FloatArray,
    load: FloatArray,
    share: FloatArray,
    peak: FloatArray,
) -> tuple[Quantity, ...]:
    """Quantities of touches on a finger on which residuals may depend; those equal in all touches are left out.

    Parameters
    ----------
    observed : Observations
        The touches.
    element_deg : (m,) array
        Angles of the elements, degree.
    angle_deg, radius_mm, load : (t,) arrays
        Location (degree), composite radius (mm) and load (N/m).
    share : (t, m) array
        Predicted reading over the peak.
    peak : (m,) array
        Peak reading of each element.
    """
    shape = share.shape

    def wide(values: FloatArray) -> FloatArray:
        return np.broadcast_to(values[:, None], shape)

    all_of_them = (
        Quantity("angle from element to touch", "degree", angle_deg[:, None] - element_deg),
        Quantity("location", "degree", wide(angle_deg)),
        Quantity("load", "N/m", wide(load)),
        Quantity("R", "mm", wide(radius_mm)),
        Quantity("time", observed.unit, wide(observed.touch_time_s)),
        Quantity("predicted reading", "% of the peak", 100 * share),
        Quantity("reading of the touch before", "% of the peak", 100 * previous_readings(observed) / peak),
    )
    return tuple(each for each in all_of_them if each.varies)
