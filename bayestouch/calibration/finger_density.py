"""Exact posterior density of a finger's calibration, quick enough to be sampled.

The prediction needs the response at the κ of the calibration touches only: a table of two knots at the knife
edge, and one of `KNOTS` knots over the other touches. Their spectra depend on σ smoothly; they are interpolated
between values solved once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.body.annulus import solve_annulus
from bayestouch.calibration.finger import LOAD_REACH, FingerLikelihood
from bayestouch.chain.response import ContactSpectra, ResponseTable
from bayestouch.fit import LaplaceFit

FloatArray = NDArray[np.float64]

# Knots over the touches that are not knife edges, and σ at which their contact is solved.
KNOTS = 24
SIGMA_NODES = 5
# The tables reach this many standard deviations of σ and log μ, and at least these far.
REACH = 8.0


@dataclass(frozen=True, eq=False)
class FingerDensity:
    """Log posterior of the flat vector (responses, depths, angles, σ, log μ).

    Attributes
    ----------
    likelihood : FingerLikelihood
        Touches and priors.
    sd : (t, m) array
        Standard deviation of each mean reading.
    mean, spread : (d,) arrays
        Prior.
    sigma_nodes : (s,) array
        σ at which `spectra` were solved.
    spectra : (s, n, n_modes) array
        Pressure spectra of the touches that are not knife edges; empty where there are none.
    template : ContactSpectra
        Knots and modes of the table.
    """

    likelihood: FingerLikelihood
    sd: FloatArray
    mean: FloatArray
    spread: FloatArray
    sigma_nodes: FloatArray
    spectra: FloatArray
    template: ContactSpectra

    @classmethod
    def of(cls, likelihood: FingerLikelihood, laplace: LaplaceFit, sd: FloatArray) -> FingerDensity:
        """Solve the contacts that the posterior needs."""
        finger, known = likelihood.finger, likelihood.known
        m = finger.n_elements
        sigma, log_mu = laplace.mode[3 * m], laplace.mode[3 * m + 1]
        reach_sigma, reach_mu = REACH * laplace.sd[3 * m], REACH * laplace.sd[3 * m + 1] + 0.01
        nodes = np.linspace(max(sigma - reach_sigma, 0.0), min(sigma + reach_sigma, 0.4999), SIGMA_NODES)
        blunt = known.radius_mm > 0
        kappa = known.load[blunt] / 1000 * known.radius_mm[blunt] / np.exp(log_mu)
        ends = (kappa.min(), kappa.max()) if blunt.any() else (0.0, 1.0)
        deepest = laplace.mode[m : 2 * m] + REACH * laplace.sd[m : 2 * m]
        solved = [
            ContactSpectra.of(
                (finger.core_radius_mm, finger.outer_radius_mm),
                float(node),
                smallest_kappa=ends[0] * np.exp(-reach_mu),
                largest_kappa=ends[1] * np.exp(reach_mu),
                largest_sensing_radius_mm=min(float(deepest.max()), likelihood.priors.sensing_radius.high),
                contact=likelihood.contact,
                knots=KNOTS if blunt.any() else 2,
            )
            for node in nodes
        ]
        mean, spread = likelihood.priors.flat(finger, likelihood.start[:m])
        spectra = np.stack([one.spectra for one in solved])
        return cls(likelihood, sd, mean, spread, nodes, spectra, solved[0])

    def log_density(self, vector: FloatArray) -> float:
        """Log posterior density up to a constant; ``-inf`` outside the bounds."""
        likelihood, finger = self.likelihood, self.likelihood.finger
        low, high = likelihood.priors.bounds(finger, LOAD_REACH * float(likelihood.known.load.max()))
        if not np.all((vector > low) & (vector < high)) or not self._covered(vector):
            return -np.inf
        predicted = self.predict(vector)
        known = likelihood.known
        z = likelihood.whiten(known.readings - predicted, predicted, self.sd)
        # The load's shared error makes the covariance depend on the prediction: its determinant counts.
        shared = np.where(likelihood.missing, 0.0, predicted * (known.load_sd / known.load)[:, None] / self.sd)
        determinant = np.log1p((shared * shared).sum(axis=1)).sum()
        prior = (vector - self.mean) / self.spread
        return float(-0.5 * ((z * z).sum() + determinant + (prior * prior).sum()))

    def __call__(self, vectors: FloatArray) -> FloatArray:
        """Log density of many vectors, (..., d) to (...)."""
        flat = vectors.reshape(-1, vectors.shape[-1])
        return np.array([self.log_density(vector) for vector in flat]).reshape(vectors.shape[:-1])

    def _covered(self, vector: FloatArray) -> bool:
        """Whether σ lies where the contact was solved."""
        sigma = vector[3 * self.likelihood.n_elements]
        return bool(self.sigma_nodes[0] <= sigma <= self.sigma_nodes[-1])

    def predict(self, vector: FloatArray) -> FloatArray:
        """Expected readings of the calibration touches, (t, m)."""
        finger, known = self.likelihood.finger, self.likelihood.known
        m = finger.n_elements
        response, depth, angle = vector[:m], vector[m : 2 * m], vector[2 * m : 3 * m]
        sigma, mu = float(vector[3 * m]), float(np.exp(vector[3 * m + 1]))
        modes = self.template.body.modes
        body = solve_annulus(
            modes,
            core_radius_mm=finger.core_radius_mm,
            outer_radius_mm=finger.outer_radius_mm,
            poisson_ratio=sigma,
        )
        edge = known.radius_mm == 0
        shape = np.empty((len(known.load), m))
        turn = angle - known.angle[:, None]
        if edge.any():
            knife = ContactSpectra(1.0, np.array([0.0, 1.0]), np.ones((2, len(modes))), body)
            shape[edge] = ResponseTable.of(knife, depth)(np.zeros(int(edge.sum())), turn[edge])
        if not edge.all():
            spectra = np.tensordot(_lagrange(self.sigma_nodes, sigma), self.spectra, axes=1)
            table = ResponseTable.of(
                ContactSpectra(self.template.kappa_scale, self.template.coordinates, spectra, body), depth
            )
            kappa = known.load[~edge] / 1000 * known.radius_mm[~edge] / mu
            shape[~edge] = table(kappa, turn[~edge])
        return np.asarray(response * known.load[:, None] * shape)


def _lagrange(nodes: FloatArray, place: float) -> FloatArray:
    """Weights of polynomial interpolation through `nodes` at `place`."""
    difference = place - nodes
    return np.array([np.prod(np.delete(difference, i) / np.delete(nodes[i] - nodes, i)) for i in range(len(nodes))])
