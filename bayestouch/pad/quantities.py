"""Quantities on which the residuals of touches on a pad may depend."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import COORDINATES
from bayestouch.model.observations import Observations
from bayestouch.model.quantities import Quantity, previous_readings


def quantities(
    observed: Observations,
    element_place: tuple[FloatArray, ...],
    place: tuple[FloatArray, ...],
    load: FloatArray,
    share: FloatArray,
    peak: FloatArray,
    zero: FloatArray,
) -> tuple[Quantity, ...]:
    """Quantities of touches on a pad, without those that have one value only.

    Parameters
    ----------
    observed : Observations
        The touches.
    element_place, place : tuples of (m,) and of (t,) arrays
        Locations of elements and touches, mm.
    load : (t,) array
        Load as read, N; NaN unknown.
    share : (t, m) array
        Predicted signal over the peak.
    peak, zero : (m,) arrays
        Peak reading of each element, and its reading without touch.
    """

    def wide(values: FloatArray) -> FloatArray:
        return np.broadcast_to(values[:, None], share.shape)

    from_element = [axis[:, None] - element for axis, element in zip(place, element_place, strict=True)]
    distance = np.sqrt(np.sum(np.square(from_element), axis=0))
    one = len(place) == 1
    all_of_them = (
        Quantity("place from element to touch", "mm", from_element[0])
        if one
        else Quantity("distance from element to touch", "mm", distance),
        *(Quantity(name, "mm", wide(axis)) for name, axis in zip(COORDINATES, place, strict=False)),
        Quantity("load", "N", wide(load)),
        Quantity("time", observed.unit, wide(observed.touch_time_s)),
        Quantity("predicted signal", "% of the peak", 100 * share),
        Quantity("reading of the touch before", "% of the peak", 100 * previous_readings(observed, zero) / peak),
    )
    return tuple(each for each in all_of_them if each.varies)
