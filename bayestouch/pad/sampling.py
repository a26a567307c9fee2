"""Posterior draws of the calibration of a pad with emcee."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.output.progress import Progress
from bayestouch.pad.density import PadDensity
from bayestouch.pad.posterior_map import PadPosteriorMap, effective_number
from bayestouch.sampling import BlockDraws, StudentTProposal
from bayestouch.sampling.attempts import draw_until_good
from bayestouch.sampling.density import LogDensity
from bayestouch.sampling.proposals import RenewableProposal
from bayestouch.sampling.shared import SharedThenOwn, fitted_to_shared
from bayestouch.sampling.streams import BlockStreams

# Degrees of freedom of the Student-t proposal: in forty dimensions, heavier tails would have few acceptances.
PROPOSAL_DOF = 300.0
# Degrees of freedom for the few shared parameters, whose posterior may have heavier tails than a normal density.
SHARED_DOF = 8.0
# Steps per draw that is kept, by attempt: about half of the proposals are accepted. The third attempt is for posteriors
# with a heavy tail, as of a half-width that may be near zero: the second one has learnt a proposal for it.
THIN = (6, 18, 36)
# Number of points at which the proposal of the shared parameters is tried, and their smallest effective share.
TRIED, GOOD = 128, 0.2
# Purpose number of the random streams, see `BlockStreams`.
PURPOSE = 12


def sample_density(density: PadDensity, draws: int, seed: int, progress: Progress | None = None) -> BlockDraws:
    """Draws of vectors from the exact posterior, in one block; proposals are in the variables of `PadPosteriorMap`.

    If the posterior of the shared parameters is far from normal (e.g. a half-width of the contact near zero), their
    proposal is a mixture that is first fitted to this posterior. If the chains are too short, longer ones are run.
    """
    to_vectors, d = PadPosteriorMap.of(density, seed), len(density.priors)

    def log_density(points: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        vectors, log_derivative = to_vectors(points.reshape(-1, d))
        out = np.full(len(vectors), -np.inf)
        # NaN: a point so extreme that rounding leaves no number between its bounds.
        found = np.isfinite(vectors).all(axis=1) & np.isfinite(log_derivative)
        out[found] = density(vectors[found]) + log_derivative[found]
        return out.reshape(points.shape[:-1])

    k = len(to_vectors.shared)
    own = _standard(d - k, PROPOSAL_DOF)
    proposal = _with_shared(log_density, _standard(k, SHARED_DOF), own, seed) if k else own

    def shaped(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        vectors, log_derivative = to_vectors(points.reshape(-1, d))
        return vectors.reshape(points.shape), log_derivative.reshape(points.shape[:-1])

    return draw_until_good(log_density, proposal, shaped, draws=draws, seed=seed, thins=THIN, progress=progress)


def _standard(dimension: int, dof: float) -> StudentTProposal:
    return StudentTProposal.from_covariance(np.zeros((1, dimension)), np.eye(dimension)[None], dof)


def _with_shared(
    log_density: LogDensity, shared: StudentTProposal, own: StudentTProposal, seed: int
) -> RenewableProposal:
    """Proposal of all parameters: `shared` for the shared ones if it is good enough, else a fitted mixture."""
    which, numbers = np.arange(shared.dimension), np.zeros(1, dtype=np.intp)
    x, log_q = shared.draw(BlockStreams(seed, numbers, purpose=PURPOSE), TRIED)
    points = np.concatenate([x, np.zeros((*x.shape[:-1], own.dimension))], axis=-1)
    if effective_number((log_density(points, numbers) - log_q)[0]) >= GOOD * TRIED:
        return SharedThenOwn(shared, own, which)
    return fitted_to_shared(log_density, shared, own, which, seed)
