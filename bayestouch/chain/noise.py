"""Noise of the readings and of the force sensor, with the effect of averaging."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.output.summary import Summarised


@dataclass(frozen=True, eq=False, repr=False)
class Noise(Summarised):
    """Standard deviations of the readings and of the load around the prediction.

    Attributes
    ----------
    tactile_sd : (n_elements,) array
        Noise of one raw reading, in the sensor's unit.
    discrepancy_sd : (n_elements,) array
        Discrepancy of the model, in the sensor's unit; averaging does not reduce it. Zero if the fit is within noise.
    signal_share : float
        Further error as a fraction of the signal (reading minus offset); averaging does not reduce it.
    force_sd : float
        Noise of one reading of the force sensor, N/m on a finger, N on a pad; NaN without a force sensor.
    load_scatter : float
        Standard deviation of an error that all elements of a pad share in a touch, as an error of the acting load, N:
        they read a touch as if its load were a little different, for example because it is not pressed in the same way
        each time, or because a gain drifts that all elements share. Averaging does not reduce it. Zero on a finger.
        Where loads were not measured, it has only the drift, in units of the mean load of the calibration.
    """

    tactile_sd: FloatArray
    discrepancy_sd: FloatArray
    signal_share: float = 0.0
    force_sd: float = np.nan
    load_scatter: float = 0.0

    def mean_load_sd(self, reads: ArrayLike) -> FloatArray:
        """Standard deviation of a mean of `reads` readings (...) of the force sensor; NaN without one."""
        return np.asarray(self.force_sd / np.sqrt(np.asarray(reads)))

    def mean_sd(self, counts: ArrayLike, signal: ArrayLike) -> FloatArray:
        """Standard deviation of a mean of `counts` readings with the expected signal `signal`: see `mean_variance`."""
        return np.asarray(np.sqrt(self.mean_variance(counts, signal)))

    def mean_variance(self, counts: ArrayLike, signal: ArrayLike) -> FloatArray:
        """Variance of a mean of `counts` readings with the expected signal `signal`.

        Parameters
        ----------
        counts : (..., n_elements) array_like
            Number of raw readings of each mean; 0 gives ``inf``.
        signal : (..., n_elements) array_like
            Expected reading minus offset.
        """
        return np.asarray(self.averaged_variance(counts, signal) + self.lasting_variance(signal))

    def averaged_variance(self, counts: ArrayLike, signal: ArrayLike) -> FloatArray:
        """Part of `mean_variance` that averaging reduces; parameters as there."""
        counts = np.asarray(counts, dtype=float)
        averaged = np.divide(self.tactile_sd**2, counts, out=np.full(counts.shape, np.inf), where=counts > 0)
        return np.asarray(averaged, dtype=np.float64)

    def lasting_variance(self, signal: ArrayLike) -> FloatArray:
        """Part of `mean_variance` that averaging does not reduce, shape of `signal` (..., n_elements)."""
        return np.asarray(self.discrepancy_sd**2 + (self.signal_share * np.asarray(signal)) ** 2)

    def without_effects(self) -> Noise:
        """The noise without what effects of the noise add."""
        return self

    def widened(self, excess: float) -> Self:
        """This noise of the readings multiplied by `excess`, so that it covers their misfit.

        Errors of the load stay: readings that miss the model under every load do not show them.
        """
        if excess == 1:
            return self
        return replace(
            self,
            tactile_sd=excess * self.tactile_sd,
            discrepancy_sd=excess * self.discrepancy_sd,
            signal_share=excess * self.signal_share,
        )

    def apart(self) -> Noise:
        """The same noise, but errors that elements share, see `shared_errors`, are errors of each element alone."""
        return self

    def own_variance(self, counts: ArrayLike, signal: ArrayLike) -> FloatArray:
        """`mean_variance` without errors that elements share, see `shared_errors`."""
        return self.mean_variance(counts, signal)

    def own_sd(self, counts: ArrayLike, signal: ArrayLike) -> FloatArray:
        """Root of `own_variance`."""
        return np.asarray(np.sqrt(self.own_variance(counts, signal)))

    def own_signal_variance(self, counts: ArrayLike, signal: ArrayLike) -> FloatArray:
        """Part of `own_variance` that depends on the signal."""
        return np.asarray((self.signal_share * np.asarray(signal)) ** 2)

    def shared_errors(self, counts: FloatArray) -> FloatArray:
        """Change of means over `counts` readings (t, m) by one sd of each error that elements share, (q, t, m): none.

        The load scatter is not one of them: it is an error of the load.
        """
        return np.zeros((0, *counts.shape))
