"""What an uncertain calibration does to the readings of a touch."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.neighbours import Neighbours


def reading_covariance(jacobian: FloatArray, covariance: FloatArray) -> FloatArray:
    """Covariance of the readings of each touch from the covariance of the calibration, (t, m, m).

    Parameters
    ----------
    jacobian : (3 + s, t, m) array
        Over an element's own response, depth and angle, then over what elements share: from `calibration_jacobian`,
        where these are σ and log μ, or more.
    covariance : (3 m + s, 3 m + s) array
        Covariance of responses, depths, angles, σ, log μ, and what else elements share.
    """
    m = jacobian.shape[-1]
    blocks = covariance[: 3 * m, : 3 * m].reshape(3, m, 3, m)
    own = np.einsum("ati,aibj,btj->tij", jacobian[:3], blocks, jacobian[:3], optimize=True)
    shared = covariance[3 * m :, : 3 * m].reshape(-1, 3, m)
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

    def __getstate__(self) -> dict[str, object]:
        """What is sent to a worker: not the neighbours, 90 MB that it solves for itself in a fraction of a second."""
        return {"chain": self.chain, "covariance": self.covariance}

    @cached_property
    def _neighbours(self) -> Neighbours:
        return Neighbours.of(self.chain)
