"""Coarse search for the location of one touch on a pad: all nodes of the lattice in a few products of matrices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.pad.reading.components import LEAST_LOAD
from bayestouch.pad.reading.lattice import Lattice
from bayestouch.pad.reading.reader import PadReader
from bayestouch.sampling.rank_one import precision_times, shared_directions

# Nodes whose log weight is more than DEPTH below the largest one are left out. There is another location if more than
# the share ELSEWHERE of the probability is further than APART sd from the best node.
DEPTH, ELSEWHERE, APART = 10.0, 1e-2, 8.0
# Products are computed for loads a tenth apart (their logarithms), and so many of them are kept: 50 MB at most.
LOAD_STEP, KEPT = 0.1, 32


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


@dataclass(frozen=True, eq=False)
class Products:
    """What the search needs of the n nodes for given counts and load, before the readings are known; m elements.

    Attributes
    ----------
    weight : (n, m) array
        Inverse variances of the readings; 0 where missing.
    shared : (k, n, m) array
        Directions of the errors of the noise that elements share, see `shared_directions`.
    by_load : (n, m) array
        Inverse covariances of the readings times sensitivities.
    by_place : (D, n, m) array
        Inverse covariances of the readings times slopes of the sensitivities.
    load, load_place, place : (n,), (D, n), (k, n) arrays
        Information on the load, on load and place together, and on each of the k pairs of coordinates.
    constant : (n,) array
        Logarithm of the determinant of the covariance.
    """

    weight: FloatArray
    shared: FloatArray
    by_load: FloatArray
    by_place: FloatArray
    load: FloatArray
    load_place: FloatArray
    place: FloatArray
    constant: FloatArray


class Search:
    """Search over the lattice; products that depend only on counts and load are kept for later touches.

    The formulas are those of `bayestouch.pad.reading.components`, for one touch.
    """

    def __init__(self, reader: PadReader, lattice: Lattice) -> None:
        self.reader, self.lattice = reader, lattice
        self.sensitivity, self.slope = reader.map.slopes(lattice.location)
        _, self.open, self.shared = reader.map.at(lattice.location)
        axes = range(self.slope.shape[1])
        self._first, self._second = np.array([(i, j) for i in axes for j in axes if i <= j]).T
        self._kept: dict[tuple[bytes, int], Products] = {}

    def __call__(self, reading: FloatArray, counts: FloatArray, load: float, load_sd: float) -> Rough:
        """Rough posterior from readings minus offsets (m,), counts (m,), and mean and sd of the load's prior."""
        of, first, second = self._products(counts, load), self._first, self._second
        pull = of.by_load @ reading - load * of.load
        square = of.weight @ (reading * reading) - 2 * load * pull - load * load * of.load
        for along in of.shared:
            square -= (along @ reading) ** 2
        precision = of.load + 1 / load_sd**2
        best = np.maximum(load + pull / precision, 0.05 * self.reader.load)
        v = (of.by_place @ reading - (load + pull / precision) * of.load_place) * best
        h = best * best * (of.place - of.load_place[first] * of.load_place[second] / precision)
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
        log = -0.5 * (square - pull * pull / precision - gain + of.constant + np.log(precision * determinant))
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
        within = spread[:, near] @ weight
        covariance[first, second] += within
        if len(v) == 2:
            covariance[1, 0] += within[1]
        top = int(weight.argmax())
        distance = np.abs(places - places[:, [top]]).max(axis=0)
        limit = APART * (np.sqrt(spread[[0, -1]].max(axis=0)[near][top]) + 0.3 * self.lattice.step)
        return Rough(mean, covariance, float(best[k]), float(weight[distance > limit].sum()))

    def _products(self, counts: FloatArray, load: float) -> Products:
        """Products for these counts, at a load that differs from `load` by 5 % at most.

        A force sensor with an offset may read a load that is not above zero: then for a small one.
        """
        step = round(float(np.log(max(load, LEAST_LOAD * self.reader.load))) / LOAD_STEP)
        key = counts.tobytes(), step
        if key not in self._kept:
            if len(self._kept) == KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = self._of(counts, float(np.exp(LOAD_STEP * step)))
        return self._kept[key]

    def _of(self, counts: FloatArray, load: float) -> Products:
        reader, first, second = self.reader, self._first, self._second
        noise = reader.noise.own_sd(np.maximum(counts, 1.0), load * self.sensitivity) ** 2
        variance = noise + reader.map.reading_variance(self.open, self.shared, np.array(load))
        here = (counts > 0).astype(float)
        weight = here / variance
        shared = reader.noise.shared_errors(counts[None])[:, 0]
        directions, log_determinant = shared_directions(weight, np.broadcast_to(shared, (len(weight), *shared.shape)))
        by_load = precision_times(weight, directions, self.sensitivity)
        along = np.einsum("nkm,nm->nk", directions, self.sensitivity)
        by_place = np.stack([precision_times(weight, directions, each) for each in np.moveaxis(self.slope, 1, 0)])
        pairs = zip(first, second, strict=True)
        return Products(
            weight,
            np.ascontiguousarray(directions.swapaxes(0, 1)),
            by_load,
            by_place,
            np.einsum("nm,nm,nm->n", weight, self.sensitivity, self.sensitivity) - (along * along).sum(axis=1),
            np.einsum("inm,nm->in", by_place, self.sensitivity),
            np.stack([np.einsum("nm,nm->n", by_place[i], self.slope[:, j]) for i, j in pairs]),
            np.log(variance) @ here + log_determinant,
        )
