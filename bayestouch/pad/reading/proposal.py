"""Mixtures of Student-t distributions for many touches at once: density, draws, number of separate locations."""

from __future__ import annotations

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

# Largest number of parts of one touch; more are merged with their neighbours on the lattice.
_MOST_PARTS = 96

# Two locations are separate if the density between them is below the share _SADDLE of the lower peak. A location counts
# if it has at least the share _LEAST_MASS of the probability.
_SADDLE, _LEAST_MASS = 0.5, 0.05

# Nodes with less than this share of the largest weight are neglected.
_FAINT = 1e-3


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
