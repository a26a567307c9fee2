"""Draws of the calibration parameters of a finger with emcee."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.finger.density import FingerDensity
from bayestouch.finger.fit import FingerFit
from bayestouch.progress import Progress
from bayestouch.sampling import BlockDraws, Demands, StudentT, sample_blocks
from bayestouch.sampling.diagnostics import bulk_statistics
from bayestouch.sampling.laplace import solve_lower

CHAINS = 4
# Degrees of freedom of the Student-t proposal: in about eighty dimensions, heavier tails would have few acceptances.
PROPOSAL_DOF = 300.0
# Steps per draw that is kept, by attempt: 75 % of proposals are accepted on a finger of 16 elements (83 unknowns). With
# few touches the posterior is less normal, fewer are accepted, and the chains must be longer.
THIN = (4, 16, 48)
# Number of points whose matrices are in memory together.
POINTS_HELD = 256


@dataclass(frozen=True, eq=False)
class PosteriorMap:
    """Change of variables in which the posterior of a fit is close to normal.

    A point has standard normal variables u instead of the n coordinates of the chain, then the coordinates of the
    noise, with the normal variable of its quantile for each log discrepancy. For given noise, the coordinates of the
    chain are ``x = x(noise) + R(noise)^-T u``; x(noise) and ``R Rᵀ`` are mode and precision of the least-squares fit
    with the readings weighted by this noise. The proposal is thus wider for an element with larger noise.

    Attributes
    ----------
    fit : FingerFit
        The fit.
    precision, gradient : (m, n, n), (m, n) arrays
        Contributions of the readings of each element at the mode, with the noise of the fit.
    """

    fit: FingerFit
    precision: FloatArray
    gradient: FloatArray

    @classmethod
    def of(cls, fit: FingerFit) -> PosteriorMap:
        """Map for a fit, with the chain linearised at the mode."""
        likelihood, mode = fit.likelihood, fit.laplace.mode
        predicted, slope = likelihood.predicted(mode)
        spread = likelihood.standard_errors(fit.vector)
        rows = likelihood.whiten(likelihood.derivatives(mode), slope, spread)
        left = likelihood.whiten(likelihood.known.readings - predicted, slope, spread)
        return cls(fit, np.einsum("itm,jtm->mij", rows, rows, optimize=True), np.einsum("itm,tm->mi", rows, left))

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Flat vectors (..., d) from points (..., d), and the log of the Jacobian determinant (...)."""
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
        # R⁻ᵀ (u + R⁻¹ pull) is the sum of the random step and the shift of the mode.
        inner = points[:, : at.n_chain] + solve_lower(root, np.asarray((weight - 1) @ self.gradient))
        vectors[:, : at.n_chain] = mode + solve_lower(root, inner, transposed=True)
        return vectors, log_derivative - np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)

    def _variance(self, vectors: FloatArray) -> FloatArray:
        """Variance (n, m) of a mean reading of each element with its typical number of reads."""
        known, at = self.fit.likelihood.known, self.fit.likelihood.layout
        share = np.full(at.n_elements, 1 / known.typical_reads)
        if at.discrepancy:
            share = share + np.exp(2 * vectors[:, at.missed]) / known.typical_reads
        return np.asarray(np.exp(2 * vectors[:, at.noise]) * share)


def sample_fit(
    fit: FingerFit, draws: int, seed: int, progress: Progress | None = None, moves: Any = None
) -> BlockDraws:
    """Draw flat vectors (see `FlatLayout`) from the exact posterior: one block, proposals normal in `PosteriorMap`.

    With `moves` of emcee, see `bayestouch.sampling.sample_blocks`, ensembles of walkers are drawn in the same map. The
    log density of the result is that of the flat vectors.
    """
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
    for attempt, thin in enumerate(THIN if moves is None else (1,)):
        drawn = sample_blocks(
            log_density,
            proposal,
            walkers=CHAINS,
            draws=thin * each,
            seed=seed,
            # One round: in so many dimensions an adapted proposal is not better than the first one.
            rounds=1,
            moves=moves,
            progress=_part(progress, attempt),
        )
        kept, log_derivative = to_vectors(drawn.draws[:, ::thin])
        ess, rhat = bulk_statistics(kept)
        if _good(ess, rhat, draws):
            break
    if progress is not None:
        progress(1.0)
    return replace(
        drawn, draws=kept, log_density=drawn.log_density[:, ::thin] - log_derivative, ess_bulk=ess, rhat=rhat
    )


def _good(ess: FloatArray, rhat: FloatArray, draws: int) -> bool:
    """Whether chains are long enough; the limit of R-hat allows for its scatter with few draws."""
    demands = Demands()
    enough = bool(ess.min() >= min(demands.ess_bulk, 0.4 * draws))
    return enough and bool(rhat.max() <= max(demands.rhat, 1 + 8 * CHAINS / draws))


def _part(progress: Progress | None, attempt: int) -> Progress | None:
    """Progress of one attempt: the first covers one half, each later one a half of the rest."""
    if progress is None:
        return None
    left = 0.5**attempt
    return lambda done: progress(1 - left + 0.5 * left * done)
