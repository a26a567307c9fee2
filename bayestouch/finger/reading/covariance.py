"""Covariance of the readings of a touch due to the uncertainty of the calibration."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.neighbours import Neighbours


def reading_covariance(jacobian: FloatArray, covariance: FloatArray) -> FloatArray:
    """Covariance of the readings of each touch, (t, m, m), from the covariance of the calibration.

    Parameters
    ----------
    jacobian : (3 + s, t, m) array
        Derivative of the readings over response, depth and angle of the element, then over the s parameters that all
        elements share: σ and log μ (`bayestouch.chain.neighbours.calibration_jacobian`), then others if there are any.
    covariance : (3 m + s, 3 m + s) array
        Covariance of responses, depths, angles, σ, log μ, and the other shared parameters.
    """
    m = jacobian.shape[-1]
    blocks = covariance[: 3 * m, : 3 * m].reshape(3, m, 3, m)
    own = np.einsum("ati,aibj,btj->tij", jacobian[:3], blocks, jacobian[:3], optimize=True)
    shared = covariance[3 * m :, : 3 * m].reshape(-1, 3, m)
    # Row r: covariance of the shared parameter r with each reading, due to the parameters of the element.
    crossed = np.einsum("rbj,btj->rtj", shared, jacobian[:3])
    mixed = np.einsum("rti,rtj->tij", jacobian[3:], crossed)
    common = np.einsum("rti,rs,stj->tij", jacobian[3:], covariance[3 * m :, 3 * m :], jacobian[3:], optimize=True)
    return np.asarray(own + mixed + mixed.swapaxes(1, 2) + common)


def spread_of(derivative: FloatArray, root: FloatArray) -> FloatArray:
    """Changes of the readings (d, t, m) per standard deviation of d independent directions.

    Their products, summed over the directions, are the covariance of the readings to first order.

    Parameters
    ----------
    derivative : (d, t, m) array
        Derivative of the readings over d uncertain parameters.
    root : (d, d) array
        Lower Cholesky factor of the covariance of these parameters, see `root_of`.
    """
    return np.asarray(np.einsum("qk,qtm->ktm", root, derivative, optimize=True))


def root_of(covariance: FloatArray) -> FloatArray:
    """Lower Cholesky factor of a covariance (q, q), which may have zeros on its diagonal."""
    diagonal = np.diag(covariance)
    return np.asarray(np.linalg.cholesky(covariance + np.diag(1e-12 * diagonal + 1e-300)))


def without_modulus(covariance: FloatArray, n_elements: int) -> FloatArray:
    """Covariance of a calibration, as for `reading_covariance`, with zeros in the row and the column of log μ."""
    out = covariance.copy()
    log_mu = 3 * n_elements + 1
    out[log_mu] = out[:, log_mu] = 0.0
    return out


@dataclass(frozen=True, eq=False)
class CalibrationCovariance:
    """Covariance of the readings of touches due to the calibration of the elastic model.

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

    def with_known_modulus(self) -> CalibrationCovariance:
        """The covariance for a known shear modulus that is independent of the other parameters."""
        return replace(self, covariance=without_modulus(self.covariance, self.chain.n_elements))

    def jacobian(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Derivatives of the readings, (5, t, m), as `calibration_jacobian`; parameters as `__call__`."""
        return self._neighbours.jacobian(radius_mm, angle, load)

    def __getstate__(self) -> dict[str, object]:
        """State for a worker process, without the neighbours: 90 MB that it computes in a fraction of a second."""
        return {"chain": self.chain, "covariance": self.covariance}

    @cached_property
    def _neighbours(self) -> Neighbours:
        return Neighbours.of(self.chain)
