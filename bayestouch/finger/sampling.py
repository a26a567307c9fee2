"""Draws of a finger's calibration parameters with emcee."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.finger.density import FingerDensity
from bayestouch.finger.fit import FingerFit
from bayestouch.progress import Progress
from bayestouch.sampling import BlockDraws, StudentT, sample_blocks
from bayestouch.sampling.attempts import CHAINS, long_enough, part_of
from bayestouch.sampling.diagnostics import bulk_statistics
from bayestouch.sampling.laplace import solve_lower

# Tails a little heavier than normal: in some eighty dimensions much heavier ones would hardly ever be accepted.
PROPOSAL_DOF = 300.0
# Steps for each draw kept: three in four proposals are accepted on a finger of 16 elements, 83 unknowns. Few touches
# leave a posterior further from normal: fewer are accepted, and the chains have to be longer to be good.
THIN = (4, 16, 48)
# Matrices of so many points are held together.
POINTS_HELD = 256


@dataclass(frozen=True, eq=False)
class PosteriorMap:
    """Change of variables in which the posterior of a fit is close to normal.

    A point holds standard normal variables u in place of the chain's n coordinates, and then the noise: its own
    coordinates, with the normal variable of its quantile for each log discrepancy. Given the noise, the chain's
    coordinates are ``x = x(noise) + R(noise)^-T u``: the mode and the precision ``R Rᵀ`` of the least-squares problem
    in which every element's readings weigh as that noise has it. So an element that may be noisier than thought is
    given so much more room.

    Attributes
    ----------
    fit : FingerFit
        The fit.
    precision, gradient : (m, n, n), (m, n) arrays
        What each element's readings contribute at the mode, with the noise of the fit.
    """

    fit: FingerFit
    precision: FloatArray
    gradient: FloatArray

    @classmethod
    def of(cls, fit: FingerFit) -> PosteriorMap:
        """Linearise the chain at the mode."""
        likelihood, mode = fit.likelihood, fit.laplace.mode
        predicted, slope = likelihood.predicted(mode)
        spread = likelihood.standard_errors(fit.vector)
        rows = likelihood.whiten(likelihood.derivatives(mode), slope, spread)
        left = likelihood.whiten(likelihood.known.readings - predicted, slope, spread)
        return cls(fit, np.einsum("itm,jtm->mij", rows, rows, optimize=True), np.einsum("itm,tm->mi", rows, left))

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Flat vectors (..., d) from points (..., d), and the log of the derivative (...)."""
        flat = points.reshape(-1, points.shape[-1])
        parts = [self._map(flat[first : first + POINTS_HELD]) for first in range(0, len(flat), POINTS_HELD)]
        vectors, log_derivative = (np.concatenate(each) for each in zip(*parts, strict=True))
        return vectors.reshape(points.shape), log_derivative.reshape(points.shape[:-1])

    def _map(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        at, mode, quantiles = self.fit.likelihood.layout, self.fit.laplace.mode, self.fit.noise_shape.quantiles
        vectors, log_derivative = points.copy(), np.zeros(len(points))
        if quantiles is not None:
            vectors[:, at.missed], log_derivative = quantiles(points[:, at.missed])
        weight = self._variance(self.fit.vector[None]) / self._variance(vectors)
        precision = np.tensordot(weight, self.precision, axes=1)
        index = np.arange(at.n_chain)
        precision[:, index, index] += self.fit.likelihood.prior.spread[: at.n_chain] ** -2.0
        root = np.asarray(np.linalg.cholesky(precision), dtype=np.float64)
        # R⁻ᵀ (u + R⁻¹ pull) is the standard step and the mode's own
        inner = points[:, : at.n_chain] + solve_lower(root, np.asarray((weight - 1) @ self.gradient))
        vectors[:, : at.n_chain] = mode + solve_lower(root, inner, transposed=True)
        return vectors, log_derivative - np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)

    def _variance(self, vectors: FloatArray) -> FloatArray:
        """Variance (n, m) of an element's mean reading, of its usual number of reads."""
        known, at = self.fit.likelihood.known, self.fit.likelihood.layout
        share = np.full(at.n_elements, 1 / known.typical_reads)
        if at.discrepancy:
            share = share + np.exp(2 * vectors[:, at.missed]) / known.typical_reads
        return np.asarray(np.exp(2 * vectors[:, at.noise]) * share)


def sample_fit(fit: FingerFit, draws: int, seed: int, progress: Progress | None = None) -> BlockDraws:
    """Draw flat vectors (see `FlatLayout`) from the exact posterior: one block, proposals normal in `PosteriorMap`."""
    density, to_vectors = FingerDensity.of(fit), PosteriorMap.of(fit)
    layout, shape, n = fit.likelihood.layout, fit.noise_shape, fit.likelihood.layout.n_chain
    centre = np.concatenate([np.zeros(n), shape.centre])
    covariance = np.eye(layout.size)
    covariance[n:, n:] = shape.covariance

    def log_density(points: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        vectors, log_derivative = to_vectors(points)
        return density(vectors) + log_derivative

    proposal = StudentT.from_covariance(centre[None], covariance[None], PROPOSAL_DOF)
    each = -(-draws // CHAINS)
    for attempt, thin in enumerate(THIN):
        drawn = sample_blocks(
            log_density,
            proposal,
            walkers=CHAINS,
            draws=thin * each,
            seed=seed,
            # One round: the first shape is as good as it gets in so many dimensions, and the grade says how good.
            rounds=1,
            progress=part_of(progress, attempt),
        )
        kept, _ = to_vectors(drawn.draws[:, ::thin])
        ess, rhat = bulk_statistics(kept)
        if long_enough(ess, rhat, draws):
            break
    if progress is not None:
        progress(1.0)
    return replace(drawn, draws=kept, log_density=drawn.log_density[:, ::thin], ess_bulk=ess, rhat=rhat)
