"""Random streams, one for each block."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bayestouch.array_types import FloatArray


class BlockStreams:
    """Random numbers for many blocks at once; each block has its own stream.

    The numbers of a block depend only on the seed, the identifier of the block and the purpose. They do not depend on
    the other blocks, or on the distribution of blocks over processes.

    Parameters
    ----------
    seed : int
        Seed of the run, not negative.
    blocks : iterable of int
        Identifiers of the blocks, not negative.
    purpose : int
        Number that separates the streams of a block in different rounds and methods.
    """

    def __init__(self, seed: int, blocks: Iterable[int], purpose: int = 0) -> None:
        self._generators = [
            np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(purpose, int(block)))))
            for block in blocks
        ]

    def select(self, part: slice) -> BlockStreams:
        """Return the streams of the selected blocks (the same streams, not copies)."""
        some = BlockStreams(0, ())
        some._generators = self._generators[part]
        return some

    def __len__(self) -> int:
        return len(self._generators)

    def normal(self, *shape: int) -> FloatArray:
        """Return standard normal numbers, (blocks, *shape)."""
        out = np.empty((len(self), *shape))
        for generator, row in zip(self._generators, out, strict=True):
            generator.standard_normal(out=row)
        return out

    def gamma(self, alpha: float, *shape: int) -> FloatArray:
        """Return standard gamma numbers of shape parameter `alpha`, (blocks, *shape)."""
        out = np.empty((len(self), *shape))
        for generator, row in zip(self._generators, out, strict=True):
            generator.standard_gamma(alpha, out=row)
        return out

    def exponential(self, *shape: int) -> FloatArray:
        """Return standard exponential numbers, (blocks, *shape)."""
        out = np.empty((len(self), *shape))
        for generator, row in zip(self._generators, out, strict=True):
            generator.standard_exponential(out=row)
        return out

    def uniform(self, *shape: int) -> FloatArray:
        """Return uniform numbers in [0, 1), (blocks, *shape)."""
        out = np.empty((len(self), *shape))
        for generator, row in zip(self._generators, out, strict=True):
            generator.random(out=row)
        return out
