"""Draws of a pad's calibration with emcee."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.pad.density import PadDensity
from bayestouch.pad.posterior_map import PadPosteriorMap
from bayestouch.progress import Progress
from bayestouch.sampling import BlockDraws, StudentT, sample_blocks
from bayestouch.sampling.attempts import CHAINS, long_enough, part_of
from bayestouch.sampling.diagnostics import bulk_statistics

# Tails a little heavier than normal: in some forty dimensions much heavier ones would hardly ever be accepted.
PROPOSAL_DOF = 300.0
# Steps for each draw kept, one attempt after the other: most proposals are accepted where touches are many.
THIN = (4, 16, 48)


def sample_density(density: PadDensity, draws: int, seed: int, progress: Progress | None = None) -> BlockDraws:
    """Draw vectors from the exact posterior: one block, proposals from a normal approximation (`PadPosteriorMap`).

    Where the chains are too short they are made longer, with proposals of the mean and covariance of the last ones.
    The log density of the result is that of the vectors.
    """
    to_vectors, d = PadPosteriorMap.of(density, seed), len(density.priors)

    def log_density(points: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        vectors, log_derivative = to_vectors(points.reshape(-1, d))
        out = np.full(len(vectors), -np.inf)
        # A point may be so far out that no number is left between its bounds.
        found = np.isfinite(vectors).all(axis=1) & np.isfinite(log_derivative)
        out[found] = density(vectors[found]) + log_derivative[found]
        return out.reshape(points.shape[:-1])

    centre, covariance = np.zeros(d), np.eye(d)
    each = -(-draws // CHAINS)
    for attempt, thin in enumerate(THIN):
        drawn = sample_blocks(
            log_density,
            StudentT.from_covariance(centre[None], covariance[None], PROPOSAL_DOF),
            walkers=CHAINS,
            draws=thin * each,
            seed=seed,
            rounds=1,
            progress=part_of(progress, attempt),
        )
        points = drawn.draws[:, ::thin, 0]
        vectors, log_derivative = to_vectors(points.reshape(-1, d))
        kept = vectors.reshape(points.shape)
        ess, rhat = bulk_statistics(kept[:, :, None])
        if long_enough(ess, rhat, draws):
            break
    if progress is not None:
        progress(1.0)
    log = drawn.log_density[:, ::thin] - log_derivative.reshape(*points.shape[:2], 1)
    return replace(drawn, draws=kept[:, :, None], log_density=log, ess_bulk=ess, rhat=rhat)
