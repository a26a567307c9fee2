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

# Range of the nodes beyond the samples, in sd of the usual noise; the true mean is inside this range.
BEYOND = 3.0
# Sd of a normal variable over its median absolute deviation; smallest sd of the usual noise for the placing of nodes,
# over that of all noise.
FROM_MEDIAN, LEAST = 1.4826, 0.05


@dataclass(frozen=True, eq=False)
class OutlierLikelihood:
    """Quadrature over the true mean of each group; g groups (samples of one element in one touch), p pairs.

    A pair is a group with one of its nodes. The distance of the nodes is the uncertainty of the mean of the group: the
    trapezoidal rule is then exact to 1e-8 for a normal density.

    Attributes
    ----------
    square : (p, k) array
        Square of each sample's distance from the node, over the variance of all noise; NaN missing.
    place : (p,) array
        Node of each pair, relative to the mean of the samples.
    pair_element : (p,) int array
        Element of each pair.
    touch : (g,) int array
        Touch of each group.
    first, step : (g,) arrays
        Index of the first pair of each group, and the distance of its nodes.
    sd : (m,) array
        Sd of all noise over the peak.
    """

    square: FloatArray
    place: FloatArray
    pair_element: IntArray
    touch: IntArray
    first: IntArray
    step: FloatArray
    sd: FloatArray

    @classmethod
    def of(cls, scatter: TouchScatter) -> OutlierLikelihood:
        """Likelihood for the scatter of a fitted model."""
        deviation, element, touch = _grouped(scatter)
        count = (~np.isnan(deviation)).sum(axis=1)
        about = np.abs(deviation - np.nanmedian(deviation, axis=1, keepdims=True))
        usual = np.full(len(scatter.sd), LEAST)
        for e in np.unique(element):
            # Deviations from the median of few samples are smaller than those from the true mean.
            rows = element == e
            wider = np.sqrt(1 - 1 / count[rows].mean())
            usual[e] = max(FROM_MEDIAN * float(np.nanmedian(about[rows])) / wider, LEAST)
        low = np.nanmin(deviation, axis=1) - BEYOND * usual[element]
        high = np.nanmax(deviation, axis=1) + BEYOND * usual[element]
        step = usual[element] / np.sqrt(count)
        nodes = np.ceil((high - low) / step).astype(np.int64) + 1
        first = np.cumsum(nodes) - nodes
        group = np.repeat(np.arange(len(nodes)), nodes)
        place = low[group] + step[group] * (np.arange(len(group)) - first[group])
        return cls((deviation[group] - place[:, None]) ** 2, place, element[group], touch, first, step, scatter.sd)

    def __call__(self, values: Values, own: FloatArray) -> FloatArray:
        """Contribution of each element to the log likelihood, (m,), up to a constant.

        Parameters
        ----------
        values : (float, float)
            Share of wrong readings, and the sd of their errors over the peak.
        own : (m,) array
            Variance of the usual noise over that of all noise.
        """
        most, density = self._at_nodes(values, own)
        total = most + np.log(self.step * np.add.reduceat(density, self.first))
        return np.asarray(np.bincount(self.element, total, minlength=len(self.sd)), dtype=np.float64)

    def true_means(self, values: Values, own: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance of the true mean of each group, both (g,), given its samples.

        They are in units of the sd of all noise; the mean is relative to that of the samples. Whether a reading is
        wrong is thus not decided: if two of four readings are far off, the variance says that any of them may be right.
        Parameters are as in `__call__`.
        """
        _, density = self._at_nodes(values, own)
        mass, once, twice = (np.add.reduceat(density * self.place**k, self.first) for k in range(3))
        return once / mass, twice / mass - (once / mass) ** 2

    def _at_nodes(self, values: Values, own: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Largest log density of each group (g,), and the density at each pair (p,) over that of its group."""
        probability, size = values
        wide = own + (size / self.sd) ** 2
        narrow_sd, wide_sd = np.sqrt(own)[self.pair_element, None], np.sqrt(wide)[self.pair_element, None]
        # The bound avoids underflow of exp; a reading with such a deviation is wrong for all values.
        usual = (1 - probability) / narrow_sd * np.exp(-np.minimum(0.5 * self.square / narrow_sd**2, 700.0))
        wrong = probability / wide_sd * np.exp(-np.minimum(0.5 * self.square / wide_sd**2, 700.0))
        log = np.nansum(np.log(usual + wrong + 1e-300), axis=1)
        most = np.maximum.reduceat(log, self.first)
        return most, np.exp(log - np.repeat(most, np.diff(self.first, append=len(log))))

    @property
    def element(self) -> IntArray:
        """Element of each group, (g,)."""
        return self.pair_element[self.first]


def _grouped(scatter: TouchScatter) -> tuple[FloatArray, IntArray, IntArray]:
    """Deviations of each element's samples in each touch (g, k), NaN missing, in units of the sd.

    Also the element and the touch of each group, both (g,). Groups of one sample carry no information on the noise and
    are left out.
    """
    n, m = scatter.z.shape
    order = np.argsort(scatter.touch, kind="stable")
    number, touch, count = np.unique(scatter.touch[order], return_inverse=True, return_counts=True)
    sample = np.arange(n) - (np.cumsum(count) - count)[touch]
    deviation = np.full((len(count), m, int(count.max())), np.nan)
    # `z` is a deviation divided by the root of its weight, which made its variance one; this is undone here.
    deviation[touch, :, sample] = (scatter.z * np.sqrt(scatter.weight)[:, None])[order]
    flat, element = deviation.reshape(-1, deviation.shape[2]), np.tile(np.arange(m), len(count))
    several = (~np.isnan(flat)).sum(axis=1) > 1
    return flat[several], element[several], np.repeat(number, m)[several]
