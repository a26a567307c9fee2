"""Change of variables in which the posterior of a pad is close to standard normal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import ndtr

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.model.ridges import ridges_of
from bayestouch.pad.density import PadDensity
from bayestouch.pad.loose_gains import LooseGains
from bayestouch.pad.quadratic import Quadratic
from bayestouch.pad.shared_terms import SharedTerms
from bayestouch.sampling.bounds import normal_between
from bayestouch.sampling.laplace import solve_lower
from bayestouch.sampling.ridge import Ridges

# If the mode is at a bound, the mean of the normal approximation is at most so many standard deviations beyond it.
FARTHEST = 8.0
# Points at which the entries of elements are solved for: number over that of the functions that are fitted to them, and
# spread over that of the normal approximation.
POINTS, WIDER = 2.0, 1.3
# Largest number of rounds in which the points are moved to the posterior; effective share of the points at which the
# rounds end; powers of the weights that are tried before; relative increase of variances, which keeps them above zero.
MOST_ROUNDS, ENOUGH, POWERS, SLIGHT = 12, 0.25, tuple(0.5 ** np.arange(12)), 1e-6
# A shift is solved for as ``gain * shift`` if the gain is more than so many standard deviations from zero.
FIXED_GAIN = 6.0


@dataclass(frozen=True, eq=False)
class BoundedNormal:
    """Change of variables from standard normal variables to a normal distribution truncated at bounds.

    The entries are computed one after the other, each within its bounds given the earlier entries. The first entry is
    the one that its bounds truncate most. The result is exact if only the first entry is near its bounds.

    Attributes
    ----------
    mean : (k,) array
        Mean of the normal distribution without truncation.
    order : (k,) int array
        Entries in the order in which they are computed.
    root : (k, k) array
        Lower Cholesky factor of the covariance without truncation, in this order.
    low, high : (k,) arrays
        Bounds in this order, infinite where there is no bound.
    """

    mean: FloatArray
    order: IntArray
    root: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, mean: FloatArray, covariance: FloatArray, bounds: tuple[FloatArray, FloatArray]) -> BoundedNormal:
        """The normal distribution with this mean (k,) and covariance (k, k), truncated at bounds, (k,) each."""
        low, high = bounds
        sd = np.sqrt(np.diag(covariance))
        order = np.argsort(ndtr((high - mean) / sd) - ndtr((low - mean) / sd), kind="stable")
        root = np.asarray(np.linalg.cholesky(covariance[np.ix_(order, order)]))
        return cls(mean, order, root, low[order], high[order])

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Vectors (n, k) from standard normal points (n, k), and the log determinant of the derivative (n,)."""
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
    """Change of variables from standard normal variables to the vector of a pad.

    The distribution below is that of the coordinates along the `ridges` of the posterior, which are those of the vector
    itself where there is no ridge.

    The k shared entries (kernel, effects, size and time of drifts) are computed first, within their bounds. Given the
    shared entries, the entries of the elements (gains, offsets and positions) are nearly normal, because readings are
    linear in gains and offsets, and nearly linear in ``gain * shift`` of a position. The mean of the entries of the
    elements, and the Cholesky factor of their precision, are weighted sums of functions of the shared entries.

    Attributes
    ----------
    shared, own : (k,), (q,) int arrays
        Indices of the shared entries of the vector, and of the entries of the elements.
    bounded : BoundedNormal
        Distribution of the shared entries.
    terms : SharedTerms
        Functions of the shared entries, about `bounded.mean`.
    centre : (d,) array
        Mode of the entries of the elements, then `bounded.mean`.
    gain : (d,) int array
        Index of the gain that multiplies a shift; -1 for entries that are not multiplied by a gain.
    step : (c, q) array
        Weights of these functions in the mean of the entries of the elements minus the mode.
    root : (c, q, q) array
        Weights of these functions in the lower Cholesky factor of the precision of the entries of the elements.
    ridges : Ridges
        From the coordinates to the vector.
    loose : LooseGains
        Gains that may be zero, given the places.
    """

    shared: IntArray
    own: IntArray
    bounded: BoundedNormal
    terms: SharedTerms
    centre: FloatArray
    gain: IntArray
    step: FloatArray
    root: FloatArray
    ridges: Ridges
    loose: LooseGains

    @classmethod
    def of(cls, density: PadDensity, seed: int) -> PadPosteriorMap:
        """Fit the weights to solutions for the entries of the elements at several values of the shared entries."""
        mean, covariance = density.approximation(FARTHEST)
        m, dimensions = density.model.pad.position.shape
        loose = LooseGains.of(density, np.sqrt(np.diag(covariance)[:m]))
        mode, d = loose.centred(density.mode), len(mean)
        own, shared = np.arange((2 + dimensions) * m), np.arange((2 + dimensions) * m, d)
        gain = np.full(d, -1)
        fixed = np.flatnonzero(np.abs(mode[:m]) > FIXED_GAIN * np.sqrt(np.diag(covariance)[:m]))
        for axis in range(dimensions):
            gain[(2 + axis) * m + fixed] = fixed
        # The entry is ``gain * shift``: one unit of it is a change of the position by 1/gain.
        unit = np.where(gain >= 0, 1 / np.where(gain >= 0, mode[gain], 1.0), 1.0)[own]
        low, high = (ends[shared] for ends in density.bounds)
        ridges, drifts = _ridges(density, mode, covariance, own), len(density.drifts)
        centre, spread = _along(ridges, mean, covariance, shared)
        count = int(POINTS * SharedTerms.of(centre, spread, drifts)(centre[None]).size)
        rng = np.random.default_rng([seed, 11])
        for _ in range(MOST_ROUNDS):
            wide = BoundedNormal.of(centre, WIDER**2 * spread, (low, high))
            points = rng.standard_normal((count, len(shared)))
            found, log_derivative = wide(points)
            vectors, more = ridges(np.concatenate([np.tile(mode[own], (count, 1)), found], axis=1))
            solved = [_Solved.at(density, each, own, unit) for each in vectors]
            log_weight = np.array([each.log_density for each in solved])
            log_weight += 0.5 * (points**2).sum(axis=1) + log_derivative + more
            if not len(shared) or effective_number(log_weight) >= ENOUGH * count:
                break
            # The posterior is not normal, or far from the points: the next points follow from weighted moments. A power
            # of the weights below one prevents that a few points dominate the moments.
            power = next(p for p in POWERS if effective_number(p * log_weight) >= ENOUGH * count or p == POWERS[-1])
            weight = np.exp(power * (log_weight - log_weight.max()))
            centre = weight @ found / weight.sum()
            spread = (found - centre).T @ (weight[:, None] * (found - centre)) / weight.sum()
            spread += np.diag(SLIGHT * np.diag(spread) + 1e-300)
        terms = SharedTerms.of(centre, spread, drifts)
        fit = np.linalg.pinv(terms(found))
        return cls(
            shared,
            own,
            BoundedNormal.of(centre, spread, (low, high)),
            terms,
            np.concatenate([mode[own], centre]),
            gain,
            np.asarray(fit @ np.array([each.step for each in solved]), dtype=np.float64),
            np.asarray(np.tensordot(fit, np.array([each.root for each in solved]), axes=1), dtype=np.float64),
            ridges,
            loose,
        )

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Vectors (n, d) from standard normal points (n, d), and the log determinant of the derivative (n,).

        Both are NaN for a point so extreme that rounding leaves no number between its bounds.
        """
        vectors = np.empty_like(points)
        k = len(self.shared)
        vectors[:, self.shared], log_derivative = self.bounded(points[:, :k])
        terms = self.terms(vectors[:, self.shared])
        root = np.asarray(np.tensordot(terms, self.root, axes=1), dtype=np.float64)
        about = terms @ self.step
        step = about + solve_lower(root, points[:, k:], transposed=True)
        log_derivative = log_derivative - np.log(np.abs(np.diagonal(root, axis1=1, axis2=2))).sum(axis=1)
        vectors[:, self.own] = self.centre[self.own] + np.where(self.gain[self.own] >= 0, 0.0, step)
        vectors, more = self.ridges(vectors)
        log_derivative = log_derivative + more
        for i in np.flatnonzero(self.gain >= 0):
            gain = vectors[:, self.gain[i]]
            vectors[:, i] += step[:, i] / gain
            log_derivative = log_derivative - np.log(np.abs(gain))
        if len(self.loose.elements):
            vectors, more = self.loose.given_places(vectors, about[:, self.loose.elements])
            log_derivative = log_derivative + more
        return vectors, log_derivative


def _ridges(density: PadDensity, mode: FloatArray, covariance: FloatArray, own: IntArray) -> Ridges:
    """Ridges of the posterior of a pad with effects, from its mode (d,) and covariance (d, d)."""
    model = density.model

    def linearise(vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        about = Quadratic.at(density, vector)
        return about.gradient, about.precision

    # The normal distribution of the shared entries has constant bounds.
    return ridges_of(model.effects, model.n_base, own, linearise, mode, covariance, density.bounds, with_bounds=False)


def _along(ridges: Ridges, mean: FloatArray, covariance: FloatArray, which: IntArray) -> tuple[FloatArray, FloatArray]:
    """Mean and covariance of the entries `which` (k,) of a normal approximation, in the coordinates of the ridges."""
    mean, covariance, at = mean.copy(), covariance.copy(), ridges.standard
    mean[at], covariance[at], covariance[:, at], covariance[at, at] = 0.0, 0.0, 0.0, 1.0
    return mean[which], covariance[np.ix_(which, which)]


@dataclass(frozen=True, eq=False)
class _Solved:
    """Entries of the elements for given shared entries; q entries.

    Attributes
    ----------
    step : (q,) array
        Most probable entries of the elements, minus the mode.
    root : (q, q) array
        Lower Cholesky factor of the precision of the entries of the elements.
    log_density : float
        Log density of the shared entries, up to a constant; the entries of the elements are integrated out.
    """

    step: FloatArray
    root: FloatArray
    log_density: float

    @classmethod
    def at(cls, density: PadDensity, vector: FloatArray, own: IntArray, unit: FloatArray) -> _Solved:
        """Solve for the entries `own` (q,) by one Newton step from `vector` (d,); results are in units `unit` (q,)."""
        about = Quadratic.at(density, vector)
        root = np.asarray(np.linalg.cholesky(about.precision[np.ix_(own, own)] * np.outer(unit, unit)))
        pull = solve_triangular(root, about.gradient[own] * unit, lower=True)
        log_density = float(0.5 * pull @ pull - about.cost - np.log(np.diag(root)).sum())
        return cls(np.asarray(solve_triangular(root.T, pull, lower=False)), root, log_density)


def effective_number(log_weight: FloatArray) -> float:
    """Effective number of weights ``w``, given as logarithms (n,): ``(sum w)² / sum w²``."""
    weight = np.exp(log_weight - log_weight.max())
    return float(weight.sum() ** 2 / (weight**2).sum())
