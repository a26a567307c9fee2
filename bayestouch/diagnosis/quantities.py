"""What residuals are looked at against: one value for every touch and element."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.model.observations import Observations


@dataclass(frozen=True, eq=False)
class Quantity:
    """A quantity along which a residual may have structure.

    Attributes
    ----------
    name : str
        In plain words.
    unit : str
        Unit.
    values : (t, m) array
        Value for each touch and element; NaN unknown.
    """

    name: str
    unit: str
    values: FloatArray

    @property
    def varies(self) -> bool:
        """Whether there is anything to see along it."""
        finite = self.values[np.isfinite(self.values)]
        return len(finite) > 0 and float(np.ptp(finite)) > 1e-9 * float(np.abs(finite).max(initial=0.0))


def of_finger(
    observed: Observations,
    element_deg: FloatArray,
    angle_deg: FloatArray,
    radius_mm: FloatArray,
    load: FloatArray,
    share: FloatArray,
    peak: FloatArray,
) -> tuple[Quantity, ...]:
    """Quantities of touches on a finger; those that are the same in all touches are left out.

    Parameters
    ----------
    observed : Observations
        Touches.
    element_deg : (m,) array
        Angles of the elements.
    angle_deg, radius_mm, load : (t,) arrays
        Location, composite radius and load.
    share : (t, m) array
        Predicted reading over the peak.
    peak : (m,) array
        Peak reading.
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


def previous_readings(observed: Observations) -> FloatArray:
    """Mean reading of each element in the touch before, (t, m); zero for the first touch."""
    start = np.full(observed.n_touches, np.inf)
    np.minimum.at(start, observed.row_touch, observed.time_s)
    history = observed.history
    last = np.searchsorted(history.end_s, start, side="left") - 1
    return np.where((last >= 0)[:, None], history.readings[np.maximum(last, 0)], 0.0)


def of_pad(
    observed: Observations,
    element_place: tuple[FloatArray, ...],
    place: tuple[FloatArray, ...],
    load: FloatArray,
    share: FloatArray,
    peak: FloatArray,
) -> tuple[Quantity, ...]:
    """Quantities of touches on a pad; those that are the same in all touches are left out.

    Parameters
    ----------
    observed : Observations
        Touches.
    element_place, place : tuples of (m,) and of (t,) arrays
        Places of elements and touches, mm.
    load : (t,) array
        Load as read; NaN unknown.
    share : (t, m) array
        Predicted signal over the peak.
    peak : (m,) array
        Peak reading.
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
        *(Quantity(name, "mm", wide(axis)) for name, axis in zip(("x", "y"), place, strict=False)),
        Quantity("load", "N", wide(load)),
        Quantity("time", observed.unit, wide(observed.touch_time_s)),
        Quantity("predicted signal", "% of the peak", 100 * share),
        Quantity("reading of the touch before", "% of the peak", 100 * previous_readings(observed) / peak),
    )
    return tuple(each for each in all_of_them if each.varies)
