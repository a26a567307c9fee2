"""Posteriors of touches on a pad as sums of normal distributions, from a lattice of locations.

A uniform prior of the location equals, to 0.2 %, a sum of normal priors of width τ on a lattice of step τ/0.6. Near
each node the pad is linear in location and load, so that the part of the posterior from this node is normal with a
closed-form weight. This is also valid for posteriors that are far narrower than a step, cover half the pad, or have
several modes. The sum is the proposal of the sampler, which corrects for the remaining nonlinearity.

Source: D. L. Alspach and H. W. Sorenson, IEEE Trans. Automatic Control 17 (1972) 439 (Gaussian sums).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.pad.reading.lattice import Lattice
from bayestouch.pad.reading.reader import PadReader, PadTouches
from bayestouch.sampling.rank_one import precision_times, shared_directions

# Nodes are left out if their log weight is so far below the largest one: in the search, where weights are approximate,
# and at the end.
_FIRST_DEPTH, _DEPTH = 20.0, 12.0

# Touches searched together: 64 x 20,000 nodes are 10 MB per array.
_TOUCHES = 64

# Touches whose loads differ by less (relative) use the same variance of readings in the search.
_LOAD_BIN = 0.1

# Largest number of nodes refined for one touch. If there are more, the location is hardly determined, and only a part
# of the nodes is used.
_MOST_PAIRS = 1000

# Pairs of touch and node refined together: 20 MB with 8 elements and 3 coordinates.
_PAIRS = 1 << 15

#: Least load over the typical one: below it all readings are noise. A force sensor with an offset may read less.
LEAST_LOAD = 1e-3

# Gauss-Newton steps at most, and the step, in standard deviations of a component, after which it stays where it is.
_ITERATIONS, _CLOSE = 8, 0.1


@dataclass(frozen=True, eq=False)
class Components:
    """Normal distributions whose weighted sum is the posterior of a touch; n components, for all touches.

    Attributes
    ----------
    touch : (n,) int array
        Index of the touch, ascending.
    place : (n, D) int array
        Coordinates on the lattice, or on a lattice that is coarser by an integer factor (one factor for each touch).
    log_weight : (n,) array
        Logarithm of the weight, up to a constant for each touch.
    mean : (n, D + 1) array
        Mean location (mm) and load.
    covariance : (n, D + 1, D + 1) array
        Covariance of location and load.
    """

    touch: IntArray
    place: IntArray
    log_weight: FloatArray
    mean: FloatArray
    covariance: FloatArray

    def select(self, index: NDArray[np.bool_] | IntArray) -> Components:
        """Some of the components."""
        return Components(
            self.touch[index],
            self.place[index],
            self.log_weight[index],
            self.mean[index],
            self.covariance[index],
        )


def components_of(reader: PadReader, touches: PadTouches, lattice: Lattice) -> Components:
    """Posterior of each touch as a sum of normal distributions."""
    tables = reader.map.slopes(lattice.location)
    pairs = [_search(reader, touches, lattice, tables, index) for index in _with_same_elements(touches)]
    touch, node = (np.concatenate([pair[i] for pair in pairs]) for i in (0, 1))
    order = np.lexsort((node, touch))
    touch, node, stride = _thinned(touch[order], node[order], lattice, touches.n_touches)
    parts = [
        _refine(reader, touches, lattice, *(each[i : i + _PAIRS] for each in (touch, node, stride)))
        for i in range(0, len(touch), _PAIRS)
    ]
    rough = Components(*(np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(Components)))
    return rough.select(_near_best(rough, touches.n_touches, _DEPTH))


def _thinned(touch: IntArray, node: IntArray, lattice: Lattice, n_touches: int) -> tuple[IntArray, IntArray, IntArray]:
    """At most `_MOST_PAIRS` nodes for each touch (touch, node), and the stride of their coarser lattice."""
    count = np.bincount(touch, minlength=n_touches)
    stride = np.ones(n_touches, dtype=np.int64)
    while (many := count / stride ** lattice.place.shape[1] > _MOST_PAIRS).any():
        stride[many] *= 2
    kept = (lattice.place[node] % stride[touch, None] == 0).all(axis=1)
    # A coarser lattice contains some of the hundreds of nodes of such a touch; it may contain none of a few nodes.
    return touch[kept], node[kept], stride[touch[kept]]


def _with_same_elements(touches: PadTouches) -> list[IntArray]:
    """Groups of at most `_TOUCHES` touches with the same counts and errors and about the same load, as indices."""
    bins = np.round(np.log(np.maximum(touches.load, 1e-12)) / _LOAD_BIN)
    errors = touches.shared_by_noise.reshape(touches.n_touches, -1)
    _, group = np.unique(np.column_stack([touches.counts, bins, errors]), axis=0, return_inverse=True)
    order = np.argsort(np.asarray(group).ravel(), kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(np.asarray(group).ravel()[order])) + 1)
    return [part[i : i + _TOUCHES] for part in parts for i in range(0, len(part), _TOUCHES)]


def _search(
    reader: PadReader,
    touches: PadTouches,
    lattice: Lattice,
    tables: tuple[FloatArray, FloatArray],
    index: IntArray,
) -> tuple[IntArray, IntArray]:
    """Pairs (touch, node) with a weight that is not negligible, for touches with the same noise.

    Errors of the calibration that elements share are left out. The pad is linear near each node, and the noise is that
    of the prior load, so that all weights are products of matrices (touches by elements, elements by nodes).
    """
    part = touches.select(index)
    load, load_sd = part.load[:, None], part.felt_sd[:, None]
    sensitivity, slope = tables
    least = LEAST_LOAD * reader.load
    _, variance = reader.predict(lattice.location, np.array(max(float(np.median(part.load)), least)), part.counts[0])
    weight = np.where(part.present[0], 1 / variance, 0.0)
    reading = np.where(part.present, part.readings - reader.map.offset, 0.0)
    directions, log_determinant = shared_directions(
        weight, np.broadcast_to(part.shared_by_noise[0], (len(weight), *part.shared_by_noise[0].shape))
    )
    by_load = precision_times(weight, directions, sensitivity)
    a = (by_load * sensitivity).sum(axis=1)
    precision = a + 1 / load_sd**2
    pull = reading @ by_load.T - load * a
    square = (reading**2) @ weight.T - 2 * load * (reading @ by_load.T) + load**2 * a
    for along in directions.swapaxes(0, 1):
        square -= (reading @ along.T) ** 2
    best = np.maximum(load + pull / precision, 0.05 * np.maximum(load, least))
    dimensions, prior = slope.shape[1], 1 / lattice.width**2
    by_place = [precision_times(weight, directions, slope[:, k]) for k in range(dimensions)]
    c = [(by_load * slope[:, k]).sum(axis=1) for k in range(dimensions)]
    v = [best * (reading @ by_place[k].T - load * c[k] - c[k] * pull / precision) for k in range(dimensions)]

    def curvature(k: int, j: int) -> FloatArray:
        own = (by_place[k] * slope[:, j]).sum(axis=1)
        return np.asarray(best**2 * (own - c[k] * c[j] / precision) + (prior if k == j else 0.0))

    if dimensions == 1:
        determinant = curvature(0, 0)
        gain = v[0] ** 2 / determinant
    else:
        xx, xy, yy = curvature(0, 0), curvature(0, 1), curvature(1, 1)
        determinant = xx * yy - xy * xy
        gain = (yy * v[0] ** 2 - 2 * xy * v[0] * v[1] + xx * v[1] ** 2) / determinant
    constant = np.where(part.present[0], np.log(variance), 0.0).sum(axis=1) + log_determinant
    log_weight = -0.5 * (square - pull**2 / precision - gain + constant + np.log(precision) + np.log(determinant))
    touch, node = np.nonzero(log_weight > log_weight.max(axis=1, keepdims=True) - _FIRST_DEPTH)
    return index[touch], node


def _refine(
    reader: PadReader,
    touches: PadTouches,
    lattice: Lattice,
    touch: IntArray,
    node: IntArray,
    stride: IntArray,
) -> Components:
    """Components of the posterior for pairs (touch, node), by Gauss-Newton steps with the nonlinear map."""
    centre = np.column_stack([lattice.location[node], touches.load[touch]])
    d = centre.shape[1]
    width = np.repeat(lattice.width * stride[:, None], d - 1, axis=1)
    prior = 1 / np.column_stack([width, touches.felt_sd[touch]]) ** 2
    x = centre.copy()
    x[:, -1] = np.maximum(x[:, -1], LEAST_LOAD * reader.load)
    reach = np.column_stack([2 * width, 0.95 * x[:, -1]])
    low, high = x - reach, x + reach
    high[:, -1] = np.inf
    moving = np.arange(len(x))
    for _ in range(_ITERATIONS):
        gradient, hessian, _ = _expanded(reader, touches, touch[moving], x[moving], centre[moving], prior[moving])
        step = np.linalg.solve(hessian, gradient[..., None])[..., 0]
        x[moving] = np.clip(x[moving] + step, low[moving], high[moving])
        moving = moving[np.einsum("ni,nij,nj->n", step, hessian, step) > _CLOSE**2]
        if not len(moving):
            break
    _, hessian, cost = _expanded(reader, touches, touch, x, centre, prior)
    cost = cost + np.asarray(np.linalg.slogdet(hessian)[1])
    place = lattice.place[node] // stride[:, None]
    return Components(touch, place, -0.5 * cost, x, np.asarray(np.linalg.inv(hessian)))


def _expanded(
    reader: PadReader, touches: PadTouches, touch: IntArray, x: FloatArray, centre: FloatArray, prior: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Half of minus the gradient of -2 log density at points x (n, d), half of its Hessian, and the value (n,).

    The variance of the readings counts as constant in the derivatives.
    """
    here, counts, d = touches.present[touch], touches.counts[touch], x.shape[1]
    reading = np.where(here, touches.readings[touch] - reader.map.offset, 0.0)
    sensitivity, slope = reader.map.slopes(x[:, :-1], x[:, -1])
    signal, variance = reader.predict(x[:, :-1], x[:, -1], counts)
    weight = np.where(here, 1 / variance, 0.0)
    design = np.concatenate([x[:, -1, None, None] * slope, sensitivity[:, None]], axis=1)
    residual = np.where(here, reading - signal, 0.0)
    hessian = np.einsum("nim,nm,njm->nij", design, weight, design)
    hessian[:, np.arange(d), np.arange(d)] += prior
    gradient = np.einsum("nim,nm->ni", design, weight * residual) + prior * (centre - x)
    cost = (weight * residual**2 + np.where(here, np.log(variance), 0.0)).sum(axis=1)
    if touches.share_errors:
        along, missed, log_determinant = _shared(reader, touches, touch, x, signal, variance, design, residual, centre)
        hessian -= np.einsum("nqi,nqj->nij", along, along)
        gradient -= np.einsum("nqi,nq->ni", along, missed)
        cost += log_determinant - (missed**2).sum(axis=1)
    return gradient, hessian, cost + (prior * (x - centre) ** 2).sum(axis=1)


def _shared(
    reader: PadReader,
    touches: PadTouches,
    touch: IntArray,
    x: FloatArray,
    signal: FloatArray,
    variance: FloatArray,
    design: FloatArray,
    residual: FloatArray,
    centre: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Change of the density of pairs (n,) by the uncertainty of the values of effects, see `PadReader.shared`.

    Products of the q directions with the derivatives over the coordinates (n, q, d), and with the residuals (n, q);
    last, the change of the log determinant of the covariance (n,).
    """
    directions, log_determinant = reader.shared(touches, x[:, None], touch, signal[:, None], variance[:, None])
    full = np.concatenate([design, np.eye(x.shape[1])[:, -1:] * np.ones((len(x), 1, 1))], axis=2)
    along = np.einsum("nqm,nim->nqi", directions[:, 0], full)
    missed = np.concatenate([residual, (centre - x)[:, -1:]], axis=1)
    return along, np.einsum("nqm,nm->nq", directions[:, 0], missed), log_determinant[:, 0]


def _near_best(components: Components, n_touches: int, depth: float) -> NDArray[np.bool_]:
    best = np.full(n_touches, -np.inf)
    np.maximum.at(best, components.touch, components.log_weight)
    return np.asarray(components.log_weight > best[components.touch] - depth)
