"""Evenly spread points of a proposal, for integrals over it: a lattice instead of random numbers."""

from __future__ import annotations

import numpy as np
from scipy.special import gammaincinv, ndtri

from bayestouch.array_types import FloatArray
from bayestouch.sampling import BlockStreams

# Generator of the lattice: powers of the inverse of the root of x^(d + 1) = x + 1, for d = 4 dimensions.
_GENERATOR = 1.1673039782614187 ** -np.arange(1.0, 5.0)


class EvenPoints(BlockStreams):
    """Numbers of a lattice, the same for every block, instead of the random numbers of a proposal.

    The error of the mean of a smooth function over n points is about 1/n of its sd, instead of 1/√n. Each series of n
    numbers uses the next dimension of the lattice; there are four.
    """

    def __init__(self, n_blocks: int) -> None:
        super().__init__(0, ())
        self._n_blocks, self._used = n_blocks, 0

    def __len__(self) -> int:
        return self._n_blocks

    def uniform(self, *shape: int) -> FloatArray:
        """Numbers in (0, 1), (blocks, *shape); the last axis counts points.

        Raises
        ------
        ValueError
            If more dimensions are used than the lattice has.
        """
        *dimensions, n = shape
        count = int(np.prod(dimensions, dtype=int))
        generator = _GENERATOR[self._used : self._used + count, None]
        if len(generator) < count:
            raise ValueError(f"the lattice has {len(_GENERATOR)} dimensions")
        self._used += count
        points = (0.5 + generator * np.arange(1, n + 1)) % 1.0
        return np.broadcast_to(points.reshape(shape), (self._n_blocks, *shape)).copy()

    def normal(self, *shape: int) -> FloatArray:
        """Standard normal numbers, (blocks, *shape)."""
        return np.asarray(ndtri(self.uniform(*shape)))

    def gamma(self, alpha: float, *shape: int) -> FloatArray:
        """Standard gamma numbers, (blocks, *shape)."""
        return np.asarray(gammaincinv(alpha, self.uniform(*shape)))

    def exponential(self, *shape: int) -> FloatArray:
        """Standard exponential numbers, (blocks, *shape)."""
        return np.asarray(-np.log1p(-self.uniform(*shape)))
