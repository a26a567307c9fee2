"""What an uncertain calibration does to the readings of a touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.chain.finger import FingerChain

FloatArray = NDArray[np.float64]

# Central differences; the chain is smooth on these scales.
STEP_RADIUS_MM, STEP_ANGLE, STEP_POISSON, STEP_LOG_MODULUS = 1e-3, 1e-4, 1e-4, 1e-3


def calibration_jacobian(chain: FingerChain, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
    """Derivative of the readings with respect to the calibration parameters.

    Parameters
    ----------
    chain : FingerChain
        Calibrated finger.
    radius_mm, angle, load : (t,) arrays
        Touches: composite radius R (mm), location (rad), load (N/m).

    Returns
    -------
    (5, t, m) array
        With respect to the element's own response, depth (mm) and angle (rad), then σ and log μ.
    """

    def predict(finger: FingerChain) -> FloatArray:
        return finger.predict(radius_mm, angle, load)

    def central(step: float, **name_and_value: object) -> FloatArray:
        ((name, value),) = name_and_value.items()
        up = predict(chain.with_(**{name: value + step}))  # type: ignore[operator]
        down = predict(chain.with_(**{name: value - step}))  # type: ignore[operator]
        return np.asarray((up - down) / (2 * step))

    mu = chain.shear_modulus_MPa
    return np.stack(
        [
            # not reading / response: the response of a dead element is zero
            predict(chain.with_(response=np.ones(chain.n_elements))) - chain.offset,
            central(STEP_RADIUS_MM, sensing_radius_mm=chain.sensing_radius_mm),
            central(STEP_ANGLE, angle=chain.angle),
            central(STEP_POISSON, poisson_ratio=chain.poisson_ratio),
            central(STEP_LOG_MODULUS * mu, shear_modulus_MPa=mu) * mu,
        ]
    )


def reading_covariance(jacobian: FloatArray, covariance: FloatArray) -> FloatArray:
    """Covariance of the readings of each touch from the covariance of the calibration, (t, m, m).

    Parameters
    ----------
    jacobian : (5, t, m) array
        From `calibration_jacobian`.
    covariance : (3 m + 2, 3 m + 2) array
        Covariance of responses, depths, angles, σ, log μ.
    """
    m = jacobian.shape[-1]
    blocks = covariance[: 3 * m, : 3 * m].reshape(3, m, 3, m)
    own = np.einsum("ati,aibj,btj->tij", jacobian[:3], blocks, jacobian[:3], optimize=True)
    shared = covariance[3 * m :, : 3 * m].reshape(2, 3, m)
    # column r: covariance of shared parameter r with each reading through that element's own parameters
    crossed = np.einsum("rbj,btj->rtj", shared, jacobian[:3])
    mixed = np.einsum("rti,rtj->tij", jacobian[3:], crossed)
    common = np.einsum("rti,rs,stj->tij", jacobian[3:], covariance[3 * m :, 3 * m :], jacobian[3:], optimize=True)
    return np.asarray(own + mixed + mixed.swapaxes(1, 2) + common)


@dataclass(frozen=True, eq=False)
class CalibrationCovariance:
    """Covariance of the readings of touches that a calibration of the elastic model leaves.

    Attributes
    ----------
    chain : FingerChain
        Calibrated finger.
    covariance : (3 m + 2, 3 m + 2) array
        Covariance of responses, depths, angles, σ, log μ.
    """

    chain: FingerChain
    covariance: FloatArray

    def __call__(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Covariance (t, m, m) for touches of composite radius R (mm), location (rad) and load (N/m), all (t,)."""
        return reading_covariance(calibration_jacobian(self.chain, radius_mm, angle, load), self.covariance)
