"""Propagation of errors of the readings to errors of R, θ_c and P, by touch and element."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.output.summary import Summarised
from bayestouch.reliability.known_finger import KnownFinger, TouchPlaces

#: Estimated quantities of a touch: R (mm), θ_c (degree), P (N/m).
NAMES = ("R", "theta_c", "P")
_UNITS = np.array([1.0, 180 / np.pi, 1.0])


@dataclass(frozen=True, eq=False, repr=False)
class TouchEstimator(Summarised):
    """First-order estimator of touches: generalised least squares for R, θ_c and P; t touches, m elements.

    Attributes
    ----------
    weights : (t, 3, m) array
        Change of R (mm), θ_c (degree) and P (N/m) per unit error of each reading: ``(Jᵀ Σ⁻¹ J)⁻¹ Jᵀ Σ⁻¹``.
    load_weights : (t, 3) array
        The same per N/m error of the force sensor; zero if it is not used.
    noise_variance : (t, m) array
        Noise variance of the mean readings, without the discrepancy of the model.
    load_variance : float
        Noise variance of the mean reading of the force sensor.
    """

    weights: FloatArray
    load_weights: FloatArray
    noise_variance: FloatArray
    load_variance: float

    @classmethod
    def of(
        cls,
        known: KnownFinger,
        touches: TouchPlaces,
        *,
        samples: int = 1,
        use_load: bool = True,
        plug_in: bool = False,
    ) -> TouchEstimator:
        """Estimator of touches on a finger.

        Parameters
        ----------
        known : KnownFinger
            The calibrated finger.
        touches : TouchPlaces
            The touches.
        samples : int
            Samples averaged in each touch.
        use_load : bool
            Whether the force sensor is read.
        plug_in : bool
            Weight readings only by their noise, as if the calibration were exact.

        Raises
        ------
        InputError
            If a touch has fewer readings than unknowns, or `samples` is below 1.
        """
        known.check_unknowns(use_load)
        jacobian = known.touch_jacobian(touches)
        weighted: FloatArray
        if plug_in:
            weighted = jacobian / known.noise_variance(samples)[:, None]
        else:
            weighted = np.asarray(np.linalg.solve(known.covariance(touches, samples), jacobian), dtype=np.float64)
        information = jacobian.swapaxes(1, 2) @ weighted
        load_sd = known.load_sd(samples, use_load)
        information[:, 2, 2] += load_sd**-2
        inverse = np.linalg.inv(information) * _UNITS[:, None]
        read = known.noise.tactile_sd**2 / samples
        return cls(
            weights=np.asarray(inverse @ weighted.swapaxes(1, 2)),
            load_weights=np.asarray(inverse[:, :, 2] * load_sd**-2),
            noise_variance=np.broadcast_to(read, (touches.n_touches, len(read))),
            load_variance=load_sd**2 if np.isfinite(load_sd) else 0.0,
        )

    def errors(self, of_readings: FloatArray) -> FloatArray:
        """Errors of R (mm), θ_c (degree), P (N/m) from errors of the readings, (..., t, m) to (..., t, 3).

        The error of a reading is its difference from the prediction of the calibration for the true touch.
        """
        return np.asarray(np.einsum("tim,...tm->...ti", self.weights, of_readings))

    def noise_sd(self) -> FloatArray:
        """Standard deviations of the estimates from the noise of elements and force sensor, (t, 3)."""
        variance = self.noise_by_element().sum(axis=-1) + self.load_weights**2 * self.load_variance
        return np.asarray(np.sqrt(variance))

    def noise_by_element(self) -> FloatArray:
        """Variance of each estimate from the noise of each element, (t, 3, m)."""
        return np.asarray(self.weights**2 * self.noise_variance[:, None, :])

    def variance_by_element(self, covariance: FloatArray) -> FloatArray:
        """Variance of each estimate from errors with the covariance (t, m, m), by element, (t, 3, m).

        The part of an element is its own variance and half of each covariance with another element, so that the parts
        add up to the total. A negative part means that the element compensates for errors of others.
        """
        return np.asarray(self.weights * (self.weights @ covariance))
