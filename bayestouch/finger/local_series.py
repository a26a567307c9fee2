"""Readings of calibration touches of a finger near its fit, by polynomials instead of sums over Fourier modes.

A calibration determines depth and angle of an element to 0.01 mm and 0.01°, σ and log μ to a few 0.001. In this small
range, reading over response is a polynomial of degree four in these four variables, to 1e-7 of the peak. An evaluation
is one matrix product.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import lstsq

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.finger.layout import FlatLayout
from bayestouch.finger.series import TouchSeries

# Range of the polynomials in standard deviations. One proposal in three hundred is outside.
REACH = 4.0
# Total degree for the readings, and for their derivative over the load (used only for the error of the load). With
# degree 4 the same proposals are accepted as with the series; with degree 3 one decision in a thousand differs.
DEGREE, SLOPE_DEGREE = 4, 2
# Number of nodes per coefficient, and number of further nodes at which polynomials and series are compared.
NODES, COMPARED = 1.6, 8
# Number of vectors per evaluation of the series; the arrays for more do not fit into the cache.
TOGETHER = 6
# Largest root sum of squares of the errors of the polynomials over the noise (about the error of a log density), and
# its largest value for terms of high degree that are left out.
LARGEST_ERROR, LEFT_OUT = 0.02, 3e-4


@dataclass(frozen=True, eq=False)
class Polynomials:
    """Polynomials in some variables, one for each touch and element.

    Attributes
    ----------
    coefficients : (m, t, k) array
        Coefficients of k terms.
    kept : (k,) int array
        Indices of these terms among the products of powers.
    """

    coefficients: FloatArray
    kept: IntArray

    def __call__(self, terms: FloatArray) -> FloatArray:
        """Values (n, t, m) from all products of powers (m, terms, n)."""
        return np.ascontiguousarray((self.coefficients @ terms[:, self.kept]).transpose(2, 1, 0))

    @classmethod
    def of(cls, nodes: FloatArray, values: FloatArray, degree: int, noise: FloatArray) -> Polynomials:
        """Least-squares fit to values (n, t, m) at nodes (n, v); terms far below `noise` (t, m) are left out."""
        # A QR factorisation: with two thousand terms it takes half as long as the singular values of `numpy`.
        terms = monomials(nodes.T, degree).T
        found = lstsq(terms, values.reshape(len(values), -1), lapack_driver="gelsy", check_finite=False)[0]
        found = found.reshape(len(found), *values.shape[1:])
        squares = ((found / noise) ** 2).sum(axis=(1, 2))
        order = np.argsort(squares)
        kept = np.sort(order[np.cumsum(squares[order]) > LEFT_OUT**2])
        return cls(np.ascontiguousarray(found[kept].transpose(2, 1, 0)), kept)


@dataclass(frozen=True, eq=False)
class LocalSeries:
    """Polynomials in depth, angle, σ and log μ that approximate a series; t touches, m elements.

    Attributes
    ----------
    series : TouchSeries
        The series, used for vectors outside the range of the polynomials.
    centre, half_width : (4, m) arrays
        Range of the four variables, for each element.
    readings, slopes : Polynomials
        Reading over response, and its derivative over the load.
    """

    series: TouchSeries
    centre: FloatArray
    half_width: FloatArray
    readings: Polynomials
    slopes: Polynomials

    def __call__(self, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Expected readings (n, t, m) at the measured loads, and their derivative over the load (n, t, m)."""
        place = (chain_coordinates(self.series.layout, vectors) - self.centre[:, None]) / self.half_width[:, None]
        beyond = (np.abs(place) > 1).any(axis=(0, 2))
        response = self.series.sign * np.exp(vectors[:, self.series.layout.response])
        terms = (monomials(place, DEGREE) * response).transpose(2, 0, 1)
        readings, slopes = self.readings(terms), self.slopes(terms)
        if beyond.any():
            readings[beyond], slopes[beyond] = self.series(vectors[beyond])
        return readings, slopes


def local_series(
    series: TouchSeries,
    centre: FloatArray,
    sd: FloatArray,
    noise_sd: FloatArray,
    squared_distance: Callable[[FloatArray], FloatArray] | None = None,
) -> LocalSeries | TouchSeries:
    """Polynomials about a vector, or the series itself if their error would be too large.

    Parameters
    ----------
    series : TouchSeries
        The series to approximate.
    centre, sd : (d,) arrays
        Vector of the coordinates of the chain, and their standard deviations.
    noise_sd : (t, m) array
        Standard deviation of a mean reading; inf where missing.
    squared_distance : callable, optional
        From differences (n, t, m) over `noise_sd` to what they count in the density, (n,); their sum of squares by
        default. With functions of place it is less: the posterior is wide where these can take a change back.
    """
    at, reach = series.layout, series.reach
    low, high = centre - REACH * sd, centre + REACH * sd
    low[at.depth] = np.maximum(low[at.depth], series.finger.core_radius_mm)
    high[at.depth] = np.minimum(high[at.depth], reach.depth)
    for place, ends in ((at.sigma, reach.sigma), (at.log_mu, reach.log_mu)):
        low[place], high[place] = max(low[place], ends[0]), min(high[place], ends[1])
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1e-12)
    count = int(NODES * len(powers(DEGREE, 4))) + COMPARED
    # Random nodes, denser at the ends like Chebyshev nodes.
    nodes = np.sin(np.pi / 2 * np.random.default_rng(0).uniform(-1, 1, (count, 4)))
    vectors = np.repeat(centre[None], count, axis=0)
    places: tuple[slice | int, ...] = (at.depth, at.angle, at.sigma, at.log_mu)
    for at_place, node in zip(places, nodes.T, strict=True):
        vectors[:, at_place] = middle[at_place] + np.multiply.outer(node, half[at_place])
    response = series.sign * np.exp(centre[at.response])
    parts = [series(vectors[first : first + TOGETHER]) for first in range(0, count, TOGETHER)]
    readings, slopes = (np.concatenate(each) for each in zip(*parts, strict=True))
    noise = noise_sd / np.abs(response)
    local = LocalSeries(
        series,
        chain_coordinates(at, middle),
        chain_coordinates(at, half),
        Polynomials.of(nodes[COMPARED:], readings[COMPARED:] / response, DEGREE, noise),
        Polynomials.of(
            nodes[COMPARED:], slopes[COMPARED:] / response, SLOPE_DEGREE, noise / series.known.load[:, None]
        ),
    )
    off = (local(vectors[:COMPARED])[0] - readings[:COMPARED]) / noise_sd
    counted = (off**2).sum(axis=(1, 2)) if squared_distance is None else squared_distance(off)
    return local if np.sqrt(counted).max() < LARGEST_ERROR else series


def chain_coordinates(at: FlatLayout, vectors: FloatArray) -> FloatArray:
    """Depth, angle, σ and log μ of each element, (4, ..., m), of vectors (..., d)."""
    depth = vectors[..., at.depth]
    shared = (np.broadcast_to(vectors[..., place, None], depth.shape) for place in (at.sigma, at.log_mu))
    return np.stack([depth, vectors[..., at.angle], *shared])


def monomials(place: FloatArray, degree: int) -> FloatArray:
    """Products of powers up to a total degree, (k, ...), of places (v, ...); low degrees first."""
    out = np.empty((len(powers(degree, len(place))), *place.shape[1:]))
    out[0] = 1.0
    for i, (less, factor) in enumerate(_factors(degree, len(place)), start=1):
        np.multiply(out[less], place[factor], out=out[i])
    return out


@lru_cache(maxsize=8)
def powers(degree: int, variables: int) -> tuple[tuple[int, ...], ...]:
    """Powers of some variables up to a total degree, in order of the degree."""
    every: list[tuple[int, ...]] = [()]
    for _ in range(variables):
        every = [(*one, power) for one in every for power in range(degree - sum(one) + 1)]
    return tuple(sorted(every, key=sum))


@lru_cache(maxsize=8)
def _factors(degree: int, variables: int) -> tuple[tuple[int, int], ...]:
    """For each product except the first: index of the product with one factor less, and this factor."""
    every, out = powers(degree, variables), []
    for one in every[1:]:
        factor = next(i for i, power in enumerate(one) if power)
        less = tuple(power - (i == factor) for i, power in enumerate(one))
        out.append((every.index(less), factor))
    return tuple(out)
