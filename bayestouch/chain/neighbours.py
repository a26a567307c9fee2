"""Derivatives of a finger's readings with respect to its calibration parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain

# Steps of the central differences; the chain is smooth on these scales.
STEP_RADIUS_MM, STEP_ANGLE, STEP_POISSON, STEP_LOG_MODULUS = 1e-3, 1e-4, 1e-4, 1e-3


@dataclass(frozen=True, eq=False)
class Neighbours:
    """A finger and its copies with one calibration parameter changed by a step; solved once for many touches.

    Attributes
    ----------
    unit : FingerChain
        The finger with responses of 1.
    moved : tuple of (FingerChain, FingerChain, float)
        One step up, one step down and the distance between them, for the depths, the angles, σ and log μ.
    """

    unit: FingerChain
    moved: tuple[tuple[FingerChain, FingerChain, float], ...]

    @classmethod
    def of(cls, chain: FingerChain) -> Neighbours:
        """Return the solved fingers."""

        def moved(name: str, step: float) -> tuple[FingerChain, FingerChain, float]:
            value = getattr(chain, name)
            return chain.with_(**{name: value + step}), chain.with_(**{name: value - step}), 2 * step

        def with_modulus(step: float) -> FingerChain:
            """The modulus changed by a factor; with loads up to the same share of it, the solved contact remains."""
            mu, load = chain.shear_modulus_MPa * (1 + step), chain.largest_load * (1 + step)
            return chain.with_(shear_modulus_MPa=mu, largest_load=load)

        chain.table  # noqa: B018  # solve the contact once for all copies that share it
        return cls(
            # not reading / response, because the response of a dead element is zero
            unit=chain.with_(response=np.ones(chain.n_elements)),
            moved=(
                moved("sensing_radius_mm", STEP_RADIUS_MM),
                moved("angle", STEP_ANGLE),
                moved("poisson_ratio", STEP_POISSON),
                (with_modulus(STEP_LOG_MODULUS), with_modulus(-STEP_LOG_MODULUS), 2 * STEP_LOG_MODULUS),
            ),
        )

    def jacobian(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Return the derivatives of `calibration_jacobian`."""
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
