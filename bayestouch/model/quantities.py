"""Quantities on which residuals may depend, with a value for every touch and element."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.model.observations import Observations


@dataclass(frozen=True, eq=False)
class Quantity:
    """A quantity on which residuals may depend.

    Attributes
    ----------
    name : str
        Name for reports.
    unit : str
        Unit of the values.
    values : (t, m) array
        Value for each touch and element; NaN unknown.
    """

    name: str
    unit: str
    values: FloatArray

    @property
    def varies(self) -> bool:
        """Whether the values differ between touches or elements."""
        finite = self.values[np.isfinite(self.values)]
        return len(finite) > 0 and float(np.ptp(finite)) > 1e-9 * float(np.abs(finite).max(initial=0.0))


def previous_readings(observed: Observations, zero: FloatArray | float = 0.0) -> FloatArray:
    """Mean reading of each element above `zero` (m,) in the previous touch, (t, m); zero for the first touch."""
    start = np.full(observed.n_touches, np.inf)
    np.minimum.at(start, observed.row_touch, observed.time_s)
    history = observed.history
    last = np.searchsorted(history.end_s, start, side="left") - 1
    return np.where((last >= 0)[:, None], np.nan_to_num(history.readings - zero)[np.maximum(last, 0)], 0.0)
