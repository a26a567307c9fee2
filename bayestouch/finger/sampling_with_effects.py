"""Draws of the calibration parameters of a finger with effects, with emcee."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.bend import Bend
from bayestouch.finger.density_with_effects import EffectDensity, EffectPosterior
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.noise import NoiseShape, Residuals, StandardErrors, first_guess, noise_shape
from bayestouch.finger.prediction_with_effects import EffectPrediction
from bayestouch.finger.sampling import DEAR, Budget, PosteriorMap, draw_points
from bayestouch.model.added import AddedEffect
from bayestouch.model.columns import WhiteColumns, seen_columns
from bayestouch.model.fitting import Fitted
from bayestouch.model.linear import Functions
from bayestouch.output.progress import Progress
from bayestouch.sampling import BlockDraws
from bayestouch.sampling.rank_one import inverse_root

# Number of Newton steps of the chain's parameters, each with the noise after the previous step.
STEPS = 3
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
    to_vectors : PosteriorMap
        Change of variables in which the posterior is close to normal.
    """

    posterior: EffectPosterior
    vector: FloatArray
    covariance: FloatArray
    shape: NoiseShape
    to_vectors: PosteriorMap

    def density(self) -> EffectDensity:
        """Exact log posterior, with an evaluator that is fast near the centre."""
        posterior, n = self.posterior, self.posterior.layout.n_chain
        spread = StandardErrors.of(posterior.known, posterior.layout, self.vector)
        sd = np.sqrt(np.diag(self.covariance))
        if posterior.columns is not None:
            # The noise without the discrepancy, whose first guess may be far too large.
            noise = np.exp(self.vector[posterior.layout.noise]) * np.sqrt(posterior.known.shares)
            posterior = replace(posterior, columns=seen_columns(posterior.columns, noise))
        return EffectDensity(posterior, EffectPrediction.of(posterior.model, self.vector[:n], sd, spread.sd))


@dataclass(frozen=True, eq=False)
class _Linear:
    """The chain linearised about a vector, with the contribution of the readings to the posterior; m elements."""

    residuals: Residuals
    precision: FloatArray  # (m, n, n)
    gradient: FloatArray  # (m, n)
    constant: FloatArray | None  # (n, n)
    prior_pull: FloatArray  # (n,)

    @property
    def hessian(self) -> FloatArray:
        total = self.precision.sum(axis=0)
        return np.asarray(total if self.constant is None else total + self.constant)


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
    missed = slice(at.missed.start - n, at.missed.stop - n)
    guess[missed] -= 2 * prior.spread[at.missed]
    vector = np.concatenate([fitted.vector, guess])
    shape = None
    for _ in range(STEPS):
        linear = _linearised(fitted, posterior, vector)
        hessian = linear.hessian + np.diag(prior.spread[:n] ** -2.0)
        step = np.linalg.solve(hessian, linear.gradient.sum(axis=0) + linear.prior_pull)
        vector[:n] = np.clip(vector[:n] + step, low[:n] + margin, high[:n] - margin)
        linear = _linearised(fitted, posterior, vector)
        shape = noise_shape(_own_scatter(posterior, fitted, vector[:n]), prior, vector, linear.residuals)
        shape.mean[at.further.start - n :] = further
        vector[n:] = shape.mean
    assert shape is not None
    linear = _linearised(fitted, posterior, vector)
    hessian = linear.hessian + np.diag(prior.spread[:n] ** -2.0)
    total = linear.gradient.sum(axis=0) + linear.prior_pull
    to_vectors = PosteriorMap(
        known=posterior.known,
        layout=at,
        prior_spread=prior.spread[:n],
        vector=vector,
        quantiles=shape.quantiles,
        precision=linear.precision,
        gradient=linear.gradient,
        constant=linear.constant,
        pull=total,
        ends=(low, high),
        further_sd=further_sd,
        bend=_bend(fitted, posterior, vector, hessian) if at.n_values else None,
    )
    return EffectFit(posterior, vector, np.asarray(np.linalg.inv(hessian), dtype=np.float64), shape, to_vectors)


def _bend(fitted: Fitted, posterior: EffectPosterior, vector: FloatArray, hessian: FloatArray) -> Bend | None:
    """Shift of the other coordinates of the chain by the values of its effects; None if it is nearly linear."""
    at, n = posterior.layout, posterior.layout.n_chain
    base, low, high = slice(0, at.n_base), *posterior.bounds
    margin = 1e-6 * posterior.prior.spread[base]
    linear_part = -np.linalg.solve(hessian[base, base], hessian[base, at.values])

    def step(values: FloatArray) -> tuple[FloatArray, float]:
        moved = vector.copy()
        moved[at.values] = values
        first = vector[base] + linear_part @ (values - vector[at.values])
        moved[base] = np.clip(first, low[base] + margin, high[base] - margin)
        linear = _linearised(fitted, posterior, moved)
        precision = linear.hessian[base, base] + np.diag(posterior.prior.spread[base] ** -2.0)
        total = (linear.gradient.sum(axis=0) + linear.prior_pull)[base]
        found = np.linalg.solve(precision, total)
        return moved[base] + found - first, float(np.sqrt(abs(total @ found)))

    covariance = np.asarray(np.linalg.inv(hessian)[at.values, at.values], dtype=np.float64)
    ends = low[at.values], high[at.values]
    return Bend.of(step, vector[at.values], covariance, ends, np.random.default_rng([n, 5]))


def sample_effects(
    fit: EffectFit, draws: int, seed: int, progress: Progress | None = None, moves: Any = None
) -> BlockDraws:
    """Draw flat vectors (see `FlatLayout`) from the exact posterior, as `bayestouch.finger.sampling.sample_fit`."""
    at, shape = fit.posterior.layout, fit.shape
    n = at.n_chain
    centre = np.concatenate([np.zeros(n), shape.centre])
    covariance = np.eye(at.size)
    covariance[n:, n:] = shape.covariance
    centre[at.further], covariance[at.further, at.further] = 0.0, np.eye(at.n_further)
    density = fit.density()
    columns, budget = density.posterior.columns, TIED if density.tied else DEAR
    if columns is not None and columns.size > MANY:
        budget = DEAREST
    return draw_points(density, fit.to_vectors, centre, covariance, draws, seed, progress, moves, budget)


def _further(posterior: EffectPosterior, added: tuple[AddedEffect, ...]) -> tuple[FloatArray, FloatArray]:
    """Coordinates of drifts and noise effects and their standard deviations."""
    by_name = {each.effect.name: each for each in added}
    values, sd = [], []
    for effect in (*(drift for drift, _ in posterior.drifts), *posterior.effects):
        each, drift = by_name[effect.name], effect not in posterior.effects
        for i, parameter in enumerate(effect.parameters[: 2 if drift else None]):
            logarithmic = drift or parameter.logarithmic
            value, spread = each.values[i], float(np.nan_to_num(each.sd[i]))
            values.append(np.log(value) if logarithmic else value)
            sd.append(spread / value if logarithmic else spread)
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


def _linearised(fitted: Fitted, posterior: EffectPosterior, vector: FloatArray) -> _Linear:
    """The chain linearised about a vector, whitened by the noise at this vector."""
    model, known, at = posterior.model, posterior.known, posterior.layout
    n, m = at.n_chain, at.n_elements
    chain = vector[:n]
    predicted, by_load = model.predict(chain), model.by_load(chain)
    touches, samples = model.derivatives(chain)
    spread = StandardErrors.of(known, at, vector)
    added, counts = posterior.noise.added(vector), np.maximum(known.counts, 1)
    own = np.where(known.missing, 1.0, spread.sd**2)
    more = added.variance(predicted.touches, posterior.noise.peak) / counts
    shared = np.sqrt(added.shared_variance(np.maximum(known.counts.max(axis=1), 1)))[:, None]
    shared = shared * added.together(posterior.noise.peak)
    root = inverse_root(own + more, (by_load * spread.load_sd[:, None], shared), ~known.missing)
    left = np.where(known.missing, 0.0, known.readings) - predicted.touches
    white = np.einsum("tij,dtj->dti", root, touches, optimize=True)
    row = np.einsum("tij,tj->ti", root, np.where(known.missing, 0.0, left))
    functions, spent = None, np.zeros(m)
    if fitted.linear.functions is not None:
        raw = fitted.linear.functions.raw
        functions = Functions.of(raw, WhiteColumns.of(raw, root))
        half = np.linalg.solve(functions.root, functions.white.dense().T)
        spent = _spent(np.asarray(half, dtype=np.float64).reshape(-1, *left.shape), root, own)
        weights = functions.weights(row.reshape(-1, 1))[:, 0]
        left = left - np.tensordot(weights, raw, axes=1)
        row = np.einsum("tij,tj->ti", root, np.where(known.missing, 0.0, left))
    # With functions: of the residuals that they leave, so that the parts of the elements are small, and not only their
    # sum is. The map takes each part in proportion to the precision of its element.
    gradient = np.einsum("itm,tm->mi", white, row)
    if functions is None:
        precision = np.einsum("itm,jtm->mij", white, white, optimize=True)
        constant = None
    else:
        flat = white.reshape(n, -1).T
        inside = functions.without(flat)
        white = inside.T.reshape(white.shape)
        constant, precision = flat.T @ inside, np.zeros((m, n, n))
    if samples is not None:
        assert predicted.samples is not None
        observed = model.known
        sd = np.exp(vector[at.noise]) / np.sqrt(observed.weight)[:, None]
        within = np.where(np.isnan(observed.deviation), 0.0, samples / sd)
        off = np.nan_to_num((observed.deviation - predicted.samples) / sd)
        precision = precision + np.einsum("inm,jnm->mij", within, within, optimize=True)
        gradient = gradient + np.einsum("inm,nm->mi", within, off)
    hessian = precision.sum(axis=0) + np.diag(posterior.prior.spread[:n] ** -2.0)
    covariance = np.linalg.inv(hessian if constant is None else hessian + constant)
    half = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64).T @ white.reshape(n, -1)
    spent = spent + _spent(half.reshape(white.shape), root, own)
    share = np.sqrt(own / (own + more + shared**2))
    there = ~known.missing
    residuals = Residuals(np.where(there, left * share, 0.0), np.where(there, by_load, 0.0), spent)
    pull = (posterior.prior.mean[:n] - chain) / posterior.prior.spread[:n] ** 2
    return _Linear(residuals, precision, gradient, constant, pull)


def _spent(half: FloatArray, root: FloatArray, own: FloatArray) -> FloatArray:
    """Degrees of freedom (m,) of fitted functions in the readings of each element.

    They are the sum over touches of the diagonal of ``D (S⁻¹ - (S + C Cᵀ)⁻¹)``. D is the noise of each reading, S is D
    plus the errors of the loads, and C are the functions.

    Parameters
    ----------
    half : (k, t, m) array
        Whitened functions times the root of the covariance of their weights.
    root : (t, m, m) array
        Whitening matrix of each touch.
    own : (t, m) array
        Variance of each reading by its own noise.
    """
    return np.asarray(((half.transpose(1, 0, 2) @ root) ** 2 * own[:, None]).sum(axis=(0, 1)))
