"""Normal variables between bounds."""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr, ndtr, ndtri, ndtri_exp

from bayestouch.array_types import FloatArray

# Standard deviations beyond which a bound makes no difference, if the other is nearer. If both are beyond it on one
# side, probabilities are too small for a floating-point number, and their logarithms are used.
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
    beyond = high < -FAR
    near_low, near_high = np.clip(low, -FAR, FAR), np.where(beyond, FAR, np.clip(high, -FAR, FAR))
    below, mass = ndtr(near_low), ndtr(near_high) - ndtr(near_low)
    out = ndtri(np.clip(below + mass * ndtr(sign * z), 1e-300, 1 - 1e-16))
    log_mass = np.log(mass)
    if beyond.any():
        z_far, low_far, high_far = (sign * z)[beyond], low[beyond], high[beyond]
        log_mass[beyond] = log_probability(low_far, high_far)
        log_below = np.logaddexp(log_ndtr(low_far), log_mass[beyond] + log_ndtr(z_far))
        out[beyond] = np.clip(ndtri_exp(log_below), low_far, high_far)
    return sign * out, log_mass + 0.5 * (out**2 - z**2)


def log_probability(low: FloatArray, high: FloatArray) -> FloatArray:
    """Log of the probability (n,) that a standard normal variable is between bounds (n,), however far in a tail."""
    turned = low > 0
    below, above = log_ndtr(np.where(turned, -high, low)), log_ndtr(np.where(turned, -low, high))
    return np.asarray(above + np.log1p(-np.exp(below - above)))


def falling_from_bounds(slope: FloatArray, covariance: FloatArray, farthest: float) -> tuple[FloatArray, FloatArray]:
    """Normal density whose part between the bounds falls from a mode at bounds as steeply as a log density does there.

    Parameters
    ----------
    slope : (d,) array
        Gradient of the log density at the mode, for the entries that are at a bound; 0 for the others.
    covariance : (d, d) array
        Inverse of minus its second derivative.
    farthest : float
        Largest distance of the mean beyond a bound, in standard deviations. An entry whose density falls more steeply
        gets a smaller standard deviation, with which the density falls as steeply at this distance.

    Returns
    -------
    (d,) array, (d, d) array
        Mean minus mode, and covariance.
    """
    for i in np.flatnonzero(slope):
        share = (farthest / slope[i]) ** 2 / covariance[i, i]
        if share < 1:
            covariance = covariance - (1 - share) / covariance[i, i] * np.outer(covariance[i], covariance[i])
    return np.asarray(covariance @ slope), covariance
