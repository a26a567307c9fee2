"""Normal variables between bounds."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr, ndtri

from bayestouch.array_types import FloatArray

# Standard deviations beyond which a bound makes no difference.
FAR = 30.0


def normal_between(z: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normal variables cut off at bounds from standard normal ones, by their quantile; and the log of the derivative.

    Parameters
    ----------
    z : (n,) array
        Standard normal variables.
    low, high : (n,) arrays
        Bounds, in standard deviations.
    """
    # In the lower tail probabilities keep their digits.
    turned = low > 0
    sign = np.where(turned, -1.0, 1.0)
    low, high = np.where(turned, -high, low), np.where(turned, -low, high)
    low, high = np.clip(low, -FAR, FAR), np.clip(high, -FAR, FAR)
    below, mass = ndtr(low), ndtr(high) - ndtr(low)
    out = ndtri(np.clip(below + mass * ndtr(sign * z), 1e-300, 1 - 1e-16))
    return sign * out, np.log(mass) + 0.5 * (out**2 - z**2)
