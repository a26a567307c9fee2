"""Noise of the readings of a finger and of its force sensor as unknowns of the calibration.

A raw reading of element e has noise ``s_e``, one of the force sensor ``s_F``. The mean of n readings has variance
``s_e² (1/n + τ_e²/ñ)``. ``d_e = τ_e s_e/√ñ`` is the discrepancy (model error) of the element, which averaging does not
reduce; ñ is the typical number of readings of a touch. Without repeats the two cannot be distinguished, and both count
as noise.

Repeats enter by their sums of squares W about the means of touches, with ν degrees of freedom: the likelihood of the
noise has the factor ``s^-ν exp(-W/2s²)``. This is exact, because mean and scatter of normal readings are independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.special import ndtri

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatLayout, FlatPrior
from bayestouch.finger.noise_grid import masses_on_grid
from bayestouch.finger.quantiles import QuantileMaps
from bayestouch.sampling.rank_one import shared_directions

# Grid of the conditional density of the noise, in standard deviations of log s and log τ. Sums over a smooth density
# with steps of half a standard deviation are accurate to 0.1 %.
STEPS = np.linspace(-4.0, 4.0, 17)
LOG_DISCREPANCY_STEP = 0.15
FORCE_STEPS = np.linspace(-6.0, 6.0, 61)


@dataclass(frozen=True, eq=False)
class StandardErrors:
    """Standard errors of mean readings and loads for a vector of parameters.

    Attributes
    ----------
    sd : (t, m) array
        Standard error of each mean reading; ``inf`` where missing.
    load_sd : (t,) array
        Standard deviation of the true load about the measured one, N/m.
    """

    sd: FloatArray
    load_sd: FloatArray

    @classmethod
    def of(cls, known: KnownTouches, layout: FlatLayout, vector: FloatArray) -> StandardErrors:
        """Standard errors for a vector (d,), or for several vectors (n, d), with a leading axis."""
        noise = np.exp(vector[..., layout.noise])
        share = known.shares
        if layout.discrepancy:
            share = share + np.exp(2 * vector[..., None, layout.log_discrepancy]) / known.typical_reads
        return cls(noise[..., None, :] * np.sqrt(share), known.load_sd(np.exp(vector[..., layout.force_noise])))


@dataclass(frozen=True, eq=False)
class Precisions:
    """Precisions of mean readings and errors of loads for n vectors of parameters.

    Attributes
    ----------
    weight : (n, t, m) array
        Inverse variance of each mean reading; 0 where missing.
    log_weight : (n,) array
        Sum of the logarithms of `weight`.
    load_sd : (n, t) array
        As in `StandardErrors`, N/m.
    """

    weight: FloatArray
    log_weight: FloatArray
    load_sd: FloatArray

    @classmethod
    def of(cls, known: KnownTouches, layout: FlatLayout, vectors: FloatArray) -> Precisions:
        """Precisions for vectors (n, d); the logarithms are computed once for each number of readings."""
        log_noise = vectors[:, layout.noise]
        more = np.zeros(log_noise.shape)
        if layout.discrepancy:
            more = np.exp(2 * vectors[:, layout.log_discrepancy]) / known.typical_reads
        share = known.shares + more[:, None]
        weight = np.exp(-2 * log_noise)[:, None] / share
        log_weight = -2 * log_noise @ known.share_counts.sum(axis=0)
        for one, count in zip(known.share_values, known.share_counts, strict=True):
            log_weight = log_weight - np.log(one + more) @ count
        return cls(weight, log_weight, known.load_sd(np.exp(vectors[:, layout.force_noise])))


def log_likelihood_of_scatter(known: KnownTouches, layout: FlatLayout, vectors: FloatArray) -> FloatArray:
    """Log likelihood (...) of the noise in vectors (..., d), from repeats only."""
    noise, force = vectors[..., layout.noise], vectors[..., layout.force_noise]
    tactile = noise @ known.scatter_dof + 0.5 * (np.exp(-2 * noise) @ known.scatter)
    loads = known.force_scatter_dof * force + 0.5 * known.force_scatter * np.exp(-2 * force)
    return np.asarray(-(tactile + loads))


def first_guess(known: KnownTouches, prior: FlatPrior) -> FloatArray:
    """Starting values of the noise coordinates: from repeats if there are any, else from the priors."""
    layout = prior.layout
    guess = prior.mean[layout.n_chain :].copy()
    offset = layout.n_chain
    some = known.scatter_dof > 0
    scatter = np.where(some, known.scatter, 1.0) / np.where(some, known.scatter_dof, 1.0)
    guess[: layout.n_elements] = np.where(some, 0.5 * np.log(scatter), guess[: layout.n_elements])
    if known.force_scatter_dof > 0:
        guess[layout.force_noise - offset] = 0.5 * np.log(known.force_scatter / known.force_scatter_dof)
    return guess


def public_noise(known: KnownTouches, layout: FlatLayout, vectors: FloatArray) -> tuple[FloatArray, ...]:
    """Noise of a reading and discrepancy, (..., m), and noise of the force sensor, (...), from flat vectors."""
    noise = np.exp(vectors[..., layout.noise])
    missed = np.exp(vectors[..., layout.log_discrepancy]) if layout.discrepancy else np.zeros(noise.shape)
    return noise, missed * noise / np.sqrt(known.typical_reads), np.exp(vectors[..., layout.force_noise])


def noise_of(known: KnownTouches, layout: FlatLayout, vectors: FloatArray) -> Noise:
    """Noise at a vector; for several vectors (n, d), the noise with the mean of their variances."""
    noise, missed, force = public_noise(known, layout, np.atleast_2d(vectors))
    tactile, discrepancy = (np.sqrt(np.mean(each**2, axis=0)) for each in (noise, missed))
    return Noise(tactile, discrepancy, 0.0, float(np.sqrt(np.mean(force**2))))


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals of the mean readings in a fit.

    Attributes
    ----------
    left, slope : (t, m) arrays
        Reading minus prediction, and derivative of the prediction over the load; 0 where missing.
    spent : (m,) array
        Degrees of freedom of the parameters that the readings of each element determine.
    added : (t, m) array or float
        Variance that noise effects add to each element's own.
    shared : sequence of (t, m) arrays
        Change of the readings by one sd of each error that noise effects let the elements share; 0 where missing.
    """

    left: FloatArray
    slope: FloatArray
    spent: FloatArray
    added: FloatArray | float = 0.0
    shared: Sequence[FloatArray] = ()


@dataclass(frozen=True, eq=False)
class NoiseShape:
    """Approximate density of the k noise coordinates, for fixed parameters of the chain.

    Attributes
    ----------
    mean : (k,) array
        Means of the coordinates, in the order of the flat vector, beginning with the first noise.
    centre, covariance : (k,) array, (k, k) array
        Mean and covariance after each log discrepancy is replaced by the normal variable of its quantile.
    quantiles : QuantileMaps or None
        Log discrepancies as functions of these variables. Their density is skewed, since readings limit only large
        discrepancies; None without discrepancies.
    """

    mean: FloatArray
    centre: FloatArray
    covariance: FloatArray
    quantiles: QuantileMaps | None


def noise_shape(known: KnownTouches, prior: FlatPrior, vector: FloatArray, residuals: Residuals) -> NoiseShape:
    """Density of the noise by sums over a grid of (log s, log τ) for each element, and of log s_F."""
    layout, m = prior.layout, prior.layout.n_elements
    mean, covariance = vector[layout.n_chain :].copy(), np.zeros((layout.size - layout.n_chain,) * 2)
    held = StandardErrors.of(known, layout, vector)
    weight = np.where(known.missing, 0.0, 1 / (held.sd**2 + residuals.added))
    shared = np.stack([residuals.slope * held.load_sd[:, None], *residuals.shared])
    added = np.broadcast_to(residuals.added, known.missing.shape)
    grids, masses = [], []
    for e in range(m):
        there = ~known.missing[:, e]
        others = np.where(np.arange(m) == e, 0.0, weight[there])
        expected, variance = _from_others(residuals.left[there], shared[:, there], others, e)
        data, spent = (residuals.left[there, e] - expected, variance + added[there, e]), float(residuals.spent[e])
        own = residuals.left[there, e] ** 2 * held.sd[there, e] ** 2
        own = own / (held.sd[there, e] ** 2 + added[there, e] + (shared[1:, there, e] ** 2).sum(axis=0))
        axes, mass = masses_on_grid(
            _axes(known, prior, e, float(own.sum())),
            partial(_element_log_density, known, prior, e, data, spent=spent),
        )
        rows = [e, m + e] if layout.discrepancy else [e]
        mean[rows], covariance[np.ix_(rows, rows)] = _moments(axes, mass)
        if layout.discrepancy:
            missed = mass.sum(axis=0)
            grids.append(axes[1])
            masses.append(missed)
            z = ndtri(np.clip(np.cumsum(missed) - 0.5 * missed, 1e-9, 1 - 1e-9))
            _, covariance[np.ix_(rows, rows)] = _moments([axes[0], z], mass)
    last = layout.force_noise - layout.n_chain
    mean[last], covariance[last, last] = _force_noise(known, prior, residuals, weight)
    centre = mean.copy()
    centre[layout.log_discrepancy.start - layout.n_chain : layout.log_discrepancy.stop - layout.n_chain] = 0.0
    return NoiseShape(mean, centre, covariance, QuantileMaps.of(grids, masses) if layout.discrepancy else None)


def _from_others(
    left: FloatArray, shared: FloatArray, weight: FloatArray, element: int
) -> tuple[FloatArray, FloatArray]:
    """Mean and variance (t,) of what the shared errors do to a reading of one element, by the readings of the others.

    Parameters
    ----------
    left : (t, m) array
        Errors of the readings.
    shared : (q, t, m) array
        Change of the readings by one standard deviation of each shared error.
    weight : (t, m) array
        Inverse variance of the independent errors; zero for the element itself.
    element : int
        The element.
    """
    pulled = np.einsum("tm,qtm->tqm", weight, shared)
    precision = np.einsum("tqm,rtm->tqr", pulled, shared) + np.eye(len(shared))
    own = shared[:, :, element].T
    sides = np.stack([np.einsum("tqm,tm->tq", pulled, left), own], axis=2)
    mean, variance = np.einsum("tq,tqk->kt", own, np.linalg.solve(precision, sides))
    return mean, variance


def _axes(known: KnownTouches, prior: FlatPrior, element: int, squares: float) -> list[FloatArray]:
    """Grid of log s, and of log τ where it is unknown."""
    layout, e = prior.layout, element
    i = layout.n_chain + e
    t = int((~known.missing[:, e]).sum())
    if layout.discrepancy and known.scatter_dof[e] > 0:
        centre, dof = 0.5 * np.log(known.scatter[e] / known.scatter_dof[e]), known.scatter_dof[e]
    elif t > 0 and not layout.discrepancy:
        scatter, dof = known.scatter[e] + squares * known.typical_reads, known.scatter_dof[e] + t
        centre = 0.5 * np.log(max(scatter, 1e-300) / dof)
    else:
        return [axis + prior.mean[i + k * layout.n_elements] for k, axis in enumerate(_prior_axes(prior, i))]
    centre, sd = _with_prior(centre, dof, prior, i)
    # With few degrees of freedom the density has a long tail at large noise.
    axes = [centre + sd * np.concatenate([STEPS, STEPS[-1] + (STEPS[1] - STEPS[0]) * np.arange(1, 9)])]
    if layout.discrepancy:
        j = i + layout.n_elements
        reach = 0.5 * np.log(max(squares, 1e-300) / max(t, 1)) - centre + 0.5 * np.log(known.typical_reads)
        low = min(prior.mean[j] - 4 * prior.spread[j], reach - 1)
        high = max(prior.mean[j] + 3 * prior.spread[j], reach + 2)
        step = min(LOG_DISCREPANCY_STEP, 0.25 / np.sqrt(max(t, 4)) if reach > 1 else LOG_DISCREPANCY_STEP)
        axes.append(np.arange(low, high, step))
    return axes


def _with_prior(log_sd: float, dof: float, prior: FlatPrior, i: int) -> tuple[float, float]:
    """Approximate mean and sd of a logarithm of noise, by its scatter and its prior at the entry i of a vector."""
    precision = 2 * dof + prior.spread[i] ** -2.0
    return float((2 * dof * log_sd + prior.mean[i] * prior.spread[i] ** -2.0) / precision), float(precision**-0.5)


def _prior_axes(prior: FlatPrior, i: int) -> list[FloatArray]:
    places = [i, i + prior.layout.n_elements] if prior.layout.discrepancy else [i]
    return [prior.spread[j] * STEPS for j in places]


def _element_log_density(
    known: KnownTouches,
    prior: FlatPrior,
    element: int,
    data: tuple[FloatArray, FloatArray],
    axes: list[FloatArray],
    spent: float,
) -> FloatArray:
    """Log density of the noise of one element on a grid, for fixed other parameters; shared errors integrated out.

    `data` (t,) are the errors of its readings, less what is expected by the other elements, and the variance by all
    errors but its own noise.
    """
    layout, (left, more) = prior.layout, data
    i = layout.n_chain + element
    log_noise = axes[0].reshape(-1, *([1] * (len(axes) - 1)))
    out = -known.scatter_dof[element] * log_noise - 0.5 * known.scatter[element] * np.exp(-2 * log_noise)
    out = out - 0.5 * ((log_noise - prior.mean[i]) / prior.spread[i]) ** 2
    share = 1 / known.counts[~known.missing[:, element], element]
    if len(axes) == 2:
        j = i + layout.n_elements
        out = out - 0.5 * ((axes[1] - prior.mean[j]) / prior.spread[j]) ** 2
        share = share + np.exp(2 * axes[1])[:, None] / known.typical_reads
    if not len(left):
        return np.asarray(out)
    log_own = 2 * log_noise * len(left) + np.log(share).sum(axis=-1)
    variance = np.exp(2 * log_noise)[..., None] * share + more
    total = (left**2 / variance).sum(axis=-1) + np.log(variance, out=variance).sum(axis=-1)
    # Correction for fitted parameters: they reduce the residuals.
    return np.asarray(out - 0.5 * total + 0.5 * spent * log_own / len(left))


def _moments(axes: list[FloatArray], mass: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean and covariance of a density given by its masses on a grid."""
    flat = np.stack([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")])
    mean = flat @ mass.ravel()
    centred = flat - mean[:, None]
    return mean, (centred * mass.ravel()) @ centred.T


def _force_noise(
    known: KnownTouches, prior: FlatPrior, residuals: Residuals, weight: FloatArray
) -> tuple[float, float]:
    """Mean and variance of log s_F, for fixed other parameters."""
    i = prior.layout.force_noise
    centre, spread = prior.mean[i], prior.spread[i]
    if (dof := known.force_scatter_dof) > 0:
        centre, spread = _with_prior(0.5 * np.log(known.force_scatter / dof), dof, prior, i)
    grid = centre + spread * FORCE_STEPS
    by_load = (residuals.slope**2 * weight).sum(axis=1)
    by_both = (residuals.slope * residuals.left * weight).sum(axis=1)
    if len(residuals.shared):
        along, _ = shared_directions(weight, np.stack(residuals.shared, axis=1))
        pulled = np.einsum("tqm,tm->tq", along, residuals.slope)
        by_load = by_load - (pulled**2).sum(axis=1)
        by_both = by_both - (pulled * np.einsum("tqm,tm->tq", along, residuals.left)).sum(axis=1)
    load_sd = known.load_sd(np.exp(grid))
    a = 1 + load_sd**2 * by_load
    out = 0.5 * ((load_sd * by_both) ** 2 / a - np.log(a)).sum(axis=1)
    out -= known.force_scatter_dof * grid + 0.5 * known.force_scatter * np.exp(-2 * grid)
    out -= 0.5 * ((grid - prior.mean[i]) / prior.spread[i]) ** 2
    mass = np.exp(out - out.max())
    mean, covariance = _moments([grid], mass / mass.sum())
    return float(mean[0]), float(covariance[0, 0])
