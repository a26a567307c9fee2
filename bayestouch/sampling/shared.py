"""Proposals of a few coordinates of any shape, and of all others that are normal given these."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.sampling.adapt import adapt
from bayestouch.sampling.density import LogDensity
from bayestouch.sampling.proposals import BlockProposal, RenewableProposal, StudentTProposal
from bayestouch.sampling.streams import BlockStreams


@dataclass(frozen=True, eq=False)
class SharedThenOwn:
    """Proposal of the shared coordinates, which may be of any shape, and of the others, independent of these.

    Attributes
    ----------
    shared, own : BlockProposal, RenewableProposal
        Proposals of the two parts.
    which : (k,) int array
        Positions of the shared coordinates in a point.
    """

    shared: BlockProposal
    own: RenewableProposal
    which: IndexArray

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
        return self._joined(first, second), log_first + log_second

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density, as of `BlockProposal`."""
        first, second = self._parts(x)
        return self.shared.log_density(first) + self.own.log_density(second)

    def renewed(self, streams: BlockStreams, x: FloatArray) -> FloatArray:
        """Points with either all shared coordinates or a part of the others drawn anew, see `RenewableProposal`."""
        first, second = self._parts(x)
        new, _ = self.shared.draw(streams, x.shape[1])
        turn = (streams.uniform(x.shape[1]) < 0.5)[..., None]
        return self._joined(np.where(turn, new, first), np.where(turn, second, self.own.renewed(streams, second)))

    def refitted(self, x: FloatArray, effective: float) -> SharedThenOwn:
        """Proposal with the moments of draws for the coordinates that are not shared, see `RenewableProposal`."""
        return SharedThenOwn(self.shared, self.own.refitted(self._parts(x)[1], effective), self.which)

    def select(self, blocks: ArrayLike) -> SharedThenOwn:
        """Proposal of some of the blocks."""
        return SharedThenOwn(self.shared.select(blocks), self.own.select(blocks), self.which)

    def _parts(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        return x[..., self.which], np.delete(x, self.which, axis=-1)

    def _joined(self, first: FloatArray, second: FloatArray) -> FloatArray:
        # As of other proposals, each coordinate is contiguous in memory.
        out = np.swapaxes(np.empty((len(first), self.dimension, first.shape[1])), 1, 2)
        out[..., self.which] = first
        out[..., np.delete(np.arange(self.dimension), self.which)] = second
        return out


def fitted_to_shared(
    log_density: LogDensity, shared: StudentTProposal, own: StudentTProposal, which: IndexArray, seed: int
) -> SharedThenOwn:
    """Return the proposal with a mixture for the shared coordinates, which is fitted to their density.

    Their density is that at the most probable values of the others, which is what it is up to a constant where these
    are normal given the shared ones.

    Parameters
    ----------
    log_density : callable
        Of points of all coordinates, see `LogDensity`.
    shared, own : StudentTProposal
        Proposals of the two parts; the mixture begins with `shared`.
    which : (k,) int array
        Positions of the shared coordinates.
    seed : int
        Seed of the random numbers.
    """
    rest = np.delete(np.arange(shared.dimension + own.dimension), which)

    def of_shared(points: FloatArray, blocks: NDArray[np.intp]) -> FloatArray:
        whole = np.empty((*points.shape[:-1], len(which) + len(rest)))
        whole[..., which], whole[..., rest] = points, own.centre[:, None]
        return log_density(whole, blocks)

    return SharedThenOwn(adapt(of_shared, shared, np.zeros(1, dtype=np.intp), seed), own, which)
