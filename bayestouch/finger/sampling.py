"""Draws of the calibration parameters of a finger with emcee."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.finger.bend import Bend
from bayestouch.finger.density import FingerDensity
from bayestouch.finger.drift_nodes import DriftNodes
from bayestouch.finger.fit import FingerFit
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatLayout
from bayestouch.finger.quantiles import QuantileMaps
from bayestouch.output.progress import Progress
from bayestouch.sampling import BlockDraws, StudentTProposal
from bayestouch.sampling.attempts import draw_until_good
from bayestouch.sampling.bounds import normal_between
from bayestouch.sampling.laplace import solve_lower
from bayestouch.sampling.refine import ENOUGH, ROUNDS, refined
from bayestouch.sampling.ridge import Ridges

# Degrees of freedom of the Student-t proposal: with heavier tails, few proposals are accepted in eighty dimensions.
PROPOSAL_DOF = 300.0
# Steps per draw that is kept, by attempt: 75 % of proposals are accepted on a finger of 16 elements (83 unknowns). With
# few touches the posterior is less normal, fewer are accepted, and the chains must be longer.
THIN = (4, 16, 48)
# Draws that are made, even if fewer are kept: touches are read with their covariance. With 200 the intervals of touches
# are within 5 % of those with many draws; with 8 they were a third too narrow.
LEAST_DRAWN = 200
# Without ridges, the coordinates are those of the flat vector.
NO_RIDGES = Ridges()
# Number of points that are evaluated together; it limits the memory for their matrices.
POINTS_HELD = 256


@dataclass(frozen=True, eq=False)
class PosteriorMap:
    """Change of variables in which the posterior of a fit is close to normal.

    A point has standard normal variables u instead of the n coordinates of the chain, then the coordinates of the
    noise, with the normal variable of its quantile for each log discrepancy. For given noise, the coordinates of the
    chain are ``x = x(noise) + R(noise)^-T u``; x(noise) and ``R Rᵀ`` are mode and precision of the least-squares fit
    with the readings weighted by this noise. The proposal is thus wider for an element with larger noise.

    Values of effects come last among the coordinates of the chain. In the normal distribution above they are drawn
    first, from the last to the first; each is cut off at its bounds, given those drawn before it. So are the other
    coordinates, down to the first one that may reach a bound, such as a depth at the core. `bend` then shifts
    the other coordinates of the chain to where their mode is given these values. The coordinates of the chain are those
    along the `ridges` of the posterior, which are the coordinates themselves where there is no ridge.

    Attributes
    ----------
    known : KnownTouches
        Touches.
    layout : FlatLayout
        Positions in the flat vector.
    prior_spread : (n,) array
        Prior standard deviations of the coordinates of the chain.
    vector : (d,) array
        Flat vector at which the chain is linearised, in the coordinates along the ridges.
    quantiles : QuantileMaps or None
        Log discrepancies from normal variables.
    precision, gradient : (m, n, n), (m, n) arrays
        Contribution of the readings of each element, with the noise of `vector`.
    constant : (q, n, n) array or None
        Contribution to the precision of readings that drifts or a correction make dependent, at q nodes of the values
        of a drift. Its rows and columns are scaled with the noise of the element; for shared parameters, with the mean
        over elements.
    pull : (n,) array or None
        Gradient of the log posterior at `vector`; None for zero.
    ends : pair of (d,) arrays or None
        Bounds of all entries of the flat vector; None where nothing is cut off.
    first_cut : int
        Coordinates of the chain from this one on are cut off at their bounds.
    further_sd : (k,) array or None
        Standard deviations of the values of drifts and noise effects.
    nodes : DriftNodes or None
        Nodes of the values of a drift, if there are any.
    bend : Bend or None
        Second-order shift of the other coordinates of the chain by the values of its effects.
    ridges : Ridges
        From the coordinates along the ridges to the flat vector.
    """

    known: KnownTouches
    layout: FlatLayout
    prior_spread: FloatArray
    vector: FloatArray
    quantiles: QuantileMaps | None
    precision: FloatArray
    gradient: FloatArray
    constant: FloatArray | None = None
    pull: FloatArray | None = None
    ends: tuple[FloatArray, FloatArray] | None = None
    first_cut: int = 0
    further_sd: FloatArray | None = None
    nodes: DriftNodes | None = None
    bend: Bend | None = None
    ridges: Ridges = NO_RIDGES

    @classmethod
    def of(cls, fit: FingerFit) -> PosteriorMap:
        """Linearise the chain at the mode of a fit without effects."""
        likelihood, mode = fit.likelihood, fit.laplace.mode
        predicted, slope = likelihood.predicted(mode)
        spread = likelihood.standard_errors(fit.vector)
        rows = likelihood.whiten(likelihood.derivatives(mode), slope, spread)
        left = likelihood.whiten(likelihood.known.readings - predicted, slope, spread)
        return cls(
            likelihood.known,
            likelihood.layout,
            likelihood.prior.for_proposals().spread[: likelihood.layout.n_chain],
            fit.vector,
            fit.noise_shape.quantiles,
            np.einsum("itm,jtm->mij", rows, rows, optimize=True),
            np.einsum("itm,tm->mi", rows, left),
        )

    @cached_property
    def _element(self) -> IntArray:
        """Column of the weights in `_map` for each coordinate of the chain: that of its element, or the mean."""
        at = self.layout
        own = np.tile(np.arange(at.n_elements), 3)
        return np.concatenate([own, np.full(at.n_chain - len(own), at.n_elements)])

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Flat vectors (..., d) from points (..., d), and the log of the derivative (...)."""
        flat = points.reshape(-1, points.shape[-1])
        parts = [self._map(flat[first : first + POINTS_HELD]) for first in range(0, len(flat), POINTS_HELD)]
        vectors, log_derivative = (np.concatenate(each) for each in zip(*parts, strict=True))
        return vectors.reshape(points.shape), log_derivative.reshape(points.shape[:-1])

    def _map(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        at, n = self.layout, self.layout.n_chain
        vectors, log_derivative = points.copy(), np.zeros(len(points))
        if self.quantiles is not None:
            vectors[:, at.log_discrepancy], log_derivative = self.quantiles(points[:, at.log_discrepancy])
        if self.further_sd is not None:
            log_derivative = log_derivative + self._place_further(points, vectors)
        weight = self._variance(self.vector[None]) / self._variance(vectors)
        precision = np.tensordot(weight, self.precision, axes=1)
        if self.constant is not None:
            size = np.sqrt(np.column_stack([weight, weight.mean(axis=1)])[:, self._element])
            constant = self.constant
            if self.nodes is not None:
                constant = np.tensordot(self.nodes.weights(vectors), constant, axes=1)
            precision += size[:, :, None] * constant * size[:, None, :]
        index = np.arange(n)
        precision[:, index, index] += self.prior_spread**-2.0
        root = np.asarray(np.linalg.cholesky(precision), dtype=np.float64)
        # R⁻ᵀ (u + R⁻¹ pull) is the sum of the random step and of the shift of the mode.
        pull = (weight - 1) @ self.gradient
        shift = solve_lower(root, np.asarray(pull if self.pull is None else pull + self.pull))
        standard = points[:, :n]
        if self.ends is not None and self.first_cut < n:
            standard, more = self._cut_off(standard, shift, root)
            log_derivative = log_derivative + more
        vectors[:, :n] = self.vector[:n] + solve_lower(root, standard + shift, transposed=True)
        if self.bend is not None:
            vectors[:, : at.n_base] += self.bend(vectors[:, at.values])
        log_derivative = log_derivative - np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
        vectors, more = self.ridges(vectors)
        return vectors, log_derivative + more

    def _cut_off(self, standard: FloatArray, shift: FloatArray, root: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Standard variables that keep coordinates inside their bounds, and the log of the derivative."""
        assert self.ends is not None
        n = self.layout.n_chain
        out, total = standard.copy(), np.zeros(len(standard))
        step = np.zeros(standard.shape)
        limits = self._limits(standard, shift, root)
        for k in reversed(range(self.first_cut, n)):
            rest = np.einsum("nj,nj->n", root[:, k + 1 :, k], step[:, k + 1 :]) - shift[:, k]
            low, high = (root[:, k, k] * (ends[..., k] - self.vector[k]) + rest for ends in limits)
            out[:, k], more = normal_between(standard[:, k], low, high)
            step[:, k] = (out[:, k] - rest) / root[:, k, k]
            total += more
        return out, total

    def _limits(self, standard: FloatArray, shift: FloatArray, root: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Bounds of the coordinates of the chain: (n,), or (points, n) where they change along a ridge."""
        assert self.ends is not None
        n = self.layout.n_chain
        low, high = (ends[:n] for ends in self.ends)
        for ridge in self.ridges.each:
            if ridge.has_limits(self.ends):
                # The normal variable of such a ridge is independent of all others (`_Start.along`): it is known first.
                free = ridge.free
                z = self.vector[free] + (standard[:, free] + shift[:, free]) / root[:, free, free]
                low, high = (np.broadcast_to(ends, (len(z), n)).copy() for ends in (low, high))
                low[:, ridge.standard], high[:, ridge.standard] = ridge.limits(z, self.ends)
        return low, high

    def _place_further(self, points: FloatArray, vectors: FloatArray) -> FloatArray:
        """Write the values of drifts and noise effects into `vectors`, and return the log of the derivative (n,)."""
        assert self.ends is not None and self.further_sd is not None
        at, total = self.layout, np.zeros(len(points))
        for k, sd in zip(range(at.further.start, at.size), self.further_sd, strict=True):
            low, high = ((ends[k] - self.vector[k]) / sd for ends in self.ends)
            z, more = normal_between(points[:, k], np.full(len(points), low), np.full(len(points), high))
            vectors[:, k] = self.vector[k] + sd * z
            total += more + np.log(sd)
        return total

    def _variance(self, vectors: FloatArray) -> FloatArray:
        """Variance (n, m) of the mean of a typical number of readings of each element."""
        known, at = self.known, self.layout
        share = np.full(at.n_elements, 1 / known.typical_reads)
        if at.discrepancy:
            share = share + np.exp(2 * vectors[:, at.log_discrepancy]) / known.typical_reads
        return np.asarray(np.exp(2 * vectors[:, at.noise]) * share)


@dataclass(frozen=True)
class Budget:
    """Limits of the number of evaluations for the draws of a posterior.

    Attributes
    ----------
    thins : tuple of int
        Steps per draw of each attempt.
    rounds, enough : int, float
        As in `bayestouch.sampling.refine.refined`.
    """

    thins: tuple[int, ...] = THIN
    rounds: int = ROUNDS
    enough: float = ENOUGH


# With effects or functions of place evaluations take longer. Two steps per draw are enough if three of four proposals
# are accepted; otherwise six often are.
DEAR = Budget((2, 6, *THIN[1:]))


def sample_fit(
    fit: FingerFit, draws: int, seed: int, progress: Progress | None = None, moves: Any = None
) -> BlockDraws:
    """Draws of flat vectors (see `FlatLayout`) from the exact posterior, as one block; at least `LEAST_DRAWN`.

    With `moves` of emcee (see `bayestouch.sampling.sample_blocks`), ensembles of walkers use the same change of
    variables. The log density of the result is that of the flat vectors.
    """
    density, to_vectors = FingerDensity.of(fit), PosteriorMap.of(fit)
    layout, shape, n = fit.likelihood.layout, fit.noise_shape, fit.likelihood.layout.n_chain
    centre = np.concatenate([np.zeros(n), shape.centre])
    covariance = np.eye(layout.size)
    covariance[n:, n:] = shape.covariance

    budget = Budget() if fit.likelihood.at_places is None else DEAR
    return draw_points(density, to_vectors, centre, covariance, draws, seed, progress, moves, budget)


def draw_points(
    density: Callable[[FloatArray], FloatArray],
    to_vectors: PosteriorMap,
    centre: FloatArray,
    covariance: FloatArray,
    draws: int,
    seed: int,
    progress: Progress | None,
    moves: Any,
    budget: Budget,
) -> BlockDraws:
    """Draw flat vectors, at least `LEAST_DRAWN`, with proposals that are normal in the map `to_vectors`.

    The proposals begin with this centre and covariance. They are refined if the posterior differs from them, as is
    usual with effects.
    """

    def log_density(points: FloatArray, blocks: NDArray[np.intp] | None = None) -> FloatArray:
        vectors, log_derivative = to_vectors(points)
        return density(vectors) + log_derivative

    at, rng = to_vectors.layout, np.random.default_rng([seed, 3])
    # Of the dependences between coordinates, the map leaves out only those between values of drifts and noise effects.
    together = np.arange(at.further.start, at.further.stop)
    centre, covariance = refined(log_density, centre, covariance, together, rng, budget.rounds, budget.enough)
    proposal = StudentTProposal.from_covariance(centre[None], covariance[None], PROPOSAL_DOF)
    return draw_until_good(
        log_density,
        proposal,
        to_vectors,
        draws=max(draws, LEAST_DRAWN),
        seed=seed,
        thins=budget.thins,
        progress=progress,
        moves=moves,
    )
