"""The posterior of an identified E map: predicted readings and their covariance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.chain.empirical import EmpiricalFingerChain, pressure_matrix
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.noise import Noise

# Steps of central differences. Readings are smooth on these scales; the step in log μ spans a knot of the contact.
STEP_POISSON, STEP_LOG_MODULUS = 1e-3, 0.05


@dataclass(frozen=True, eq=False)
class ContactNeighbours:
    """Fingers at one step to both sides in σ or log μ; since κ = P R/μ, a step in log μ is a step in the radius."""

    sides: tuple[tuple[FingerChain, float], tuple[FingerChain, float]]
    step: float


def contact_neighbours(elastic: FingerChain) -> tuple[ContactNeighbours, ContactNeighbours]:
    """Neighbours of an elastic finger in σ, then in log μ."""
    sigma = elastic.poisson_ratio
    step = min(STEP_POISSON, 0.5 * (0.5 - sigma))
    up, down = (elastic.with_(poisson_ratio=sigma + sign * step) for sign in (1, -1))
    wider, narrower = np.exp(STEP_LOG_MODULUS), np.exp(-STEP_LOG_MODULUS)
    return (
        ContactNeighbours(((up, 1.0), (down, 1.0)), step),
        ContactNeighbours(((elastic, narrower), (elastic, wider)), STEP_LOG_MODULUS),
    )


@dataclass(frozen=True, eq=False)
class EmpiricalCalibration:
    """Posterior of a finger's E map; m elements, p = 2 n_c + 1 coefficients.

    Attributes
    ----------
    chain : EmpiricalFingerChain
        The finger with the posterior mean of E.
    covariance : (m, p, p) array
        Covariance of each row of E, at σ and μ of the model calibration.
    by_contact : (2, m, p) array
        Derivative of the fitted E over σ and log μ of the contact.
    contact_covariance : (2, 2) array
        Covariance of σ and log μ.
    noise : Noise
        Noise of the readings; its discrepancy is the error that neither repeats nor the map explain.
    """

    chain: EmpiricalFingerChain
    covariance: FloatArray
    by_contact: FloatArray
    contact_covariance: FloatArray
    noise: Noise

    def reading_covariance(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Covariance of the readings of each touch due to the calibration, (t, m, m).

        It replaces `bayestouch.finger.reading.covariance.reading_covariance`. Only σ and μ are shared by the elements;
        the other parameters are independent between elements.

        Parameters
        ----------
        radius_mm, angle, load : (t,) array_like
            Composite radius R (mm), location (rad), load (N/m).
        """
        load = np.asarray(load, dtype=float)
        design = pressure_matrix(self.chain.elastic, radius_mm, angle, load, self.chain.n_coefficients)
        own = np.einsum("etp,tp->te", design @ self.covariance, design)
        radius, angle = np.asarray(radius_mm, dtype=float), np.asarray(angle, dtype=float)
        e = self.chain.e_matrix
        shared = np.empty((2, *own.shape))
        for i, near in enumerate(self._contact_neighbours):
            up, down = (
                pressure_matrix(side, radius * factor, angle, load, self.chain.n_coefficients)
                @ (e + sign * near.step * self.by_contact[i]).T
                for sign, (side, factor) in zip((1, -1), near.sides, strict=True)
            )
            shared[i] = (up - down) / (2 * near.step)
        covariance = np.einsum("ite,ij,jtf->tef", shared, self.contact_covariance, shared, optimize=True)
        index = np.arange(own.shape[1])
        covariance[:, index, index] += own
        return np.asarray(covariance)

    @cached_property
    def _contact_neighbours(self) -> tuple[ContactNeighbours, ContactNeighbours]:
        return contact_neighbours(self.chain.elastic)

    def arrays(self) -> dict[str, FloatArray]:
        """Arrays by name, for `extra` of a calibration; `from_arrays` reads them."""
        return {
            "empirical_map": self.chain.e_matrix,
            "empirical_covariance": self.covariance,
            "empirical_map_by_contact": self.by_contact,
            "empirical_contact_covariance": self.contact_covariance,
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, FloatArray], elastic: FingerChain, noise: Noise) -> EmpiricalCalibration:
        """Posterior from the result of `arrays`, the elastic chain and the noise."""
        return cls(
            chain=EmpiricalFingerChain(elastic, np.asarray(arrays["empirical_map"])),
            covariance=np.asarray(arrays["empirical_covariance"]),
            by_contact=np.asarray(arrays["empirical_map_by_contact"]),
            contact_covariance=np.asarray(arrays["empirical_contact_covariance"]),
            noise=noise,
        )
