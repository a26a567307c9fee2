"""What an uncertain calibration does to the readings of a touch."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayestouch.chain.finger import FingerChain

FloatArray = NDArray[np.float64]

# Central differences; the chain is smooth on these scales.
STEP_RADIUS_MM, STEP_ANGLE, STEP_POISSON, STEP_LOG_MODULUS = 1e-3, 1e-4, 1e-4, 1e-3


@dataclass(frozen=True, eq=False)
class Neighbours:
    """A finger and its like, one step of a calibration parameter away: solved once for many touches.

    Attributes
    ----------
    unit : FingerChain
        With responses of 1.
    moved : tuple of (FingerChain, FingerChain, float)
        A step up, a step down and the distance between them: of the depths, the angles, σ, log μ.
    """

    unit: FingerChain
    moved: tuple[tuple[FingerChain, FingerChain, float], ...]

    @classmethod
    def of(cls, chain: FingerChain) -> Neighbours:
        """Solve them."""

        def moved(name: str, step: float, distance: float) -> tuple[FingerChain, FingerChain, float]:
            value = getattr(chain, name)
            return chain.with_(**{name: value + step}), chain.with_(**{name: value - step}), distance

        mu = chain.shear_modulus_MPa
        return cls(
            # not reading / response: the response of a dead element is zero
            unit=chain.with_(response=np.ones(chain.n_elements)),
            moved=(
                moved("sensing_radius_mm", STEP_RADIUS_MM, 2 * STEP_RADIUS_MM),
                moved("angle", STEP_ANGLE, 2 * STEP_ANGLE),
                moved("poisson_ratio", STEP_POISSON, 2 * STEP_POISSON),
                moved("shear_modulus_MPa", STEP_LOG_MODULUS * mu, 2 * STEP_LOG_MODULUS),
            ),
        )

    def jacobian(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """As `calibration_jacobian`."""
        touch = (radius_mm, angle, load)
        return np.stack(
            [
                self.unit.predict(*touch) - self.unit.offset,
                *((up.predict(*touch) - down.predict(*touch)) / distance for up, down, distance in self.moved),
            ]
        )


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
    return Neighbours.of(chain).jacobian(radius_mm, angle, load)


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
        return reading_covariance(self.jacobian(radius_mm, angle, load), self.covariance)

    def jacobian(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """As `calibration_jacobian`, (5, t, m), of this finger."""
        return self._neighbours.jacobian(radius_mm, angle, load)

    @cached_property
    def _neighbours(self) -> Neighbours:
        return Neighbours.of(self.chain)
