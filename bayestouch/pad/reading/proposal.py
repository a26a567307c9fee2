"""Mixtures of Student-t distributions for many touches at once: density, draws, number of separate locations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.pad.reading.components import Components
from bayestouch.sampling import BlockStreams
from bayestouch.sampling.proposals import standard_t

# (dof + d)/2 of the parts is 2 to this power, so that powers are computed by squaring; 2³ = 8 gives 13 or 14 degrees of
# freedom.
_SQUARINGS = 3
_POWER = 2**_SQUARINGS

# The parts are wider than the components of the posterior by this factor, so that the proposal covers it.
_WIDER = 1.05

# A part that is broader than all others together covers what they leave out: its share, and its relative width.
_BROAD_SHARE, _BROADER = 0.1, 1.5

# Largest number of parts of one touch; more are merged with their neighbours on the lattice.
_MOST_PARTS = 96

# Two locations are separate if the density between them is below the share _SADDLE of the lower peak. A location counts
# if it has at least the share _LEAST_MASS of the probability.
_SADDLE, _LEAST_MASS = 0.5, 0.05

# Nodes with less than this share of the largest weight are neglected.
_FAINT = 1e-3

# A part reaches the region if its centre is nearer to it than so many of its standard deviations.
_REACH = 3.0


@dataclass(frozen=True, eq=False)
class ManyParts:
    """A mixture of Student-t distributions for each of B touches, with up to K parts; an independence proposal.

    Attributes
    ----------
    weight : (B, K) array
        Weights with sum 1; 0 for parts that are not used.
    mean : (B, K, d) array
        Centres of the parts.
    root : (B, K, d, d) array
        Lower Cholesky factors of the scale matrices of the parts.
    """

    weight: FloatArray
    mean: FloatArray
    root: FloatArray

    @property
    def n_blocks(self) -> int:
        """Number of touches B."""
        return len(self.weight)

    @property
    def dimension(self) -> int:
        """Number of coordinates d."""
        return int(self.mean.shape[-1])

    def draw(self, streams: BlockStreams, n: int) -> tuple[FloatArray, FloatArray]:
        """n draws per touch, (B, n, d), and their log density, (B, n)."""
        z = standard_t(streams, self.dimension, n, 2.0 * _POWER - self.dimension)
        share = np.cumsum(self.weight, axis=1)
        choice = np.stack([np.searchsorted(row, u * row[-1]) for row, u in zip(share, streams.uniform(n), strict=True)])
        choice = np.minimum(choice, (self.weight > 0).sum(axis=1)[:, None] - 1)
        block = np.arange(self.n_blocks)[:, None]
        x = self.mean[block, choice]
        for i in range(self.dimension):
            for j in range(i + 1):
                x[..., i] += self.root[:, :, i, j][block, choice] * z[:, j]
        return x, self.log_density(x)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Normalised log density (B, n) of points (B, n, d)."""
        dof = 2.0 * _POWER - self.dimension
        points = np.ascontiguousarray(np.swapaxes(x, 1, 2))
        total = np.zeros(x.shape[:2])
        for k in range(self.weight.shape[1]):
            z = self._inverse[:, k] @ (points - self.mean[:, k, :, None])
            bell = 1 + np.einsum("bdn,bdn->bn", z, z) / dof
            for _ in range(_SQUARINGS):
                bell *= bell
            total += self._height[:, k, None] / bell
        return np.asarray(np.log(total))

    def select(self, blocks: ArrayLike) -> ManyParts:
        """Mixtures of some of the touches, by index or mask."""
        index = np.asarray(blocks)
        parts = max(int((self.weight[index] > 0).sum(axis=1).max(initial=1)), 1)
        return ManyParts(self.weight[index, :parts], self.mean[index, :parts], self.root[index, :parts])

    def without_last(self) -> ManyParts:
        """Marginal mixtures of the first d - 1 coordinates."""
        return ManyParts(self.weight, self.mean[..., :-1], self.root[..., :-1, :-1])

    @cached_property
    def _inverse(self) -> FloatArray:
        return np.asarray(np.linalg.inv(self.root))

    @cached_property
    def _height(self) -> FloatArray:
        from scipy.special import gammaln

        d, dof = self.dimension, 2.0 * _POWER - self.dimension
        volume = np.log(np.diagonal(self.root, axis1=2, axis2=3)).sum(axis=2)
        peak = gammaln(_POWER) - gammaln(dof / 2) - d / 2 * np.log(dof * np.pi)
        return np.asarray(self.weight * np.exp(peak - volume))


@dataclass(frozen=True, eq=False)
class WithLogLoad:
    """A mixture of location and logarithm of the load, as a proposal of location and load.

    The noise is often in proportion to the load, so that the posterior of its logarithm is nearer to a normal one.

    Attributes
    ----------
    parts : ManyParts
        The mixture; its last coordinate is the logarithm of the load.
    """

    parts: ManyParts

    @property
    def n_blocks(self) -> int:
        """Number of touches B."""
        return self.parts.n_blocks

    @property
    def dimension(self) -> int:
        """Number of coordinates d."""
        return self.parts.dimension

    @classmethod
    def of(cls, parts: ManyParts) -> WithLogLoad:
        """From a mixture of location and load, whose parts have the same locations and relative spreads of the load.

        A normal distribution that is cut at zero below its mean, or near it, has its largest density of the logarithm
        at about one sd.
        """
        mean, root = parts.mean.copy(), parts.root.copy()
        load = np.maximum(mean[..., -1], np.sqrt((root[..., -1, :] ** 2).sum(axis=-1)))
        root[..., -1, :] /= load[..., None]
        mean[..., -1] = np.log(load)
        return cls(ManyParts(parts.weight, mean, root))

    def draw(self, streams: BlockStreams, n: int) -> tuple[FloatArray, FloatArray]:
        """n draws per touch, (B, n, d), and their log density, (B, n)."""
        x, log_density = self.parts.draw(streams, n)
        log_density -= x[..., -1]
        np.exp(x[..., -1], out=x[..., -1])
        return x, log_density

    def log_density(self, x: FloatArray) -> FloatArray:
        """Normalised log density (B, n) of points (B, n, d); minus infinity without a load."""
        pressed = x[..., -1] > 0
        log_load = np.log(np.where(pressed, x[..., -1], 1.0))
        points = np.concatenate([x[..., :-1], log_load[..., None]], axis=-1)
        return np.where(pressed, self.parts.log_density(points) - log_load, -np.inf)

    def select(self, blocks: ArrayLike) -> WithLogLoad:
        """Mixtures of some of the touches, by index or mask."""
        return WithLogLoad(self.parts.select(blocks))

    def without_last(self) -> ManyParts:
        """Marginal mixtures of the location."""
        return self.parts.without_last()

    def reaching(self, low: FloatArray, high: FloatArray) -> WithLogLoad:
        """The same parts; those of a touch whose parts all lie beyond the region move to the nearest location in it.

        Readings that contradict the load, and touches beyond the region, pull the parts out of it. Then no draw would
        be a possible location.

        Parameters
        ----------
        low, high : (D,) arrays
            Ends of the locations that are possible, mm.
        """
        weight, mean, root = self.parts.weight, self.parts.mean, self.parts.root
        inside = np.concatenate([np.clip(mean[..., :-1], low, high), mean[..., -1:]], axis=-1)
        sd = np.sqrt((root**2).sum(axis=-1))
        near = (np.abs(mean - inside) <= _REACH * sd).all(axis=-1) & (weight > 0)
        mean = np.where(near.any(axis=1)[:, None, None], mean, inside)
        return WithLogLoad(ManyParts(weight, mean, root))

    def weighed_by(
        self, log_density: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray
    ) -> WithLogLoad:
        """The same parts with weights by the density, and a broad part.

        The weight of a part was that of a normal density, as the posterior is if the readings are linear in the
        location and the load. It is multiplied by the ratio of the density to the mixture at the centre of the part, or
        at the location nearest to it within `low` and `high` (D,).

        Parameters
        ----------
        log_density : callable
            Log density (B, n) of points (B, n, d), up to a constant for each touch.
        low, high : (D,) arrays
            Ends of the locations that are possible, mm.
        """
        weight, mean, root = self.parts.weight, self.parts.mean, self.parts.root
        centre = np.concatenate([np.clip(mean[..., :-1], low, high), np.exp(mean[..., -1:])], axis=-1)
        ratio = np.where(weight > 0, log_density(centre) - self.log_density(centre), -np.inf)
        weight = weight * np.exp(ratio - ratio.max(axis=1, keepdims=True))
        weight /= weight.sum(axis=1, keepdims=True)
        middle = np.einsum("bk,bkd->bd", weight, mean)
        off = mean - middle[:, None]
        spread = root @ root.transpose(0, 1, 3, 2) + off[..., :, None] * off[..., None, :]
        broad = _BROADER * np.linalg.cholesky(np.einsum("bk,bkij->bij", weight, spread))
        weight = np.concatenate([(1 - _BROAD_SHARE) * weight, np.full((len(weight), 1), _BROAD_SHARE)], axis=1)
        mean, root = np.concatenate([mean, middle[:, None]], axis=1), np.concatenate([root, broad[:, None]], axis=1)
        order = np.argsort(-weight, axis=1)
        rows = np.arange(len(order))[:, None]
        return WithLogLoad(ManyParts(weight[rows, order], mean[rows, order], root[rows, order]))


def many_parts(components: Components, n_touches: int) -> ManyParts:
    """Proposal from the components of the posteriors; the parts of a touch are in order of weight.

    If a touch has more than `_MOST_PARTS` components, neighbours on the lattice are merged in pairs along each
    coordinate; the new part has the mean and the covariance of the merged components. The location of such a touch is
    hardly determined.
    """
    bounds = np.searchsorted(components.touch, np.arange(n_touches + 1))
    parts = [_merged(components, slice(a, b)) for a, b in pairwise(bounds)]
    most, d = max(len(weight) for weight, _, _ in parts), components.mean.shape[1]
    weight = np.zeros((n_touches, most))
    mean = np.zeros((n_touches, most, d))
    covariance = np.broadcast_to(np.eye(d), (n_touches, most, d, d)).copy()
    for t, (share, centre, spread) in enumerate(parts):
        order = np.argsort(-share)
        weight[t, : len(share)] = share[order]
        mean[t, : len(share)] = centre[order]
        mean[t, len(share) :] = centre[order[0]]
        covariance[t, : len(share)] = spread[order]
    return ManyParts(weight, mean, np.asarray(_WIDER * np.linalg.cholesky(covariance)))


def _merged(components: Components, part: slice) -> tuple[FloatArray, FloatArray, FloatArray]:
    log_weight = components.log_weight[part]
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    mean, covariance = components.mean[part], components.covariance[part]
    place = components.place[part]
    while len(weight) > _MOST_PARTS:
        place, group = np.unique(place // 2, axis=0, return_inverse=True)
        group = np.asarray(group).ravel()
        total = np.bincount(group, weights=weight)
        share = (weight / total[group])[:, None]
        centre = np.zeros((len(total), mean.shape[1]))
        np.add.at(centre, group, share * mean)
        off = mean - centre[group]
        spread = np.zeros((len(total), *covariance.shape[1:]))
        np.add.at(spread, group, share[..., None] * (covariance + off[:, :, None] * off[:, None, :]))
        weight, mean, covariance = total, centre, spread
    return weight, mean, covariance


def count_places(components: Components, n_touches: int) -> IntArray:
    """Number of separate locations in the posterior of each touch, (t,).

    Nodes are visited in the order of decreasing weight. A node without a higher neighbour is the peak of a new
    location. A location is merged with a higher one if the weight between them is not below half of its peak.
    """
    bounds = np.searchsorted(components.touch, np.arange(n_touches + 1))
    return np.array([_places(components.log_weight[a:b], components.place[a:b]) for a, b in pairwise(bounds)])


def _places(log_weight: FloatArray, place: IntArray) -> int:
    weight = np.exp(log_weight - log_weight.max())
    weight, place = weight[weight > _FAINT], place[weight > _FAINT]
    near = np.abs(place[:, None] - place).max(axis=2) <= 1
    owner = np.full(len(weight), -1)
    peak: list[float] = []
    mass: list[float] = []
    merged: list[int] = []

    def root(which: int) -> int:
        while merged[which] != which:
            which = merged[which]
        return which

    for node in np.argsort(-weight):
        around = {root(int(which)) for which in owner[near[node]] if which >= 0}
        if not around:
            owner[node] = len(peak)
            peak.append(float(weight[node]))
            mass.append(float(weight[node]))
            merged.append(len(merged))
            continue
        highest = max(around, key=lambda which: peak[which])
        owner[node] = highest
        mass[highest] += float(weight[node])
        for other in around - {highest}:
            if weight[node] > _SADDLE * peak[other]:
                merged[other] = highest
                mass[highest] += mass[other]
                mass[other] = 0.0
    return int((np.array(mass) > _LEAST_MASS * sum(mass)).sum())
