"""Readings of a finger's calibration touches summed over Fourier modes: what its posterior is evaluated with.

Where the touches are is known, so that the angles' part of the series ``Σ_k w_k q_k cos k(θ_s - θ_c)`` is worked out
once, and each evaluation is two products of matrices. Pressure spectra q depend smoothly on σ and ``κ = P R/μ``: they
are interpolated between values solved once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.body.annulus import solve_annulus
from bayestouch.calibration.finger import FingerFit
from bayestouch.calibration.finger_likelihood import STEP_LOAD, FingerLikelihood, prediction_and_slope
from bayestouch.chain.response import ContactSpectra

FloatArray = NDArray[np.float64]

# Spectra are solved at these many σ, and at κ this far apart in log(1 + κ/κ_s); cubic interpolation.
SIGMA_NODES = 5
KAPPA_STEP, LEAST_KNOTS = 0.1, 6
# They reach this many standard deviations of σ and log μ, and at least these far.
REACH = 8.0


@dataclass(frozen=True, eq=False)
class TouchSeries:
    """Readings of the calibration touches, and their derivative with respect to the load, from flat vectors.

    Attributes
    ----------
    likelihood : FingerLikelihood
        Touches.
    sigma_nodes : (s,) array
        σ at which `spectra` were solved.
    spectra : (s, n, n_modes) array
        Pressure spectra over the κ of the touches that are not knife edges.
    template : ContactSpectra
        Knots and modes.
    cosine, sine : (t, n_modes) arrays
        Of k θ_c.
    """

    likelihood: FingerLikelihood
    sigma_nodes: FloatArray
    spectra: FloatArray
    template: ContactSpectra
    cosine: FloatArray
    sine: FloatArray

    @classmethod
    def of(cls, fit: FingerFit) -> TouchSeries:
        """Solve the contacts that the posterior about a fit needs."""
        likelihood, laplace = fit.likelihood, fit.laplace
        finger, known, at = likelihood.finger, likelihood.known, likelihood.layout
        sigma, log_mu = laplace.mode[at.sigma], laplace.mode[at.log_mu]
        reach_sigma, reach_mu = REACH * laplace.sd[at.sigma], REACH * laplace.sd[at.log_mu] + 0.01
        lowest, highest = likelihood.bounds[0][at.sigma], likelihood.bounds[1][at.sigma]
        nodes = np.linspace(max(sigma - reach_sigma, lowest), min(sigma + reach_sigma, highest), SIGMA_NODES)
        blunt = known.radius_mm > 0
        kappa = known.load[blunt] / 1000 * known.radius_mm[blunt] / np.exp(log_mu)
        low, high = (kappa.min() * (1 - STEP_LOAD), kappa.max() * (1 + STEP_LOAD)) if blunt.any() else (0.0, 1.0)
        low, high = low * np.exp(-reach_mu), high * np.exp(reach_mu)
        scale = 0.1 * (finger.outer_radius_mm - finger.core_radius_mm) ** 2
        knots = int(np.ceil((np.log1p(high / scale) - np.log1p(low / scale)) / KAPPA_STEP)) + 1
        deepest = laplace.mode[at.depth] + REACH * laplace.sd[at.depth]
        solved = [
            ContactSpectra.of(
                (finger.core_radius_mm, finger.outer_radius_mm),
                float(node),
                smallest_kappa=low,
                largest_kappa=high,
                largest_sensing_radius_mm=min(float(deepest.max()), float(likelihood.bounds[1][at.depth].max())),
                contact=likelihood.contact,
                knots=max(knots, LEAST_KNOTS) if blunt.any() else 4,
            )
            for node in nodes
        ]
        phase = np.outer(known.angle, solved[0].body.modes)
        spectra = np.stack([one.spectra for one in solved])
        return cls(likelihood, nodes, spectra, solved[0], np.cos(phase), np.sin(phase))

    def covers(self, vectors: FloatArray) -> NDArray[np.bool_]:
        """Whether σ lies where the contact was solved, for vectors (n, d)."""
        sigma = vectors[:, self.likelihood.layout.sigma]
        return np.asarray((self.sigma_nodes[0] <= sigma) & (sigma <= self.sigma_nodes[-1]))

    def __call__(self, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Expected readings (n, t, m) at the measured loads, and their derivative with respect to the load."""
        likelihood, known, at = self.likelihood, self.likelihood.known, self.likelihood.layout
        sigma, mu = vectors[:, at.sigma], np.exp(vectors[:, at.log_mu])
        modes = self.template.body.modes
        body = solve_annulus(
            modes,
            core_radius_mm=likelihood.finger.core_radius_mm,
            outer_radius_mm=likelihood.finger.outer_radius_mm,
            poisson_ratio=sigma[:, None],
        )
        weight = np.where(modes == 0, 1.0, 2.0) * body.radial_strain(vectors[:, at.depth])
        # The response is that to a knife edge right above the element.
        response = likelihood.sign * np.exp(vectors[:, at.response])
        weight *= (response / weight.sum(axis=2))[:, :, None]
        phase = vectors[:, at.angle, None] * modes
        even, odd = ((weight * of).swapaxes(1, 2) for of in (np.cos(phase), np.sin(phase)))
        blunt = known.radius_mm > 0
        spectra = np.tensordot(_lagrange(self.sigma_nodes, sigma), self.spectra, axes=1)
        kappa = known.load[blunt] / 1000 * known.radius_mm[blunt] / mu[:, None]
        cosine, sine = self.cosine[blunt], self.sine[blunt]
        shape = self.cosine @ even + self.sine @ odd

        def predict(share: float) -> FloatArray:
            pressure = self._pressure(spectra, share * kappa)
            shape[:, blunt] = (pressure * cosine) @ even + (pressure * sine) @ odd
            return np.asarray((share * known.load)[:, None] * shape)

        return prediction_and_slope(predict, known)

    def _pressure(self, spectra: FloatArray, kappa: FloatArray) -> FloatArray:
        """Spectra (n, t, n_modes) at κ (n, t), by cubics through four of the knots of `spectra` (n, knots, n_modes)."""
        coordinates = self.template.coordinates
        step = coordinates[1] - coordinates[0]
        place = (np.log1p(kappa / self.template.kappa_scale) - coordinates[0]) / step
        first = np.clip(np.floor(place).astype(np.int64) - 1, 0, len(coordinates) - 4)
        # touches beyond the knots are read at their end
        t = np.clip(place - first, 0.0, 3.0)
        weights = (
            -(t - 1) * (t - 2) * (t - 3) / 6,
            t * (t - 2) * (t - 3) / 2,
            -t * (t - 1) * (t - 3) / 2,
            t * (t - 1) * (t - 2) / 6,
        )
        row = np.arange(len(spectra))[:, None]
        return np.asarray(sum(w[..., None] * spectra[row, first + i] for i, w in enumerate(weights)))


def _lagrange(nodes: FloatArray, places: FloatArray) -> FloatArray:
    """Weights (n, s) of polynomial interpolation through `nodes` (s,) at `places` (n,)."""
    difference = places[:, None] - nodes
    weights = [
        np.prod(np.delete(difference, i, axis=1) / np.delete(nodes[i] - nodes, i), axis=1) for i in range(len(nodes))
    ]
    return np.stack(weights, axis=1)
