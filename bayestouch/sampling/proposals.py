"""Proposal distributions, one for each of many blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammaln

from bayestouch.array_types import FloatArray
from bayestouch.sampling.streams import BlockStreams

# One of so many coordinates is drawn anew by `renewed`.
RENEWED_PART = 3


class BlockProposal(Protocol):
    """Protocol of an independence proposal for each of B blocks of dimension d."""

    @property
    def n_blocks(self) -> int:
        """Number of blocks B."""
        ...

    @property
    def dimension(self) -> int:
        """Dimension d."""
        ...

    def draw(self, streams: BlockStreams, n: int) -> tuple[FloatArray, FloatArray]:
        """Return n random points per block, (B, n, d), and their log density, (B, n)."""
        ...

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the normalised log density, (B, n, d) -> (B, n)."""
        ...

    def select(self, blocks: ArrayLike) -> BlockProposal:
        """Return the proposal of the selected blocks, by index or mask."""
        ...


class RenewableProposal(BlockProposal, Protocol):
    """Protocol of a proposal of which a part of the coordinates can be drawn anew, given the others."""

    def renewed(self, streams: BlockStreams, x: FloatArray) -> FloatArray:
        """Return points (B, n, d) that differ from `x` (B, n, d) in a random part of their coordinates.

        If `x` are points of the proposal, so are these, and both orders of a pair are equally likely.
        """
        ...

    def refitted(self, x: FloatArray, effective: float) -> RenewableProposal:
        """Return the proposal with the moments of draws (n, d) of one posterior that are worth so many."""
        ...

    def select(self, blocks: ArrayLike) -> RenewableProposal:
        """Return the proposal of the selected blocks, by index or mask."""
        ...


@dataclass(frozen=True, eq=False)
class StudentTProposal:
    """Multivariate Student-t distribution for each block.

    Attributes
    ----------
    centre : (B, d) array
        Centres.
    root : (B, d, d) array
        Lower Cholesky factors of the scale matrices (the covariance is dof / (dof - 2) times the scale matrix).
    dof : float
        Degrees of freedom; heavy tails keep the ratio of posterior to proposal bounded.
    """

    centre: FloatArray
    root: FloatArray
    dof: float = 7.0

    @classmethod
    def from_covariance(cls, centre: ArrayLike, covariance: ArrayLike, dof: float = 7.0) -> StudentTProposal:
        """Return Student-t distributions with a covariance as scale matrix, usually from a Laplace fit.

        Raises
        ------
        numpy.linalg.LinAlgError
            A covariance is not positive definite.
        """
        root = np.linalg.cholesky(np.asarray(covariance, dtype=float))
        return cls(np.asarray(centre, dtype=float), root, dof)

    @property
    def n_blocks(self) -> int:
        """Number of blocks B."""
        return int(self.centre.shape[0])

    @property
    def dimension(self) -> int:
        """Dimension d."""
        return int(self.centre.shape[1])

    def draw(self, streams: BlockStreams, n: int) -> tuple[FloatArray, FloatArray]:
        """Return n random points per block, (B, n, d), and their log density, (B, n)."""
        z = standard_t(streams, self.dimension, n, self.dof)
        return self.place(z), self._log_density_of_squares((z * z).sum(axis=1))

    def place(self, z: FloatArray) -> FloatArray:
        """Return standard vectors shifted and scaled to the distribution, (B, d, n) -> (B, n, d)."""
        # Each coordinate stays contiguous in memory, which a likelihood needs to be fast.
        return np.swapaxes(self.root @ z + self.centre[:, :, None], 1, 2)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the normalised log density, (B, n, d) -> (B, n)."""
        z = self._inverse_root @ (np.swapaxes(x, 1, 2) - self.centre[:, :, None])
        return self._log_density_of_squares((z * z).sum(axis=1))

    def renewed(self, streams: BlockStreams, x: FloatArray) -> FloatArray:
        """Return points with a random third of the standard variables drawn anew, see `RenewableProposal`."""
        d, n = self.dimension, x.shape[1]
        new = -(-d // RENEWED_PART)
        z = self._inverse_root @ (np.swapaxes(x, 1, 2) - self.centre[:, :, None])
        chosen = np.argsort(streams.uniform(d, n), axis=1).argsort(axis=1) < new
        # Given the others, these have a Student-t distribution of more degrees of freedom (Kotz and Nadarajah 2004).
        dof = self.dof + d - new
        kept = np.where(chosen, 0.0, z)
        scale = np.sqrt((self.dof + (kept * kept).sum(axis=1)) / dof)
        return self.place(np.where(chosen, scale[:, None] * standard_t(streams, d, n, dof), z))

    def refitted(self, x: FloatArray, effective: float) -> StudentTProposal:
        """Return the proposal with the moments of draws, see `RenewableProposal`.

        Correlations are estimated from few draws: they are shrunk towards those of this proposal.
        """
        z = (x - self.centre[0]) @ self._inverse_root[0].T
        covariance = np.cov(z.T).reshape(self.dimension, self.dimension)
        sd, kept = np.sqrt(np.diag(covariance)), effective / (effective + self.dimension)
        shrunk = np.where(np.eye(self.dimension, dtype=bool), covariance, kept * covariance)
        # A scale matrix is (dof - 2) / dof times the covariance.
        shrunk = shrunk * (self.dof - 2) / self.dof + 1e-9 * np.diag(sd**2)
        root = self.root[0] @ np.linalg.cholesky(shrunk)
        return StudentTProposal((self.centre[0] + self.root[0] @ z.mean(axis=0))[None], root[None], self.dof)

    def select(self, blocks: ArrayLike) -> StudentTProposal:
        """Return the proposal of the selected blocks, by index or mask."""
        index = np.asarray(blocks)
        return StudentTProposal(self.centre[index], self.root[index], self.dof)

    @cached_property
    def _inverse_root(self) -> FloatArray:
        return np.asarray(np.linalg.inv(self.root), dtype=np.float64)

    @cached_property
    def _log_peak(self) -> FloatArray:
        d, dof = self.dimension, self.dof
        volume = np.log(np.diagonal(self.root, axis1=1, axis2=2)).sum(axis=1)
        return np.asarray(gammaln((dof + d) / 2) - gammaln(dof / 2) - d / 2 * np.log(dof * np.pi) - volume)

    def _log_density_of_squares(self, squares: FloatArray) -> FloatArray:
        return self._log_peak[:, None] - (self.dof + self.dimension) / 2 * np.log1p(squares / self.dof)


@dataclass(frozen=True, eq=False)
class Mixture:
    """Weighted sum of Student-t distributions of the same degrees of freedom, for each block.

    Attributes
    ----------
    components : tuple of StudentTProposal
        The components, each for all B blocks.
    weights : (B, k) array
        Weights of the components; each row adds up to 1.
    """

    components: tuple[StudentTProposal, ...]
    weights: FloatArray

    @property
    def n_blocks(self) -> int:
        """Number of blocks B."""
        return self.components[0].n_blocks

    @property
    def dimension(self) -> int:
        """Dimension d."""
        return self.components[0].dimension

    def draw(self, streams: BlockStreams, n: int) -> tuple[FloatArray, FloatArray]:
        """Return n random points per block, (B, n, d), and their log density, (B, n)."""
        z = standard_t(streams, self.dimension, n, self.components[0].dof)
        bounds = np.cumsum(self.weights, axis=1)[:, :, None]
        choice = (streams.uniform(n)[:, None, :] >= bounds[:, :-1]).sum(axis=1)
        x = self.components[0].place(z)
        for k, component in enumerate(self.components[1:], start=1):
            np.copyto(x, component.place(z), where=(choice == k)[:, :, None])
        return x, self.log_density(x)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the normalised log density, (B, n, d) -> (B, n)."""
        total = np.full(x.shape[:2], -np.inf)
        with np.errstate(divide="ignore"):  # a component of weight zero
            shares = np.log(self.weights)
        for k, component in enumerate(self.components):
            np.logaddexp(total, shares[:, k, None] + component.log_density(x), out=total)
        return total

    def select(self, blocks: ArrayLike) -> Mixture:
        """Return the proposal of the selected blocks, by index or mask."""
        return Mixture(tuple(part.select(blocks) for part in self.components), self.weights[np.asarray(blocks)])

    @classmethod
    def concatenate(cls, mixtures: Sequence[Mixture]) -> Mixture:
        """Return one mixture of all blocks from mixtures with equal numbers of components."""
        components = tuple(
            StudentTProposal(
                np.concatenate([p.centre for p in parts]), np.concatenate([p.root for p in parts]), parts[0].dof
            )
            for parts in zip(*(mixture.components for mixture in mixtures), strict=True)
        )
        return cls(components, np.concatenate([mixture.weights for mixture in mixtures]))


def standard_t(streams: BlockStreams, dimension: int, n: int, dof: float) -> FloatArray:
    """Return standard Student-t random vectors, (B, d, n)."""
    z = streams.normal(dimension, n)
    z *= np.sqrt(dof / 2 / streams.gamma(dof / 2, n))[:, None, :]
    return z
