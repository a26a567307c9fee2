"""Change of variables in which the posterior of a pad is close to standard normal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import ndtr

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.pad.density import PadDensity
from bayestouch.sampling.bounds import normal_between
from bayestouch.sampling.laplace import solve_lower

# A mode at a bound: its normal approximation has its own mode at most so many standard deviations beyond.
FARTHEST = 8.0
# Points at which the elements' entries are solved for, for each coefficient of a polynomial through them; how much
# wider than the normal approximation they are spread.
POINTS, WIDER = 2.0, 1.3
# Rounds in which these points are moved to where the posterior is, at most; share of them that count when they are
# there; powers of the weights in between; least spread that stays.
MOST_ROUNDS, ENOUGH, POWERS, SLIGHT = 12, 0.25, tuple(0.5 ** np.arange(12)), 1e-6
# A gain that is so many standard deviations from zero fixes the scale of what a shift of its element does.
FIXED_GAIN = 6.0


@dataclass(frozen=True, eq=False)
class BoundedNormal:
    """Change of variables from standard normal ones to a normal distribution that is cut off at bounds.

    The entry that its bounds cut off most comes first, each one within its bounds given those before it. Where only
    the first comes near its bounds this is the distribution itself.

    Attributes
    ----------
    mean : (k,) array
        Mean of the normal distribution that is cut off.
    order : (k,) int array
        Entries in the order in which they are made.
    root : (k, k) array
        Lower Cholesky factor of its covariance, in this order.
    low, high : (k,) arrays
        Bounds in this order, infinite where there is none.
    """

    mean: FloatArray
    order: IntArray
    root: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, mean: FloatArray, covariance: FloatArray, bounds: tuple[FloatArray, FloatArray]) -> BoundedNormal:
        """The normal distribution of this mean and covariance between bounds."""
        low, high = bounds
        sd = np.sqrt(np.diag(covariance))
        order = np.argsort(ndtr((high - mean) / sd) - ndtr((low - mean) / sd), kind="stable")
        root = np.asarray(np.linalg.cholesky(covariance[np.ix_(order, order)]))
        return cls(mean, order, root, low[order], high[order])

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Vectors (n, k) from points (n, k), and the log of the derivative (n,)."""
        normal, log_derivative = points.copy(), np.full(len(points), float(np.log(np.diag(self.root)).sum()))
        mean = self.mean[self.order]
        for i in np.flatnonzero(np.isfinite(self.low) | np.isfinite(self.high)):
            centre = mean[i] + normal[:, :i] @ self.root[i, :i]
            below, above = ((end[i] - centre) / self.root[i, i] for end in (self.low, self.high))
            normal[:, i], more = normal_between(points[:, i], below, above)
            log_derivative += more
        vectors = np.empty_like(points)
        vectors[:, self.order] = mean + normal @ self.root.T
        return vectors, log_derivative


@dataclass(frozen=True, eq=False)
class PadPosteriorMap:
    """Entries of a pad's vector from standard normal variables, and the log of the derivative.

    The k shared entries, those of the kernel and of effects, come first, between their bounds. Given these the gains,
    offsets and positions are normal: readings are linear in gains and offsets, and near linear in ``gain * shift`` of
    a position. Their mean, and the Cholesky factor of their precision, are polynomials of second order in the shared
    entries.

    Attributes
    ----------
    shared, own : int arrays
        Shared entries of the vector, and those of elements.
    bounded : BoundedNormal
        Of the shared entries.
    scale : (k, k) array
        Inverse of their Cholesky factor: polynomials are in standard units about `bounded.mean`.
    centre : (d,) array
        The mode.
    gain : (d,) int array
        Entry of the gain that multiplies a shift; -1 where none does.
    step : (c, q) array
        Coefficients of the mean of the q entries of elements, less the mode.
    root : (c, q, q) array
        Coefficients of the lower Cholesky factor of their precision.
    """

    shared: IntArray
    own: IntArray
    bounded: BoundedNormal
    scale: FloatArray
    centre: FloatArray
    gain: IntArray
    step: FloatArray
    root: FloatArray

    @classmethod
    def of(cls, density: PadDensity, seed: int) -> PadPosteriorMap:
        """Solve for the entries of elements at some values of the shared ones, about the mode of the fit."""
        mean, covariance = density.approximation(FARTHEST)
        m, dimensions = density.model.pad.position.shape
        mode, d = density.mode, len(mean)
        own, shared = np.arange((2 + dimensions) * m), np.arange((2 + dimensions) * m, d)
        gain = np.full(d, -1)
        fixed = np.flatnonzero(np.abs(mode[:m]) > FIXED_GAIN * np.sqrt(np.diag(covariance)[:m]))
        for axis in range(dimensions):
            gain[(2 + axis) * m + fixed] = fixed
        # A shift times its gain: what a unit of it does is what a unit of the position does, over the gain.
        unit = np.where(gain >= 0, 1 / np.where(gain >= 0, mode[gain], 1.0), 1.0)[own]
        low, high = (ends[shared] for ends in density.bounds)
        centre, spread = mean[shared], covariance[np.ix_(shared, shared)]
        rng, count = np.random.default_rng([seed, 11]), int(POINTS * _terms(np.zeros((1, len(shared)))).shape[1])
        for _ in range(MOST_ROUNDS):
            wide = BoundedNormal.of(centre, WIDER**2 * spread, (low, high))
            points = rng.standard_normal((count, len(shared)))
            found, log_derivative = wide(points)
            solved = [_Solved.at(density, np.concatenate([mode[own], each]), own, unit) for each in found]
            log_weight = np.array([each.log_density for each in solved])
            log_weight += 0.5 * (points**2).sum(axis=1) + log_derivative
            if not len(shared) or effective_number(log_weight) >= ENOUGH * count:
                break
            # Far from normal, or from its mode: the moments of the points by weight, which none of them dominates.
            power = next(p for p in POWERS if effective_number(p * log_weight) >= ENOUGH * count or p == POWERS[-1])
            weight = np.exp(power * (log_weight - log_weight.max()))
            centre = weight @ found / weight.sum()
            spread = (found - centre).T @ (weight[:, None] * (found - centre)) / weight.sum()
            spread += np.diag(SLIGHT * np.diag(spread) + 1e-300)
        scale = np.linalg.inv(np.linalg.cholesky(spread)) if len(shared) else spread
        fit = np.linalg.pinv(_terms((found - centre) @ scale.T))
        return cls(
            shared,
            own,
            BoundedNormal.of(centre, spread, (low, high)),
            np.asarray(scale),
            np.concatenate([mode[own], centre]),
            gain,
            np.asarray(fit @ np.array([each.step for each in solved]), dtype=np.float64),
            np.asarray(np.tensordot(fit, np.array([each.root for each in solved]), axes=1), dtype=np.float64),
        )

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Vectors (n, d) from points (n, d), and the log of the derivative (n,); NaN where there is no such vector."""
        vectors = np.empty_like(points)
        k = len(self.shared)
        vectors[:, self.shared], log_derivative = self.bounded(points[:, :k])
        terms = _terms((vectors[:, self.shared] - self.centre[self.shared]) @ self.scale.T)
        root = np.asarray(np.tensordot(terms, self.root, axes=1), dtype=np.float64)
        step = terms @ self.step + solve_lower(root, points[:, k:], transposed=True)
        log_derivative = log_derivative - np.log(np.abs(np.diagonal(root, axis1=1, axis2=2))).sum(axis=1)
        vectors[:, self.own] = self.centre[self.own] + step
        for i in np.flatnonzero(self.gain >= 0):
            gain = vectors[:, self.gain[i]]
            vectors[:, i] = self.centre[i] + step[:, i] / gain
            log_derivative = log_derivative - np.log(np.abs(gain))
        return vectors, log_derivative


def _terms(x: FloatArray) -> FloatArray:
    """Terms of a polynomial of second order in x (n, k): one, each x, and each product of two; (n, c)."""
    first, second = np.triu_indices(x.shape[1])
    return np.concatenate([np.ones((len(x), 1)), x, x[:, first] * x[:, second]], axis=1)


@dataclass(frozen=True, eq=False)
class _Solved:
    """Entries of elements at one value of the shared ones; q entries.

    Attributes
    ----------
    step : (q,) array
        Their most probable values, less the mode.
    root : (q, q) array
        Lower Cholesky factor of their precision.
    log_density : float
        Log density of the shared entries, these integrated out, up to a constant.
    """

    step: FloatArray
    root: FloatArray
    log_density: float

    @classmethod
    def at(cls, density: PadDensity, vector: FloatArray, own: IntArray, unit: FloatArray) -> _Solved:
        """Solve in units (q,) of the entries."""
        linear = density.linearised(vector)
        root = np.asarray(np.linalg.cholesky(linear.hessian()[np.ix_(own, own)] * np.outer(unit, unit)))
        pull = solve_triangular(root, linear.gradient()[own] * unit, lower=True)
        log_density = float(0.5 * pull @ pull - linear.cost() - np.log(np.diag(root)).sum())
        return cls(np.asarray(solve_triangular(root.T, pull, lower=False)), root, log_density)


def effective_number(log_weight: FloatArray) -> float:
    """Effective number of weights."""
    weight = np.exp(log_weight - log_weight.max())
    return float(weight.sum() ** 2 / (weight**2).sum())
