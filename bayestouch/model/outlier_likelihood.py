"""Likelihood of samples with outliers, with the unknown true mean of each touch integrated out.

A wrong reading changes the mean of its touch, by a fifth of its error if there are five samples. Deviations from this
mean are then not independent: that of the wrong reading is too small, those of the other four are too large.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.effects.effect import Values
from bayestouch.model.noise_search import TouchScatter

# Range of the nodes beyond the samples, in sd of the usual noise.
BEYOND = 3.0
# Nodes about an expected true mean, in sd of this expectation.
ABOUT = 0.75 * np.arange(-8.0, 9.0)
# Least precision of a true mean, over that of the expectation. Samples that allow two means far apart may say less than
# nothing about it.
LEAST_PRECISION = 1e-3
# Sd of a normal variable over its median absolute deviation; smallest sd of the usual noise for the placing of nodes,
# over that of all noise.
FROM_MEDIAN, LEAST = 1.4826, 0.05


@dataclass(frozen=True, eq=False)
class TrueMeans:
    """Normal densities of the true means of g groups that replace the densities of their samples.

    Attributes
    ----------
    log_samples : (g,) array
        Log density of the deviations of the samples from each other: the true mean is integrated out.
    gained : (g,) array
        Log factor of the normal density, apart from `log_samples`.
    mean, variance : (g,) arrays
        Mean, relative to that of the samples, and variance, in units of the sd of all noise.
    """

    log_samples: FloatArray
    gained: FloatArray
    mean: FloatArray
    variance: FloatArray


@dataclass(frozen=True, eq=False)
class OutlierLikelihood:
    """Quadrature over the true mean of each group; g groups (samples of one element in one touch), p pairs.

    A pair is a group with one of its nodes. The distance of the nodes is the uncertainty of the mean of the group: the
    trapezoidal rule is then exact to 1e-8 for a normal density.

    Attributes
    ----------
    deviation : (g, k) array
        Samples, relative to their mean, in units of the sd of all noise; NaN missing.
    square : (p, k) array
        Square of each sample's distance from the node.
    place : (p,) array
        Node of each pair, relative to the mean of the samples.
    element, touch : (g,) int arrays
        Element and touch of each group.
    group : (p,) int array
        Group of each pair.
    first, step : (g,) arrays
        Index of the first pair of each group, and the distance of its nodes.
    sd : (m,) array
        Sd of all noise over the peak.
    others : (g,) array
        Variance of a right reading of each group by other noise effects, in units of the variance of all noise.
    """

    deviation: FloatArray
    square: FloatArray
    place: FloatArray
    element: IntArray
    touch: IntArray
    group: IntArray
    first: IntArray
    step: FloatArray
    sd: FloatArray
    others: FloatArray

    @classmethod
    def of(cls, scatter: TouchScatter, others: FloatArray | None = None) -> OutlierLikelihood:
        """Likelihood for the scatter of a fitted model.

        `others` (t, m) is the variance of one reading by other noise effects, in units of the variance of all noise; by
        default there are none. The signal, and thus this variance, is the same for all samples of a touch.
        """
        deviation, element, touch = _grouped(scatter)
        count = _count(deviation)
        about = np.abs(deviation - np.nanmedian(deviation, axis=1, keepdims=True))
        usual = np.full(len(scatter.sd), LEAST)
        for e in np.unique(element):
            # Deviations from the median of few samples are smaller than those from the true mean.
            rows = element == e
            wider = np.sqrt(1 - 1 / count[rows].mean())
            usual[e] = max(FROM_MEDIAN * float(np.nanmedian(about[rows])) / wider, LEAST)
        if others is None:
            return cls.about(deviation, element, touch, usual, scatter.sd)
        of_groups = others[touch, element]
        for e in np.unique(element):
            usual[e] = np.sqrt(max(usual[e] ** 2 - float(np.median(of_groups[element == e])), LEAST**2))
        return cls.about(deviation, element, touch, usual, scatter.sd, of_groups)

    @classmethod
    def about(
        cls,
        deviation: FloatArray,
        element: IntArray,
        touch: IntArray,
        usual: FloatArray,
        sd: FloatArray,
        others: FloatArray | None = None,
    ) -> OutlierLikelihood:
        """Likelihood of groups of samples.

        `usual` (m,) is about the sd of a right reading without other noise effects, in the unit of `deviation`. Other
        parameters are as the attributes; by default there is no noise of other effects.
        """
        others = np.zeros(len(deviation)) if others is None else others
        width = np.hypot(usual[element], np.sqrt(others))
        low = np.nanmin(deviation, axis=1) - BEYOND * width
        high = np.nanmax(deviation, axis=1) + BEYOND * width
        step = width / np.sqrt(_count(deviation))
        nodes = np.ceil((high - low) / step).astype(np.int64) + 1
        first = np.cumsum(nodes) - nodes
        group = np.repeat(np.arange(len(nodes)), nodes)
        place = low[group] + step[group] * (np.arange(len(group)) - first[group])
        square = (deviation[group] - place[:, None]) ** 2
        return cls(deviation, square, place, element, touch, group, first, step, sd, others)

    @property
    def count(self) -> FloatArray:
        """Number of samples of each group, (g,)."""
        return _count(self.deviation)

    def __call__(self, values: Values, own: FloatArray) -> FloatArray:
        """Contribution of each element to the log likelihood, (m,), up to a constant.

        Parameters
        ----------
        values : (float, float)
            Share of wrong readings, and the sd of their errors over the peak.
        own : (m,) array
            Variance of the usual noise, without `others`, over that of all noise.
        """
        total = self._integrated(self._log_density(values, own, self.square, self.group))[0]
        return np.asarray(np.bincount(self.element, total, minlength=len(self.sd)), dtype=np.float64)

    def true_means(self, values: Values, own: FloatArray, expected: FloatArray, spread: FloatArray) -> TrueMeans:
        """Normal densities of the true means of the groups that replace the densities of their samples.

        The product of the density of the samples with the normal density of the expected true mean is integrated over
        the true mean. The normal density that replaces the first one gives the same integral, mean and variance of the
        product (a step of expectation propagation, T. Minka, arXiv:1301.2294). Whether a reading is wrong is thus not
        decided: if two of four readings are far off, the expectation says how probable each pair is.

        Parameters
        ----------
        values, own
            As in `__call__`.
        expected, spread : (g,) arrays
            Expected true mean, relative to that of the samples, in units of the sd of all noise, and its variance;
            infinite if nothing is expected.
        """
        count = self.count
        at_nodes = self._log_density(values, own, self.square, self.group)
        log_samples, mean, variance = self._integrated(at_nodes)
        if not np.isfinite(spread).any():
            return TrueMeans(log_samples, np.zeros(len(mean)), mean, variance)
        sd = np.sqrt(spread)
        # The nodes of the samples resolve a wide expectation; it has further nodes beyond them. A narrow one has only
        # nodes of its own.
        usual = (own[self.element] + self.others) / count
        narrow = spread <= usual
        nodes = expected[:, None] + sd[:, None] * ABOUT
        groups = np.repeat(np.arange(len(nodes)), len(ABOUT))
        square = (self.deviation[groups] - nodes.reshape(-1, 1)) ** 2
        about = self._log_density(values, own, square, groups).reshape(nodes.shape) - 0.5 * ABOUT**2
        at_nodes = at_nodes - 0.5 * (self.place - expected[self.group]) ** 2 / spread[self.group]
        of_samples, of_expected = self._widths(nodes)
        of_samples = np.where(narrow[self.group], 0.0, of_samples)
        of_expected = np.where(narrow[:, None], ABOUT[1] - ABOUT[0], of_expected / sd[:, None])
        with np.errstate(divide="ignore"):
            at_nodes = at_nodes + np.log(of_samples / sd[self.group])
            about = about + np.log(of_expected)
        most = np.maximum(np.maximum.reduceat(at_nodes, self.first), about.max(axis=1))
        density, near = np.exp(at_nodes - most[self.group]), np.exp(about - most[:, None])
        # Moments about the expectation, which the spread measures.
        away, off = self.place - expected[self.group], nodes - expected[:, None]
        mass, once, twice = (
            np.add.reduceat(density * away**k, self.first) + (near * off**k).sum(axis=1) for k in range(3)
        )
        shift = once / mass
        log_product = most + np.log(mass) - 0.5 * np.log(2 * np.pi)
        # Where the expectation contradicts all samples, the product may be between or beyond the nodes, and its
        # variance is not resolved: it is at least half of that of the product of two normal densities.
        variance = np.maximum(twice / mass - shift**2, 0.5 / (1 / usual + 1 / spread))
        precision = np.maximum(1 / variance - 1 / spread, LEAST_PRECISION / spread)
        # The mean of the product is the weighted mean of both normal densities.
        moved = shift * (1 + 1 / (spread * precision))
        total = 1 / precision + spread
        gained = log_product - log_samples + 0.5 * (np.log(2 * np.pi * total) + moved**2 / total)
        return TrueMeans(log_samples, gained, expected + moved, 1 / precision)

    def _widths(self, nodes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Weights of the trapezoidal rule: nodes of the samples (p,), and further `nodes` (g, q) beyond them.

        Further nodes, in ascending order and at even distances, between those of the samples have no weight.
        """
        last = np.append(self.first[1:], len(self.place)) - 1
        low, high = self.place[self.first], self.place[last]
        own, further = self.step[self.group].copy(), np.zeros(nodes.shape)
        distance = nodes[:, 1] - nodes[:, 0]
        for end, at, beyond in ((low, self.first, nodes < low[:, None]), (high, last, nodes > high[:, None])):
            gap = np.where(beyond, np.abs(nodes - end[:, None]), np.inf)
            nearest = gap.min(axis=1)
            next_to = beyond & (gap == nearest[:, None])
            further += np.where(next_to, 0.5 * (gap + distance[:, None]), np.where(beyond, distance[:, None], 0.0))
            own[at] += np.where(np.isfinite(nearest), 0.5 * (nearest - self.step), 0.0)
        return own, further

    def _integrated(self, log_density: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Log of the integral over the nodes, mean and variance of each group, (g,), from log densities (p,)."""
        most = np.maximum.reduceat(log_density, self.first)
        density = np.exp(log_density - most[self.group])
        mass, once, twice = (np.add.reduceat(density * self.place**k, self.first) for k in range(3))
        return most + np.log(self.step * mass), once / mass, twice / mass - (once / mass) ** 2

    def _log_density(self, values: Values, own: FloatArray, square: FloatArray, group: IntArray) -> FloatArray:
        """Log density (p,) of the samples of groups (p,) with squared distances (p, k) from a true mean."""
        probability, size = values
        element = self.element[group]
        narrow = own[element] + self.others[group]
        narrow_sd, wide_sd = np.sqrt(narrow)[:, None], np.sqrt(narrow + ((size / self.sd) ** 2)[element])[:, None]
        # The bound avoids underflow of exp; a reading with such a deviation is wrong for all values.
        usual = (1 - probability) / narrow_sd * np.exp(-np.minimum(0.5 * square / narrow_sd**2, 700.0))
        wrong = probability / wide_sd * np.exp(-np.minimum(0.5 * square / wide_sd**2, 700.0))
        return np.asarray(np.nansum(np.log(usual + wrong + 1e-300), axis=1))


def _grouped(scatter: TouchScatter) -> tuple[FloatArray, IntArray, IntArray]:
    """Deviations of each element's samples in each touch (g, k), NaN missing, in units of the sd.

    Also the element and the touch of each group, both (g,). Groups of one sample carry no information on the noise and
    are left out.
    """
    # `z` is a deviation divided by the root of its weight, which made its variance one; this is undone here.
    number, group = np.unique(scatter.touch, return_inverse=True)
    deviation = grouped_samples(scatter.z * np.sqrt(scatter.weight_of_readings), group)
    t, m, k = deviation.shape
    flat, element = deviation.reshape(-1, k), np.tile(np.arange(m), t)
    several = _count(flat) > 1
    return flat[several], element[several], np.repeat(number, m)[several]


def grouped_samples(samples: FloatArray, group: IntArray) -> FloatArray:
    """Samples (n, m) by their group (n,), which is numbered from 0: (t, m, k), NaN missing."""
    count, order = np.bincount(group), np.argsort(group, kind="stable")
    place = group[order]
    out = np.full((len(count), samples.shape[1], int(count.max())), np.nan)
    out[place, :, np.arange(len(group)) - (np.cumsum(count) - count)[place]] = samples[order]
    return out


def _count(deviation: FloatArray) -> FloatArray:
    """Number of samples of groups (..., k) that are not missing."""
    return np.asarray((~np.isnan(deviation)).sum(axis=-1), dtype=np.float64)
