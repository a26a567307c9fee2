"""Coarse search for the location of one touch on a pad: all nodes of the lattice in a few products of matrices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.pad.reading.lattice import Lattice
from bayestouch.pad.reading.reader import PadReader

# Nodes whose log weight is more than DEPTH below the largest one are left out. There is another location if more than
# the share ELSEWHERE of the probability is further than APART sd from the best node.
DEPTH, ELSEWHERE, APART = 10.0, 1e-2, 8.0


@dataclass(frozen=True, eq=False)
class Rough:
    """Rough posterior of the location: a sum of normal distributions, one for each node that is not negligible.

    Attributes
    ----------
    mean, covariance : (D,), (D, D) arrays
        Mean and covariance of the location, mm and mm².
    load : float
        Load at the best node.
    elsewhere : float
        Share of the probability far from the best node.
    """

    mean: FloatArray
    covariance: FloatArray
    load: float
    elsewhere: float


class Search:
    """Search over the lattice; products that depend only on counts and load are kept until these change.

    The formulas are those of `bayestouch.pad.reading.components`, for one touch.
    """

    def __init__(self, reader: PadReader, lattice: Lattice) -> None:
        self.reader, self.lattice = reader, lattice
        self.sensitivity, self.slope = reader.map.slopes(lattice.location)
        _, self.open, self.shared = reader.map.at(lattice.location)
        self._key: tuple[bytes, float] | None = None

    def __call__(self, reading: FloatArray, counts: FloatArray, load: float, load_sd: float) -> Rough:
        """Rough posterior from readings minus offsets (m,), counts (m,), and mean and sd of the load's prior."""
        self._prepare(counts, load)
        pull = self._by_load @ reading - load * self._a
        square = self._weight @ (reading * reading) - 2 * load * pull - load * load * self._a
        precision = self._a + 1 / load_sd**2
        best = np.maximum(load + pull / precision, 0.05 * load)
        v = (self._by_place @ reading - (load + pull / precision) * self._c) * best
        h = best * best * (self._own - self._c[self._pairs[0]] * self._c[self._pairs[1]] / precision)
        tau = 1 / self.lattice.width**2
        if len(v) == 1:
            determinant = h[0] + tau
            step = v / determinant
            spread = np.array([1 / determinant])
        else:
            xx, xy, yy = h[0] + tau, h[1], h[2] + tau
            determinant = xx * yy - xy * xy
            step = np.array([yy * v[0] - xy * v[1], xx * v[1] - xy * v[0]]) / determinant
            spread = np.array([yy, -xy, xx]) / determinant
        gain = (step * v).sum(axis=0)
        log = -0.5 * (square - pull * pull / precision - gain + self._constant + np.log(precision * determinant))
        k = int(log.argmax())
        near = np.flatnonzero(log > log[k] - DEPTH)
        weight = np.exp(log[near] - log[k])
        weight /= weight.sum()
        # The expansion about a node is not valid far beyond the neighbouring nodes.
        reach = 2 * self.lattice.width
        places = self.lattice.location[near].T + np.clip(step[:, near], -reach, reach)
        mean = places @ weight
        off = places - mean[:, None]
        covariance = (off * weight) @ off.T
        first, second = self._pairs
        within = spread[:, near] @ weight
        covariance[first, second] += within
        if len(v) == 2:
            covariance[1, 0] += within[1]
        top = int(weight.argmax())
        distance = np.abs(places - places[:, [top]]).max(axis=0)
        limit = APART * (np.sqrt(spread[[0, -1]].max(axis=0)[near][top]) + 0.3 * self.lattice.step)
        return Rough(mean, covariance, float(best[k]), float(weight[distance > limit].sum()))

    def _prepare(self, counts: FloatArray, load: float) -> None:
        key = (counts.tobytes(), round(float(np.log(load)), 1))
        if key == self._key:
            return
        self._key = key
        reader = self.reader
        signal = load * self.sensitivity
        noise = reader.noise.mean_sd(np.maximum(counts, 1.0), signal) ** 2
        variance = noise + reader.map.reading_variance(self.open, self.shared, np.array(load))
        weight = np.where(counts > 0, 1 / variance, 0.0)
        by_load = weight * self.sensitivity
        axes = range(self.slope.shape[1])
        pairs = [(i, j) for i in axes for j in axes if i <= j]
        self._pairs = tuple(np.array(each) for each in zip(*pairs, strict=True))
        self._a = (by_load * self.sensitivity).sum(axis=1)
        self._c = np.stack([(by_load * self.slope[:, i]).sum(axis=1) for i in axes])
        self._own = np.stack([(weight * self.slope[:, i] * self.slope[:, j]).sum(axis=1) for i, j in pairs])
        self._by_place = np.ascontiguousarray(np.moveaxis(weight[:, None] * self.slope, 1, 0))
        self._constant = np.where(counts > 0, np.log(variance), 0.0).sum(axis=1)
        self._weight, self._by_load = weight, by_load
