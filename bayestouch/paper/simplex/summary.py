"""Minimum, mean and maximum, as in Tables 1 and 2 of the paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def summary(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return minimum, mean and maximum of the values that are not NaN; NaN if there are none."""
    some = values[np.isfinite(values)]
    if not some.size:
        return np.nan, np.nan, np.nan
    return float(some.min()), float(some.mean()), float(some.max())
