"""Draws of the calibration parameters of a finger with effects, with emcee."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.bend import Bend
from bayestouch.finger.density_with_effects import EffectDensity, EffectPosterior
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.linear_chain import LinearChain, linearised_chain
from bayestouch.finger.noise import NoiseShape, StandardErrors, first_guess, noise_shape
from bayestouch.finger.prediction_with_effects import EffectPrediction
from bayestouch.finger.sampling import DEAR, NO_RIDGES, THIN, Budget, PosteriorMap, draw_points
from bayestouch.model.added import AddedEffect
from bayestouch.model.columns import seen_columns
from bayestouch.model.fitting import Fitted
from bayestouch.model.joint_drifts import FREE
from bayestouch.model.linear import leaving_bounds, step_within
from bayestouch.model.ridges import ridges_of
from bayestouch.output.progress import Progress
from bayestouch.sampling import BlockDraws
from bayestouch.sampling.ridge import Ridges

# Number of Newton steps of the chain's parameters, each with the noise after the previous step.
STEPS = 3
# A coordinate is at a bound if it is nearer than this many of its standard deviations given all others. The density
# falls steeply from there if its mean without the bound is farther beyond than this many standard deviations: what is
# left of the density is then a third as wide or less, and the others hardly move within it.
REACHED, STEEP = 0.05, 3.0
# A coordinate may reach a bound that is nearer than this many standard deviations.
NEAR = 6.0
# A map is not usable if the log density at its centre is lower than at the mode by more than this. Where the normal
# approximation is good they differ by a few nats, and chains have found their way from some tens.
LOST = 100.0
# Least precision of the prior of a coordinate along a ridge.
LEAST = 1e-3
# With more values no bend is looked for: the number of its terms grows with their square, and with 25 values it takes
# 20 s and saves no step of the chains.
MOST_BENT = 10
# No coordinate is farther from the mode than by so many standard deviations of its prior.
FAR_BY_PRIOR = 6.0
# On a ridge the normal approximation in the new coordinates is worse.
ON_RIDGES = Budget(THIN, enough=0.5)
# With drifts or a correction an evaluation takes milliseconds: one more round of refinement saves more time than it
# takes. With a correction whose columns have more than MANY numbers it takes longer: 15 ms for 16 elements and 468
# touches.
TIED, DEAREST, MANY = Budget((4, 16), enough=0.5), Budget((2, 4), 2, 0.5), 1_000_000


@dataclass(frozen=True, eq=False)
class EffectFit:
    """Normal approximation of the posterior of a finger with effects.

    Attributes
    ----------
    posterior : EffectPosterior
        Data and priors.
    vector : (d,) array
        Centre of the whole flat vector.
    covariance : (n, n) array
        Covariance of the n coordinates of the chain and of the values of its effects, at the centre.
    shape : NoiseShape
        Approximate density of the coordinates of the noise.
    density : EffectDensity
        Exact log posterior, with an evaluator that is fast near the centre.
    to_vectors : PosteriorMap
        Change of variables in which the posterior is close to normal.
    """

    posterior: EffectPosterior
    vector: FloatArray
    covariance: FloatArray
    shape: NoiseShape
    density: EffectDensity
    to_vectors: PosteriorMap

    @property
    def centre(self) -> FloatArray:
        """Centre of the normal approximation in the new variables, (d,)."""
        at = self.posterior.layout
        centre = np.concatenate([np.zeros(at.n_chain), self.shape.centre])
        centre[at.further] = 0.0
        return centre

    def with_usable_map(self, others: Iterable[PosteriorMap]) -> EffectFit:
        """The same, with the first of the other maps that is usable if its own is not; the last one if none is.

        A map is usable if the density at its centre is comparable with that at the mode. Curved ridges, bends and
        parameters at their bounds together may place the centre where the density is zero; every map is exact, but from
        there no chain finds its way.
        """
        least = float(self.density(self.vector[None])[0]) - LOST

        def usable(to_vectors: PosteriorMap) -> bool:
            return bool(self.density(to_vectors(self.centre[None])[0])[0] > least)

        found, left = self.to_vectors, iter(others)
        while not usable(found) and (other := next(left, None)) is not None:
            found = other
        return self if found is self.to_vectors else replace(self, to_vectors=found)


def effect_fit(fitted: Fitted, added: tuple[AddedEffect, ...], posterior: EffectPosterior) -> EffectFit:
    """Normal approximation about the mode of a fit, with the noise as unknown.

    Parameters
    ----------
    fitted : Fitted
        The fit, at fixed noise.
    added : tuple of AddedEffect
        Effects of the fit; only values and standard deviations of drifts and noise effects are used.
    posterior : EffectPosterior
        Data and priors of the fit.
    """
    at, prior, n = posterior.layout, posterior.prior, posterior.layout.n_chain
    low, high = posterior.bounds
    margin = 1e-6 * prior.spread[:n]
    further, further_sd = _further(posterior, added)
    guess = first_guess(posterior.known, prior)
    guess[at.further.start - n :] = further
    # The search starts with small discrepancies: large ones would explain the readings instead of drifts and shared
    # errors.
    missed = slice(at.log_discrepancy.start - n, at.log_discrepancy.stop - n)
    guess[missed] -= 2 * prior.spread[at.log_discrepancy]
    vector = np.concatenate([fitted.vector, guess])
    vector[:n] = np.clip(vector[:n], low[:n] + margin, high[:n] - margin)
    shape = None
    for _ in range(STEPS):
        linear = linearised_chain(fitted, posterior, vector)
        hessian = linear.hessian + np.diag(prior.spread[:n] ** -2.0)
        at_ends = leaving_bounds(vector[:n], low[:n] + 2 * margin, high[:n] - 2 * margin)
        step, _ = step_within(hessian, linear.pull, at_ends)
        vector[:n] = np.clip(vector[:n] + step, low[:n] + margin, high[:n] - margin)
        residuals = linearised_chain(fitted, posterior, vector, with_residuals=True).residuals
        assert residuals is not None
        shape = noise_shape(_own_scatter(posterior, fitted, vector[:n]), prior, vector, residuals)
        shape.mean[at.further.start - n :] = further
        vector[n:] = shape.mean
    assert shape is not None
    linear = linearised_chain(fitted, posterior, vector)
    hessian = linear.hessian + np.diag(prior.spread[:n] ** -2.0)
    covariance = np.asarray(np.linalg.inv(hessian), dtype=np.float64)
    sd = np.sqrt(np.diag(covariance))[: at.n_base]
    room = np.minimum(vector - low, high - vector)[: at.n_base]
    made = partial(
        PosteriorMap,
        known=posterior.known,
        layout=at,
        quantiles=shape.quantiles,
        ends=(low, high),
        first_cut=int(np.append(np.flatnonzero(room < NEAR * sd), at.n_base)[0]),
        further_sd=further_sd,
    )
    plain, ridges = _Start(vector, linear, prior.spread[:n]), _ridges(fitted, posterior, vector, covariance)
    along = _Start.along(ridges, fitted, posterior, vector) if ridges.each else plain
    along = along.with_bounds_reached(ridges, (low, high))
    bent = 0 < at.n_values <= MOST_BENT
    bend = _bend(fitted, posterior, along, ridges, (low, high)) if bent else None
    density = _density_near(posterior, vector, covariance)
    fit = EffectFit(posterior, vector, covariance, shape, density, along.map(made, ridges=ridges, bend=bend))

    def simpler() -> Iterator[PosteriorMap]:
        # Each is made only if the one before it is not usable.
        yield along.map(made, ridges=ridges)
        yield plain.with_bounds_reached(NO_RIDGES, (low, high)).map(made)
        yield plain.uncoupled().map(made)

    return fit.with_usable_map(simpler())


def _density_near(posterior: EffectPosterior, vector: FloatArray, covariance: FloatArray) -> EffectDensity:
    """Exact log posterior, with an evaluator that is fast near a vector (d,)."""
    n = posterior.layout.n_chain
    spread = StandardErrors.of(posterior.known, posterior.layout, vector)
    if posterior.columns is not None:
        # The noise without the discrepancy, whose first guess may be far too large.
        noise = np.exp(vector[posterior.layout.noise]) * np.sqrt(posterior.known.shares)
        posterior = replace(posterior, columns=seen_columns(posterior.columns, noise))
    near = EffectPrediction.of(posterior.model, vector[:n], np.sqrt(np.diag(covariance)), spread.sd)
    return EffectDensity(posterior, near)


@dataclass(frozen=True, eq=False)
class _Start:
    """Centre of the normal approximation in the coordinates along the ridges.

    Attributes
    ----------
    vector : (d,) array
        Centre.
    linear : LinearChain
        The chain linearised there.
    prior_spread : (n,) array
        Standard deviations that the priors have there.
    """

    vector: FloatArray
    linear: LinearChain
    prior_spread: FloatArray

    @classmethod
    def along(cls, ridges: Ridges, fitted: Fitted, posterior: EffectPosterior, vector: FloatArray) -> _Start:
        """The centre of the ridges, from the mode (d,)."""
        n, at = posterior.layout.n_chain, ridges.standard
        vector, spread = vector.copy(), posterior.prior.spread[:n].copy()
        vector[at] = 0.0
        real, _ = ridges(vector[None])
        low, high = posterior.bounds
        real[:, :n] = np.clip(real[:, :n], low[:n], high[:n])
        linear = linearised_chain(fitted, posterior, real[0]).along(ridges.tangent(vector)[:n, :n])
        linear.gradient[:, at] = linear.prior_pull[at] = 0.0
        # Where bounds change along a ridge, its coordinate must be known first: then it is independent of all others.
        linear = linear.without_coupling([ridge.free for ridge in ridges.each if ridge.has_limits((low, high))])
        # What the readings and the prior together say of these coordinates is in the ridges: variances of one.
        spread[at] = 1 / np.sqrt(LEAST)
        data = np.linalg.inv(linear.hessian + np.diag(spread**-2.0))
        spread[at] = 1 / np.sqrt(np.maximum(1 - 1 / np.diag(data)[at], LEAST))
        return cls(vector, linear, spread)

    def map(self, made: Callable[..., PosteriorMap], **options: Any) -> PosteriorMap:
        """The change of variables with this centre, by a function that has the rest of its fields."""
        return made(
            prior_spread=self.prior_spread,
            vector=self.vector,
            precision=self.linear.precision,
            gradient=self.linear.gradient,
            constant=self.linear.constant,
            pull=self.linear.pull,
            **options,
        )

    def uncoupled(self) -> _Start:
        """The same, with all coordinates independent: each is where the mode of the others wants it."""
        return replace(self, linear=self.linear.without_coupling(np.arange(len(self.linear.pull)).tolist()))

    def with_bounds_reached(self, ridges: Ridges, ends: tuple[FloatArray, FloatArray]) -> _Start:
        """The same, with coordinates independent of all others if the density falls steeply from their bound.

        Such a coordinate is at its bound nearly, and the others are where they are for that. The normal density without
        bounds has its mean far beyond the bound, and there the others have moved, too. As the map draws one coordinate
        after the other, those drawn before such a one would be where they are without the bound.
        """
        hessian, pull = self.linear.hessian + np.diag(self.prior_spread**-2.0), self.linear.pull
        n = len(pull)
        entries = np.setdiff1d(np.arange(n), ridges.standard)
        room = np.where(pull < 0, self.vector[:n] - ends[0][:n], ends[1][:n] - self.vector[:n])
        at = entries[room[entries] < REACHED * np.diag(hessian)[entries] ** -0.5]
        rest = np.setdiff1d(np.arange(n), at)
        others = hessian[np.ix_(rest, rest)], hessian[np.ix_(rest, at)]
        precision = np.diag(hessian[np.ix_(at, at)] - others[1].T @ np.linalg.solve(*others))
        steep = np.abs(pull[at]) > STEEP * np.sqrt(precision)
        own = (precision - self.prior_spread[at] ** -2.0) / np.diag(self.linear.hessian)[at]
        return replace(self, linear=self.linear.without_coupling(at[steep].tolist(), np.maximum(own[steep], 0.0)))


def _ridges(fitted: Fitted, posterior: EffectPosterior, vector: FloatArray, covariance: FloatArray) -> Ridges:
    """Ridges of the posterior of the chain and of the values of its effects, with the noise of a vector (d,)."""
    at, n = posterior.layout, posterior.layout.n_chain
    prior_precision = np.diag(posterior.prior.spread[:n] ** -2.0)

    def linearise(chain: FloatArray) -> tuple[FloatArray, FloatArray]:
        linear = linearised_chain(fitted, posterior, np.concatenate([chain, vector[n:]]))
        return linear.pull, linear.hessian + prior_precision

    margin = 1e-6 * posterior.prior.spread[:n]
    low, high = (ends[:n] for ends in posterior.bounds)
    bounds = low + margin, high - margin
    base = np.arange(at.n_base)
    return ridges_of(
        posterior.model.effects, at.n_base, base, linearise, vector[:n], covariance, bounds, with_bounds=True
    )


def _bend(
    fitted: Fitted,
    posterior: EffectPosterior,
    start: _Start,
    ridges: Ridges,
    ends: tuple[FloatArray, FloatArray],
) -> Bend | None:
    """Shift of the other coordinates of the chain by the values of its effects; None if it is nearly linear."""
    at, n, vector = posterior.layout, posterior.layout.n_chain, start.vector
    base, low, high = slice(0, at.n_base), *ends
    margin = 1e-6 * posterior.prior.spread[:n]
    hessian = start.linear.hessian + np.diag(start.prior_spread**-2.0)
    linear_part = -np.linalg.solve(hessian[base, base], hessian[base, at.values])
    # The map shifts its centre by the same step: the bend is what is left.
    middle = vector[:n] + np.linalg.solve(hessian, start.linear.pull)
    along = np.isin(np.arange(n)[at.values], ridges.standard)
    limits = np.where(along, -np.inf, low[at.values]), np.where(along, np.inf, high[at.values])
    # If hardly any reading depends on a value, the normal density may reach to where readings overflow.
    reach, edge = FAR_BY_PRIOR * posterior.prior.spread[:n], np.where(np.arange(n) < at.n_base, margin, 0.0)
    mode = ridges(vector[None])[0][0][:n]
    possible = np.maximum(low[:n] + edge, mode - reach), np.minimum(high[:n] - edge, mode + reach)

    def step(values: FloatArray) -> tuple[FloatArray, float]:
        moved = vector.copy()
        moved[at.values] = values
        moved[base] = middle[base] + linear_part @ (values - middle[at.values])
        moved = ridges(moved[None])[0][0]
        first = moved[base].copy()
        moved[:n] = np.clip(moved[:n], *possible)
        linear = linearised_chain(fitted, posterior, moved)
        precision = linear.hessian[base, base] + np.diag(posterior.prior.spread[base] ** -2.0)
        total = linear.pull[base]
        found = np.linalg.solve(precision, total)
        return moved[base] + found - first, float(np.sqrt(abs(total @ found)))

    covariance = np.asarray(np.linalg.inv(hessian)[at.values, at.values], dtype=np.float64)
    centre = np.clip(middle[at.values], *limits)
    return Bend.of(step, centre, covariance, limits, np.random.default_rng([n, 5]))


def sample_effects(
    fit: EffectFit, draws: int, seed: int, progress: Progress | None = None, moves: Any = None
) -> BlockDraws:
    """Draw flat vectors (see `FlatLayout`) from the exact posterior, as `bayestouch.finger.sampling.sample_fit`."""
    at, density = fit.posterior.layout, fit.density
    covariance = np.eye(at.size)
    covariance[at.n_chain :, at.n_chain :] = fit.shape.covariance
    covariance[at.further, at.further] = np.eye(at.n_further)
    columns, budget = density.posterior.columns, TIED if density.tied else DEAR
    if fit.to_vectors.ridges.each and not density.tied:
        budget = ON_RIDGES
    if columns is not None and columns.size > MANY:
        budget = DEAREST
    return draw_points(density, fit.to_vectors, fit.centre, covariance, draws, seed, progress, moves, budget)


def _further(posterior: EffectPosterior, added: tuple[AddedEffect, ...]) -> tuple[FloatArray, FloatArray]:
    """Coordinates of drifts and noise effects and their standard deviations."""
    by_name = {each.effect.name: each for each in added}
    values, sd = [], []
    for effect in (*(drift for drift, _ in posterior.drifts), *posterior.effects):
        each, drift = by_name[effect.name], effect not in posterior.effects
        for i, parameter in enumerate(effect.parameters[: FREE if drift else None]):
            value, spread = each.coordinate(i, logarithmic=drift or parameter.logarithmic)
            values.append(value)
            sd.append(spread)
    at = posterior.layout
    low, high = (ends[at.further] for ends in posterior.bounds)
    spread_of_prior = posterior.prior.spread[at.further]
    widths = np.where(np.array(sd) > 0, np.array(sd), spread_of_prior)
    margin = 1e-3 * widths
    return np.clip(np.array(values, dtype=np.float64), low + margin, high - margin), widths


def _own_scatter(posterior: EffectPosterior, fitted: Fitted, chain: FloatArray) -> KnownTouches:
    """The touches with the scatter by each element's own noise, without that by effects within touches or on noise."""
    known, some = posterior.known, posterior.known.scatter_dof > 0
    if posterior.noise.effects or posterior.noise.shared:
        return replace(known, scatter=np.where(some, known.scatter_dof * fitted.noise.sd**2, known.scatter))
    samples = posterior.model.predict(chain).samples
    if samples is None:
        return known
    squares = (posterior.noise.squares.about(samples) ** 2).sum(axis=0)
    return replace(known, scatter=np.where(some, squares, known.scatter))
