"""One random stream for each block."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bayestouch.array_types import FloatArray


class BlockStreams:
    """Random numbers for many blocks at once, each block from a stream of its own.

    A block's numbers depend on the seed, the block's identifier and the purpose alone: not on which blocks are
    sampled beside it, nor on how they are shared out among processes.

    Parameters
    ----------
    seed : int
        Seed of the run, not negative.
    blocks : iterable of int
        Identifiers of the blocks, not negative.
    purpose : int
        Keeps what one block needs at different times (rounds, methods) apart.
    """

    def __init__(self, seed: int, blocks: Iterable[int], purpose: int = 0) -> None:
        self._generators = [
            np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(purpose, int(block)))))
            for block in blocks
        ]

    def select(self, part: slice) -> BlockStreams:
        """The streams of some of the blocks: the same streams, not copies."""
        some = BlockStreams(0, ())
        some._generators = self._generators[part]
        return some

    def __len__(self) -> int:
        return len(self._generators)

    def normal(self, *shape: int) -> FloatArray:
        """Standard normal numbers, (blocks, *shape)."""
        out = np.empty((len(self), *shape))
        for generator, row in zip(self._generators, out, strict=True):
            generator.standard_normal(out=row)
        return out

    def gamma(self, alpha: float, *shape: int) -> FloatArray:
        """Standard gamma numbers of shape parameter `alpha`, (blocks, *shape)."""
        out = np.empty((len(self), *shape))
        for generator, row in zip(self._generators, out, strict=True):
            generator.standard_gamma(alpha, out=row)
        return out

    def exponential(self, *shape: int) -> FloatArray:
        """Standard exponential numbers, (blocks, *shape)."""
        out = np.empty((len(self), *shape))
        for generator, row in zip(self._generators, out, strict=True):
            generator.standard_exponential(out=row)
        return out

    def uniform(self, *shape: int) -> FloatArray:
        """Uniform numbers in [0, 1), (blocks, *shape)."""
        out = np.empty((len(self), *shape))
        for generator, row in zip(self._generators, out, strict=True):
            generator.random(out=row)
        return out
