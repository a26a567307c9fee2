"""Minimum, mean and maximum, the form of the paper's Tables 1 and 2."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def summary(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """Minimum, mean and maximum, NaN left out; NaN where nothing is left."""
    some = values[np.isfinite(values)]
    if not some.size:
        return np.nan, np.nan, np.nan
    return float(some.min()), float(some.mean()), float(some.max())
