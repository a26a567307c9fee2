"""Normal approximation of the posterior of a finger with effects."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.density_with_effects import EffectDensity, EffectPosterior
from bayestouch.finger.drift_nodes import DriftNodes
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.linear_chain import linearised_chain
from bayestouch.finger.map_with_effects import posterior_maps
from bayestouch.finger.noise import NoiseShape, Residuals, StandardErrors, first_guess, noise_shape
from bayestouch.finger.prediction_with_effects import EffectPrediction
from bayestouch.finger.sampling import PosteriorMap
from bayestouch.model.added import AddedEffect
from bayestouch.model.columns import seen_columns
from bayestouch.model.fitting import Fitted
from bayestouch.model.joint_drifts import FREE
from bayestouch.model.linear import leaving_bounds, step_within

# Number of Newton steps of the chain's parameters, each with the noise after the previous step, and the parts of a step
# that are tried. A step may raise the cost (half a sum of squares) by as much: far below one standard deviation
# of all parameters together.
STEPS, PARTS, RAISED = 3, (1.0, 0.3, 0.1, 0.03, 0.0), 1.0
# A value of the chain is kept so far inside its bounds, in prior sds.
BESIDE_END = 1e-6
# A map is not usable if the log density at its centre is lower than at the mode by more than this. Where the normal
# approximation is good they differ by a few nats, and chains have found their way from some tens.
LOST = 100.0
# A value at a bound, nearer than this part of its prior sd, is moved to where the log density is lower by at most this
# much; the steps that are tried are the prior sd, halved so many times.
AT_BOUND, LOWER, HALVED = 0.01, 2.0, 12


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
        found, left = self, iter(others)
        while not found.usable and (other := next(left, None)) is not None:
            found = replace(self, to_vectors=other)
        return found

    @property
    def usable(self) -> bool:
        """Whether the map is usable, see `with_usable_map`."""
        least = float(self.density(self.vector[None])[0]) - LOST
        return bool(self.density(self.to_vectors(self.centre[None])[0])[0] > least)

    def off_bounds(self) -> FloatArray:
        """The centre (d,) with each value at a bound moved inside, to where the density is a little lower.

        Readings may depend on the square of a value, as on the breadth of a spectrum. At its bound, zero, they have no
        slope over it, and the linear model says that nothing is known of it. A step inside they have one.
        """
        at, vector = self.posterior.layout, self.vector.copy()
        spread, ends = self.posterior.prior.spread, self.posterior.bounds
        top = float(self.density(vector[None])[0])
        for k in range(at.n_base, at.n_chain):
            to_low, to_high = (abs(float(end[k] - vector[k])) for end in ends)
            if min(to_low, to_high) > AT_BOUND * spread[k]:
                continue
            steps = (1.0 if to_low < to_high else -1.0) * spread[k] * 0.5 ** np.arange(HALVED)
            points = np.tile(vector, (HALVED, 1))
            points[:, k] += steps
            near = np.flatnonzero(self.density(points) > top - LOWER)
            vector[k] += steps[near[0]] if len(near) else 0.0
        return vector


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
    further, further_sd = _further(posterior, added)
    guess = first_guess(posterior.known, prior)
    guess[at.further.start - n :] = further
    # The search starts with small discrepancies: large ones would explain the readings instead of drifts and shared
    # errors.
    missed = slice(at.log_discrepancy.start - n, at.log_discrepancy.stop - n)
    guess[missed] -= 2 * prior.spread[at.log_discrepancy]
    vector = np.concatenate([fitted.vector, guess])
    vector[:n] = np.clip(vector[:n], *_ends_of_chain(posterior))
    shape = None
    for _ in range(STEPS):
        vector, residuals = _stepped(fitted, posterior, vector)
        shape = noise_shape(_own_scatter(posterior, fitted, vector[:n]), prior, vector, residuals)
        shape.mean[at.further.start - n :] = further
        vector[n:] = shape.mean
    assert shape is not None
    fit = _fit_about(fitted, posterior, vector, shape, further_sd)
    # Where every map is lost, a value at a bound is the likely cause. All others stay as they are, to the last bit.
    return fit if fit.usable else _fit_about(fitted, posterior, fit.off_bounds(), shape, further_sd)


def _stepped(fitted: Fitted, posterior: EffectPosterior, vector: FloatArray) -> tuple[FloatArray, Residuals]:
    """A flat vector (d,) after a Newton step of the chain's parameters, and the residuals there.

    The step is shortened where it makes the fit worse. At a bound at which the readings have no slope over a value, as
    over the breadth of a spectrum at zero, the linear model sends this value anywhere.
    """
    n, prior, (low, high) = posterior.layout.n_chain, posterior.prior, _ends_of_chain(posterior)
    linear = linearised_chain(fitted, posterior, vector)
    hessian = linear.hessian + np.diag(prior.spread[:n] ** -2.0)
    margin = BESIDE_END * prior.spread[:n]
    step, _ = step_within(hessian, linear.pull, leaving_bounds(vector[:n], low + margin, high - margin))
    for part in PARTS:
        moved = np.concatenate([np.clip(vector[:n] + part * step, low, high), vector[n:]])
        there = linearised_chain(fitted, posterior, moved, with_residuals=True)
        if there.cost <= linear.cost + RAISED:
            break
    assert there.residuals is not None
    return moved, there.residuals


def _ends_of_chain(posterior: EffectPosterior) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest values (n,) of the chain's parameters, a little inside their bounds."""
    n, (low, high) = posterior.layout.n_chain, posterior.bounds
    margin = BESIDE_END * posterior.prior.spread[:n]
    return low[:n] + margin, high[:n] - margin


def _fit_about(
    fitted: Fitted, posterior: EffectPosterior, vector: FloatArray, shape: NoiseShape, further_sd: FloatArray
) -> EffectFit:
    """Normal approximation about a flat vector (d,), with the best map that is usable there."""
    at, n = posterior.layout, posterior.layout.n_chain
    nodes = DriftNodes.of(fitted.drifts, at, vector, further_sd)
    linear = linearised_chain(fitted, posterior, vector, nodes=nodes)
    hessian = linear.hessian + np.diag(posterior.prior.spread[:n] ** -2.0)
    covariance = np.asarray(np.linalg.inv(hessian), dtype=np.float64)
    maps = posterior_maps(fitted, posterior, vector, covariance, linear, nodes, shape.quantiles, further_sd)
    density = _density_near(posterior, vector, covariance)
    return EffectFit(posterior, vector, covariance, shape, density, next(maps)).with_usable_map(maps)


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
