"""Noise of readings and of the force sensor, and how averaging lowers it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.output.summary import Summarised


@dataclass(frozen=True, eq=False, repr=False)
class Noise(Summarised):
    """Standard deviations around the chain's prediction.

    Attributes
    ----------
    tactile_sd : (n_elements,) array
        One raw reading, in the sensor's unit.
    discrepancy_sd : (n_elements,) array
        What the model misses, in the sensor's unit: does not shrink by averaging. Zero where the fit is within noise.
    signal_share : float
        Further error as a share of the signal (reading minus offset); does not shrink by averaging.
    force_sd : float
        One reading of the force sensor, N/m on a finger, N on a pad; NaN without a force sensor.
    """

    tactile_sd: FloatArray
    discrepancy_sd: FloatArray
    signal_share: float = 0.0
    force_sd: float = np.nan

    def mean_load_sd(self, reads: ArrayLike) -> FloatArray:
        """Standard deviation of a mean of `reads` readings (...) of the force sensor; NaN without one."""
        return np.asarray(self.force_sd / np.sqrt(np.asarray(reads)))

    def mean_sd(self, counts: ArrayLike, signal: ArrayLike) -> FloatArray:
        """Standard deviation of a mean of `counts` readings of which the expected signal is `signal`.

        Parameters
        ----------
        counts : (..., n_elements) array_like
            Raw readings behind each mean; 0 gives ``inf``.
        signal : (..., n_elements) array_like
            Expected reading minus offset.
        """
        counts = np.asarray(counts, dtype=float)
        averaged = np.divide(self.tactile_sd**2, counts, out=np.full(counts.shape, np.inf), where=counts > 0)
        return np.asarray(np.sqrt(averaged + self.discrepancy_sd**2 + (self.signal_share * np.asarray(signal)) ** 2))
