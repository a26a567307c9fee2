"""Coordinates in which a long, curved ridge of a posterior is straight.

Data may determine a product of two parameters and hardly one of its factors. The posterior is then a ridge: long in
the one parameter, narrow across, and curved. A normal density about the mode covers only a part of it. Neither R-hat
nor the ratios of posterior to proposal at the points of this density show what is missing.

The ridge is followed from the mode along one parameter, the *free* one. At each of its values the most probable values
of all others, their precision and the marginal density (Laplace's approximation) are computed. The new coordinates are
the normal variable of the free parameter's quantile, and the others relative to their most probable values there. The
change of variables is exact for any table; a table that fits poorly only costs proposals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.special import ndtri

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.sampling.bounds import log_probability

#: From vectors (d,) to the gradient (d,) of a log density and to its precision (d, d), the negative second derivative.
Linearise = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

# The ridge is followed to where its density is lower by so many nats, at most so many prior standard deviations from
# the prior mean, in at most so many steps to each side.
DEEP, REACH, MOST_STEPS = 20.0, 6.0, 60
# Largest step in prior standard deviations; change of the log density below which the next step is twice as long.
LONGEST, FLAT = 0.4, 0.7
# Newton steps at each value of the free parameter, and the length (in standard deviations) at which they end.
NEWTON, CLOSE = 6, 0.05
# Points of the table of quantiles; normal variable beyond which it goes on as a straight line.
TABLE, FARTHEST = 1001, 5.0
# Largest ratio of a common factor to its most probable value; its prior ends its ridge long before.
LARGEST_RATIO = 20.0


@dataclass(frozen=True, eq=False)
class Ridge:
    """Change of variables along one ridge; r other entries of the vector depend on the free entry.

    The free entry is a function of its normal variable. Each other entry is ``offset + scale * x``, where x is its new
    coordinate, and offset and scale are functions of the free entry.

    Attributes
    ----------
    free : int
        Index of the free entry.
    others : (r,) int array
        Indices of the others.
    standard : (s,) int array
        Those whose new coordinates have standard deviation one, given the free entry; the scale of all others is one.
    ends : (float, float)
        Lowest and highest value of the free entry on the followed ridge; offset and scale are constant beyond.
    quantile : PchipInterpolator
        Free entry as a function of its normal variable, between `edges`.
    edges : (2,) array
        Normal variables beyond which the free entry is a linear function.
    offset, log_scale : CubicSpline
        Functions of the free entry, (r,) each.
    """

    free: int
    others: IntArray
    standard: IntArray
    ends: tuple[float, float]
    quantile: PchipInterpolator
    edges: FloatArray
    offset: CubicSpline
    log_scale: CubicSpline

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Vectors (n, d) from points (n, d) in the new coordinates, and the log determinant of the derivative (n,)."""
        vectors = points.copy()
        vectors[:, self.free], log_derivative = self._value(points[:, self.free])
        offset, log_scale = self._others(vectors[:, self.free])
        vectors[:, self.others] = offset + np.exp(log_scale) * points[:, self.others]
        return vectors, log_derivative + log_scale.sum(axis=1)

    def tangent(self, point: FloatArray) -> FloatArray:
        """Derivative (d, d) of the vector over the new coordinates at a point (d,)."""
        out = np.eye(len(point))
        value, log_slope = self._value(point[[self.free]])
        along, slope = float(np.clip(value, *self.ends)[0]), float(np.exp(log_slope)[0])
        scale = np.exp(self.log_scale(along))
        out[self.free, self.free] = slope
        out[self.others, self.others] = scale
        change = self.offset(along, 1) + self.log_scale(along, 1) * scale * point[self.others]
        out[self.others, self.free] = slope * change
        return out

    def limits(self, z: FloatArray, ends: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Bounds (n, s) of the coordinates `standard`, at normal variables z (n,); `ends` are those of the vector."""
        s = len(self.standard)
        offset, log_scale = (each[:, :s] for each in self._others(self._value(z)[0]))
        low, high = ((each[self.standard] - offset) / np.exp(log_scale) for each in ends)
        return low, high

    def has_limits(self, ends: tuple[FloatArray, FloatArray]) -> bool:
        """Whether an entry with a coordinate in `standard` has a bound."""
        return bool(np.isfinite([each[self.standard] for each in ends]).any())

    def _others(self, value: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Offset and logarithm of the scale (n, r) of the other entries, at values (n,) of the free entry."""
        along = np.clip(value, *self.ends)
        return self.offset(along), self.log_scale(along)

    def _value(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Free entry (n,) from its normal variable (n,), and the log of the derivative."""
        inside = np.clip(z, *self.edges)
        slope = self.quantile(inside, 1)
        return self.quantile(inside) + slope * (z - inside), np.log(slope)


@dataclass(frozen=True, eq=False)
class Ridges:
    """Changes of variables along ridges, one after the other, each with a free entry and scaled entries of its own.

    Attributes
    ----------
    each : tuple of Ridge
        The ridges; without any, points stay as they are.
    """

    each: tuple[Ridge, ...] = ()

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Vectors (n, d) from points (n, d) in the new coordinates, and the log determinant of the derivative (n,)."""
        log_derivative = np.zeros(len(points))
        for ridge in self.each:
            points, more = ridge(points)
            log_derivative = log_derivative + more
        return points, log_derivative

    def tangent(self, point: FloatArray) -> FloatArray:
        """Derivative (d, d) of the vector over the new coordinates at a point (d,)."""
        out = np.eye(len(point))
        for ridge in self.each:
            out = ridge.tangent(point) @ out
            point = ridge(point[None])[0][0]
        return out

    @property
    def standard(self) -> IntArray:
        """Entries (s,) whose new coordinates are independent of all others, with mean zero and variance one."""
        found = [np.append(ridge.standard, ridge.free) for ridge in self.each]
        return np.concatenate([np.zeros(0, dtype=np.intp), *found])


@dataclass(frozen=True, eq=False)
class _Station:
    """The posterior given one value of the free entry.

    Attributes
    ----------
    vector, sd, tangent : (d,) arrays
        Most probable vector, standard deviations about it, and its change with the free entry.
    centre : (d,) array
        The vector; of an entry at a bound, where the normal density would be centred of which the bound cuts off most.
    slope : float
        Derivative of the log density of `vector` over the free entry.
    curvature : float
        Negative second derivative.
    log_volume : float
        Logarithm of the volume of one standard deviation about the vector, where bounds leave a part of the density of
        that part.
    """

    vector: FloatArray
    sd: FloatArray
    tangent: FloatArray
    centre: FloatArray
    slope: float
    curvature: float
    log_volume: float

    @classmethod
    def at(cls, linearise: Linearise, vector: FloatArray, free: int, bounds: tuple[FloatArray, FloatArray]) -> _Station:
        """Find the most probable vector with this free entry by Newton steps from `vector` (d,)."""
        low, high = bounds
        vector = vector.copy()
        rest = np.delete(np.arange(len(vector)), free)
        for _ in range(NEWTON):
            gradient, precision = linearise(vector)
            # An entry at a bound stays there if the density rises beyond it.
            out = ((vector <= low) & (gradient < 0)) | ((vector >= high) & (gradient > 0))
            at = rest[~out[rest]]
            unit = 1 / np.sqrt(np.diag(precision)[at])
            covariance = np.linalg.inv(precision[np.ix_(at, at)] * np.outer(unit, unit)) * np.outer(unit, unit)
            step = covariance @ gradient[at]
            if not np.isfinite(step).all():
                break
            vector[at] = np.clip(vector[at] + step, low[at], high[at])
            if step @ gradient[at] < CLOSE**2:
                break
        across = precision[free, at]
        tangent, sd = np.zeros(len(vector)), np.zeros(len(vector))
        tangent[at], sd[at], tangent[free] = -covariance @ across, np.sqrt(np.diag(covariance)), 1.0
        edge = rest[out[rest]]
        # With the entries that are inside their bounds integrated out.
        coupled = precision[np.ix_(edge, at)]
        sd[edge] = (np.diag(precision)[edge] - np.einsum("ea,ab,eb->e", coupled, covariance, coupled)) ** -0.5
        beyond = (gradient[edge] - coupled @ step) * sd[edge]
        centre = vector.copy()
        centre[edge] += beyond * sd[edge]
        log_volume = 0.5 * float(np.linalg.slogdet(covariance / np.outer(unit, unit))[1]) + float(np.log(unit).sum())
        # An entry at a bound has a density of its own; and of all entries only the part between the bounds counts.
        log_volume += float((np.log(sd[edge]) + 0.5 * beyond**2).sum())
        log_volume += float(log_probability(*((ends[rest] - centre[rest]) / sd[rest] for ends in bounds)).sum())
        curvature = float(precision[free, free] + across @ tangent[at])
        # The slope at the vector before the last step, and its change by this step.
        return cls(vector, sd, tangent, centre, float(gradient[free] - across @ step), curvature, log_volume)


def follow(
    linearise: Linearise,
    vector: FloatArray,
    free: int,
    bounds: tuple[FloatArray, FloatArray],
    prior: tuple[float, float],
    scaled: IntArray,
    moved: IntArray,
) -> Ridge | None:
    """Follow the ridge of a posterior along one entry; None if it cannot be followed.

    Parameters
    ----------
    linearise : callable
        Gradient and precision of the log posterior.
    vector : (d,) array
        The mode.
    free : int
        Index of the free entry.
    bounds : pair of (d,) arrays
        Lowest and highest value of each entry.
    prior : (float, float)
        Prior mean and standard deviation of the free entry.
    scaled, moved : (s,), (c,) int arrays
        Entries that are relative to their most probable value in units of their standard deviation, both given the free
        entry; entries that keep their unit and are only shifted with their most probable value.
    """
    start = _Station.at(linearise, vector, free, bounds)
    stations = [*_side(linearise, start, free, bounds, prior, -1.0)[::-1], start]
    stations += _side(linearise, start, free, bounds, prior, 1.0)
    value = np.array([each.vector[free] for each in stations])
    if len(value) < 4:
        return None
    modes, sd = np.array([each.centre for each in stations]), np.array([each.sd for each in stations])
    moves = np.array([each.vector[moved] for each in stations]) - start.vector[moved]
    offset = CubicSpline(value, np.concatenate([modes[:, scaled], moves], axis=1))
    log_scale = CubicSpline(value, np.concatenate([np.log(sd[:, scaled]), np.zeros(moves.shape)], axis=1))
    profile = CubicSpline(value, [each.slope for each in stations]).antiderivative()
    volume = CubicSpline(value, [each.log_volume for each in stations])
    fine = np.linspace(value[0], value[-1], TABLE)
    z, at = normal_variable(fine, profile(fine) + volume(fine))
    if len(z) < 2:  # nearly all of the density is between two points of the table
        return None
    others = np.concatenate([scaled, moved])
    ends = float(value[0]), float(value[-1])
    return Ridge(free, others, scaled, ends, PchipInterpolator(z, at), z[[0, -1]], offset, log_scale)


def product_ridge(
    vector: FloatArray,
    free: int,
    others: IntArray,
    prior: tuple[float, float],
    priors: Sequence[tuple[float, float]],
) -> Ridge:
    """Ridge along which the products of a factor with 1 + each of some entries stay as they are.

    Data that determine nothing but the products leave the factor to the priors. The new coordinate of each of the
    others is its value where the factor is as at the mode.

    Parameters
    ----------
    vector : (d,) array
        The mode.
    free : int
        Index of the factor, which is not zero at the mode.
    others : (r,) int array
        Indices of the others.
    prior : (float, float)
        Prior mean and standard deviation of the factor.
    priors : sequence of r pairs
        Prior mean and standard deviation of each of the others.
    """
    most = np.log(LARGEST_RATIO)
    ratio = np.exp(np.linspace(-most, most, TABLE))
    if vector[free] < 0:
        ratio = ratio[::-1]  # so that the values increase
    value = vector[free] * ratio
    mean, sd = (np.array(each)[:, None] for each in zip(*priors, strict=True))
    moved = (1 + vector[others][:, None]) / ratio - 1
    log_density = -0.5 * ((value - prior[0]) / prior[1]) ** 2 - 0.5 * (((moved - mean) / sd) ** 2).sum(axis=0)
    # The volume of the others for each volume of the new coordinates.
    log_density -= len(others) * np.log(ratio)
    z, at = normal_variable(value, log_density)
    each = np.ones(len(others))
    offset = CubicSpline(value, (1 / ratio - 1)[:, None] * each)
    log_scale = CubicSpline(value, -np.log(ratio)[:, None] * each)
    ends, none = (float(value[0]), float(value[-1])), np.zeros(0, dtype=np.intp)
    return Ridge(free, others, none, ends, PchipInterpolator(z, at), z[[0, -1]], offset, log_scale)


def _side(
    linearise: Linearise,
    start: _Station,
    free: int,
    bounds: tuple[FloatArray, FloatArray],
    prior: tuple[float, float],
    sign: float,
) -> list[_Station]:
    """Stations to one side of the first one, in their order, to where the density is low."""
    (low, high), (mean, sd) = (ends[free] for ends in bounds), prior
    low, high = max(low, mean - REACH * sd), min(high, mean + REACH * sd)
    step = min(LONGEST * sd, 1 / np.sqrt(max(start.curvature, 1e-300)))
    last, log_density, highest = start, 0.0, 0.0
    out: list[_Station] = []
    while len(out) < MOST_STEPS and highest - log_density < DEEP:
        value = last.vector[free] + sign * step
        if not low < value < high:
            break
        guess = np.clip(last.vector + sign * step * last.tangent, *bounds)
        guess[free] = value
        here = _Station.at(linearise, guess, free, bounds)
        if not (np.isfinite(here.slope) and np.isfinite(here.log_volume)):
            break
        change = 0.5 * sign * step * (last.slope + here.slope) + here.log_volume - last.log_volume
        log_density += change
        highest = max(highest, log_density)
        out.append(here)
        last = here
        if abs(change) < FLAT:
            step = min(2 * step, LONGEST * sd)
    return out


def normal_variable(values: FloatArray, log_density: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normal variables of the quantiles of a density, strictly increasing, and the values to which they belong.

    Only those between `FARTHEST` standard deviations are kept.

    Parameters
    ----------
    values, log_density : (g,) arrays
        Increasing values and the logarithm of the density there, up to a constant.
    """
    density = np.exp(log_density - log_density.max())
    masses = 0.5 * (density[1:] + density[:-1]) * np.diff(values)
    below = np.concatenate([[0.0], np.cumsum(masses)])
    above = np.concatenate([np.cumsum(masses[::-1])[::-1], [0.0]])
    mass = below[-1]
    # From the nearer end, so that tails keep their digits.
    with np.errstate(divide="ignore"):
        z = np.where(below < above, ndtri(below / mass), -ndtri(above / mass))
    near = np.flatnonzero(np.abs(z) < FARTHEST)
    near = near[np.diff(z[near], prepend=-np.inf) > 0]
    return z[near], values[near]
