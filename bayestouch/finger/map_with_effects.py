"""Changes of variables in which the posterior of a finger with effects is close to normal, the best one first."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.bend import Bend
from bayestouch.finger.density_with_effects import EffectPosterior
from bayestouch.finger.drift_nodes import DriftNodes
from bayestouch.finger.linear_chain import LinearChain, linearised_chain
from bayestouch.finger.quantiles import QuantileMaps
from bayestouch.finger.sampling import NO_RIDGES, PosteriorMap
from bayestouch.model.fitting import Fitted
from bayestouch.model.ridges import ridges_of
from bayestouch.sampling.ridge import Ridges

# A coordinate is at a bound if it is nearer than this many of its standard deviations given all others. The density
# falls steeply from there if its mean without the bound is farther beyond than this many standard deviations: what is
# left of the density is then a third as wide or less, and the others hardly move within it.
REACHED, STEEP = 0.05, 3.0
# A coordinate may reach a bound that is nearer than this many standard deviations.
NEAR = 6.0
# Least precision of the prior of a coordinate along a ridge.
LEAST = 1e-3
# With more values no bend is looked for: the number of its terms grows with their square, and with 25 values it takes
# 20 s and saves no step of the chains.
MOST_BENT = 10
# No coordinate is farther from the mode than by so many standard deviations of its prior.
FAR_BY_PRIOR = 6.0


def posterior_maps(
    fitted: Fitted,
    posterior: EffectPosterior,
    vector: FloatArray,
    covariance: FloatArray,
    linear: LinearChain,
    nodes: DriftNodes | None,
    quantiles: QuantileMaps | None,
    further_sd: FloatArray,
) -> Iterator[PosteriorMap]:
    """Maps with the same centre, of which each is simpler than the one before; each is made when it is asked for.

    Parameters
    ----------
    fitted, posterior
        The fit, and data and priors.
    vector : (d,) array
        Centre of the whole flat vector.
    covariance : (n, n) array
        Covariance of the n coordinates of the chain and of the values of its effects.
    linear : LinearChain
        The chain linearised at the centre, with these nodes.
    nodes : DriftNodes or None
        Nodes of the values of a drift, if there are any.
    quantiles : QuantileMaps or None
        As of `PosteriorMap`.
    further_sd : (k,) array
        Standard deviations of the values of drifts and noise effects.
    """
    at, prior, n = posterior.layout, posterior.prior, posterior.layout.n_chain
    low, high = posterior.bounds
    sd = np.sqrt(np.diag(covariance))[: at.n_base]
    room = np.minimum(vector - low, high - vector)[: at.n_base]
    made = partial(
        PosteriorMap,
        known=posterior.known,
        layout=at,
        quantiles=quantiles,
        ends=(low, high),
        first_cut=int(np.append(np.flatnonzero(room < NEAR * sd), at.n_base)[0]),
        further_sd=further_sd,
        nodes=nodes,
    )
    plain, ridges = _Start(vector, linear, prior.spread[:n]), _ridges(fitted, posterior, vector, covariance)
    along = _Start.along(ridges, fitted, posterior, vector, nodes) if ridges.each else plain
    along = along.with_bounds_reached(ridges, (low, high))
    bent = 0 < at.n_values <= MOST_BENT
    bend = _bend(fitted, posterior, along, ridges, (low, high)) if bent else None
    yield along.map(made, ridges=ridges, bend=bend)
    yield along.map(made, ridges=ridges)
    yield plain.with_bounds_reached(NO_RIDGES, (low, high)).map(made)
    yield plain.uncoupled().map(made)


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
    def along(
        cls, ridges: Ridges, fitted: Fitted, posterior: EffectPosterior, vector: FloatArray, nodes: DriftNodes | None
    ) -> _Start:
        """The centre of the ridges, from the mode (d,)."""
        n, at = posterior.layout.n_chain, ridges.standard
        vector, spread = vector.copy(), posterior.prior.spread[:n].copy()
        vector[at] = 0.0
        real, _ = ridges(vector[None])
        low, high = posterior.bounds
        real[:, :n] = np.clip(real[:, :n], low[:n], high[:n])
        linear = linearised_chain(fitted, posterior, real[0], nodes=nodes).along(ridges.tangent(vector)[:n, :n])
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
    effects = posterior.model.effects
    return ridges_of(
        effects, at.n_base, base, linearise, vector[:n], covariance, bounds, with_bounds=True, with_products=True
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
