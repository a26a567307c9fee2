"""Draws of a finger's calibration parameters with emcee."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.calibration.finger import FingerFit
from bayestouch.calibration.finger_density import FingerDensity
from bayestouch.progress import Progress
from bayestouch.sampling import BlockDraws, Demands, StudentT, sample_blocks
from bayestouch.sampling.diagnostics import bulk_statistics

FloatArray = NDArray[np.float64]

CHAINS = 4
# Tails a little heavier than normal: in some eighty dimensions much heavier ones would hardly ever be accepted.
PROPOSAL_DOF = 300.0
# Steps for each draw kept: two in three proposals are accepted on a finger of 16 elements, 83 unknowns. Few touches
# leave a posterior further from normal: fewer are accepted, and the chains have to be longer to be good.
THIN = (4, 16, 48)


def sample_fit(fit: FingerFit, draws: int, seed: int, progress: Progress | None = None) -> BlockDraws:
    """Draw flat vectors (see `FlatLayout`) from the exact posterior: one block, the fit's normal as proposal.

    Sampling goes on in coordinates in which that normal is close: log discrepancies are replaced by the normal
    variables of their quantiles, with the derivative in the density.
    """
    density = FingerDensity.of(fit)
    layout, shape, n = fit.likelihood.layout, fit.noise_shape, fit.likelihood.layout.n_chain
    covariance = np.zeros((layout.size, layout.size))
    covariance[:n, :n], covariance[n:, n:] = fit.laplace.covariance, shape.covariance

    def flat(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Flat vectors from points, and the log of the derivative."""
        if shape.quantiles is None:
            return points, np.zeros(points.shape[:-1])
        vectors = points.copy()
        vectors[..., layout.missed], log_slope = shape.quantiles(points[..., layout.missed])
        return vectors, log_slope

    centre = np.concatenate([fit.laplace.mode, shape.centre])

    def log_density(points: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        vectors, log_slope = flat(points)
        return density(vectors) + log_slope

    proposal = StudentT.from_covariance(centre[None], covariance[None], PROPOSAL_DOF)
    demands = Demands()
    for attempt, thin in enumerate(THIN):
        drawn = sample_blocks(
            log_density,
            proposal,
            walkers=CHAINS,
            draws=thin * -(-draws // CHAINS),
            seed=seed,
            # One round: the first shape is as good as it gets in so many dimensions, and the grade says how good.
            rounds=1,
            progress=_part(progress, attempt),
        )
        kept, _ = flat(drawn.draws[:, ::thin])
        ess, rhat = bulk_statistics(kept)
        if ess.min() >= min(demands.ess_bulk, 0.4 * draws) and rhat.max() <= demands.rhat:
            break
    if progress is not None:
        progress(1.0)
    return replace(drawn, draws=kept, log_density=drawn.log_density[:, ::thin], ess_bulk=ess, rhat=rhat)


def _part(progress: Progress | None, attempt: int) -> Progress | None:
    """Progress of one attempt: the first fills one half, the next a half of what is left."""
    if progress is None:
        return None
    left = 0.5**attempt
    return lambda done: progress(1 - left + 0.5 * left * done)
