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
class MapNeighbours:
    """Fingers at one step above and below in a parameter shared by all elements, each with a factor of the radius.

    Since κ = P R/μ, a step in log μ is a step in the radius; on a surface out of round it is also a step in the
    curvature of the surface.
    """

    sides: tuple[tuple[FingerChain, float], tuple[FingerChain, float]]
    step: float


def contact_neighbours(elastic: FingerChain) -> tuple[MapNeighbours, MapNeighbours]:
    """Neighbours of an elastic finger in σ, then in log μ."""
    sigma = elastic.poisson_ratio
    step = min(STEP_POISSON, 0.5 * (0.5 - sigma))
    up, down = (elastic.with_(poisson_ratio=sigma + sign * step) for sign in (1, -1))
    wider, narrower = np.exp(STEP_LOG_MODULUS), np.exp(-STEP_LOG_MODULUS)
    return (
        MapNeighbours(((up, 1.0), (down, 1.0)), step),
        MapNeighbours(((_curved(elastic, wider), narrower), (_curved(elastic, narrower), wider)), STEP_LOG_MODULUS),
    )


def _curved(elastic: FingerChain, factor: float) -> FingerChain:
    """The finger with departures of its surface from a circle multiplied by a factor."""
    return elastic if elastic.surface is None else elastic.with_(surface=elastic.surface.scaled(factor))


@dataclass(frozen=True, eq=False)
class EmpiricalCalibration:
    """Posterior of a finger's E map; m elements, p = 2 n_c + 1 coefficients, s parameters that all elements share.

    Attributes
    ----------
    chain : EmpiricalFingerChain
        The finger with the posterior mean of E.
    covariance : (m, p, p) array
        Covariance of each row of E, at given values of the shared parameters.
    by_contact : (s, m, p) array
        Derivative of the fitted E over each shared parameter: σ and log μ of the contact, then the values of effects.
    contact_covariance : (s, s) array
        Covariance of the shared parameters.
    noise : Noise
        Noise of the readings; its discrepancy is the error that neither repeats nor the map explain.
    effect_neighbours : tuple of MapNeighbours
        Fingers at one step above and below in each of the s - 2 values of the effects.
    """

    chain: EmpiricalFingerChain
    covariance: FloatArray
    by_contact: FloatArray
    contact_covariance: FloatArray
    noise: Noise
    effect_neighbours: tuple[MapNeighbours, ...] = ()

    def reading_covariance(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Covariance of the readings of each touch due to the calibration, (t, m, m).

        It replaces `bayestouch.finger.reading.covariance.reading_covariance`. Only σ and μ are shared by the elements;
        the other parameters are independent between elements.

        Parameters
        ----------
        radius_mm, angle, load : (t,) array_like
            Composite radius R (mm), location (rad), load (N/m).
        """
        own, shared = self.own_variance(radius_mm, angle, load), self.by_shared(radius_mm, angle, load)
        covariance = np.einsum("ite,ij,jtf->tef", shared, self.contact_covariance, shared, optimize=True)
        index = np.arange(own.shape[1])
        covariance[:, index, index] += own
        return np.asarray(covariance)

    def own_variance(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Variance of the signals (t, m) at given values of the shared parameters."""
        design = pressure_matrix(self.chain.elastic, radius_mm, angle, load, self.chain.n_coefficients)
        return np.asarray(np.einsum("etp,tp->te", design @ self.covariance, design))

    def by_shared(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Derivative of the signals over the shared parameters, with the map fitted again, (s, t, m)."""
        radius, angle = np.asarray(radius_mm, dtype=float), np.asarray(angle, dtype=float)
        load, e = np.asarray(load, dtype=float), self.chain.e_matrix
        shared = np.empty((len(self.by_contact), len(load), len(e)))
        for i, near in enumerate((*self._contact_neighbours, *self.effect_neighbours)):
            if near.sides[0] == near.sides[1] == (self.chain.elastic, 1.0):
                design = pressure_matrix(self.chain.elastic, radius, angle, load, self.chain.n_coefficients)
                shared[i] = design @ self.by_contact[i].T
                continue
            up, down = (
                EmpiricalFingerChain(side, e + sign * near.step * self.by_contact[i]).series(
                    radius * factor, angle, load
                )
                for sign, (side, factor) in zip((1, -1), near.sides, strict=True)
            )
            shared[i] = (up - down) / (2 * near.step)
        return shared

    @cached_property
    def _contact_neighbours(self) -> tuple[MapNeighbours, MapNeighbours]:
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
    def from_arrays(
        cls,
        arrays: Mapping[str, FloatArray],
        elastic: FingerChain,
        noise: Noise,
        effect_neighbours: tuple[MapNeighbours, ...] = (),
    ) -> EmpiricalCalibration:
        """Posterior from the result of `arrays`; without `effect_neighbours`, effects count as known exactly."""
        shared = 2 + len(effect_neighbours)
        return cls(
            chain=EmpiricalFingerChain(elastic, np.asarray(arrays["empirical_map"])),
            covariance=np.asarray(arrays["empirical_covariance"]),
            by_contact=np.asarray(arrays["empirical_map_by_contact"])[:shared],
            contact_covariance=np.asarray(arrays["empirical_contact_covariance"])[:shared, :shared],
            noise=noise,
            effect_neighbours=effect_neighbours,
        )
