"""Draws of a pad's calibration with emcee."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray
from bayestouch.pad.density import PadDensity
from bayestouch.pad.posterior_map import PadPosteriorMap, effective_number
from bayestouch.progress import Progress
from bayestouch.sampling import BlockDraws, StudentTProposal
from bayestouch.sampling.adapt import adapt
from bayestouch.sampling.attempts import draw_until_good
from bayestouch.sampling.proposals import BlockProposal
from bayestouch.sampling.streams import BlockStreams

# Degrees of freedom of the Student-t proposal: in forty dimensions, heavier tails would have few acceptances.
PROPOSAL_DOF = 300.0
# Those of the few shared parameters, whose posterior may have tails that are heavier than normal.
SHARED_DOF = 8.0
# Steps per draw that is kept, by attempt: about half of the proposals are accepted.
THIN = (6, 18)
# Points at which the proposal of the shared parameters is tried, and the share of them that must count.
TRIED, GOOD = 128, 0.2
# Purpose number of the random streams, see `BlockStreams`.
PURPOSE = 12


@dataclass(frozen=True, eq=False)
class SharedThenOwn:
    """Proposal of the shared parameters, which may be of any shape, and of those of elements, normal given these.

    Attributes
    ----------
    shared, own : BlockProposal
        Proposals of the two parts, each independent of the other in the variables of `PadPosteriorMap`.
    """

    shared: BlockProposal
    own: BlockProposal

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return self.own.n_blocks

    @property
    def dimension(self) -> int:
        """Dimension of both parts together."""
        return self.shared.dimension + self.own.dimension

    def draw(self, streams: BlockStreams, n: int) -> tuple[FloatArray, FloatArray]:
        """Random points and their log density, as of `BlockProposal`."""
        (first, log_first), (second, log_second) = self.shared.draw(streams, n), self.own.draw(streams, n)
        return np.concatenate([first, second], axis=2), log_first + log_second

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density, as of `BlockProposal`."""
        k = self.shared.dimension
        return self.shared.log_density(x[..., :k]) + self.own.log_density(x[..., k:])

    def select(self, blocks: ArrayLike) -> SharedThenOwn:
        """Proposal of some of the blocks."""
        return SharedThenOwn(self.shared.select(blocks), self.own.select(blocks))


def sample_density(density: PadDensity, draws: int, seed: int, progress: Progress | None = None) -> BlockDraws:
    """Draw vectors from the exact posterior: one block, proposals in the variables of `PadPosteriorMap`.

    Where the shared parameters are far from normal, as the half-width of a contact near zero is, their proposal is a
    mixture that is fitted to their posterior first. Where the chains are too short they are made longer.
    """
    to_vectors, d = PadPosteriorMap.of(density, seed), len(density.priors)

    def log_density(points: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        vectors, log_derivative = to_vectors(points.reshape(-1, d))
        out = np.full(len(vectors), -np.inf)
        # A point may be so far out that no number is left between its bounds.
        found = np.isfinite(vectors).all(axis=1) & np.isfinite(log_derivative)
        out[found] = density(vectors[found]) + log_derivative[found]
        return out.reshape(points.shape[:-1])

    k = len(to_vectors.shared)
    own = _standard(d - k, PROPOSAL_DOF)
    shared = _for_shared(log_density, k, d, seed) if k else own
    proposal = SharedThenOwn(shared, own) if k else own

    def shaped(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        vectors, log_derivative = to_vectors(points.reshape(-1, d))
        return vectors.reshape(points.shape), log_derivative.reshape(points.shape[:-1])

    return draw_until_good(log_density, proposal, shaped, draws=draws, seed=seed, thins=THIN, progress=progress)


def _standard(dimension: int, dof: float) -> StudentTProposal:
    return StudentTProposal.from_covariance(np.zeros((1, dimension)), np.eye(dimension)[None], dof)


def _for_shared(
    log_density: Callable[[FloatArray, NDArray[np.intp]], FloatArray], k: int, d: int, seed: int
) -> BlockProposal:
    """Proposal of the shared parameters: standard normal where that is good, else a mixture that is fitted.

    Their density is that at the most probable values of the others, which is what it is up to a constant where these
    are normal given the shared ones.
    """

    def of_shared(points: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        return log_density(np.concatenate([points, np.zeros((*points.shape[:-1], d - k))], axis=-1), blocks)

    proposal, numbers = _standard(k, SHARED_DOF), np.zeros(1, dtype=np.intp)
    x, log_q = proposal.draw(BlockStreams(seed, numbers, purpose=PURPOSE), TRIED)
    if effective_number((of_shared(x, numbers) - log_q)[0]) >= GOOD * TRIED:
        return proposal
    return adapt(of_shared, proposal, numbers, seed)
