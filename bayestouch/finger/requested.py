"""Groups of the ArviZ schema that are written on request, for calibrations of fingers without effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import read_once
from bayestouch.errors import InputError
from bayestouch.finger.density import NUMBERS_HELD, FingerDensity
from bayestouch.finger.density_with_effects import EffectPosterior
from bayestouch.finger.fit import FingerFit
from bayestouch.finger.fit_with_effects import EffectFit
from bayestouch.finger.layout import FlatLayout, FlatPrior
from bayestouch.finger.noise import Precisions
from bayestouch.finger.public import public_draws
from bayestouch.results.schema import Requested, of_readings
from bayestouch.sampling.rank_one import shared_error


def groups_without_effects(
    fit: FingerFit,
    vectors: FloatArray,
    groups: Sequence[str],
    seed: int,
) -> Requested:
    """Groups of a calibration, among those of `bayestouch.results.schema.GROUPS`.

    ``log_likelihood`` has ``whole_touch`` (chain, draw, t), the log density of the mean readings of each touch.
    ``log_prior`` has the log prior density of each parameter, by its name in `bayestouch.calibrate`. Predictions have
    ``reading`` (chain, draw, t, m).

    Parameters
    ----------
    fit : FingerFit
        The fit.
    vectors : (chain, draw, d) array
        Draws of the flat vector.
    groups : sequence of str
        Names of the groups.
    seed : int
        Seed of the run.
    """
    if not groups:
        return {}
    density, likelihood = FingerDensity.of(fit), fit.likelihood
    flat, shape = vectors.reshape(-1, vectors.shape[-1]), vectors.shape[:2]
    out: Requested = {}
    if "log_likelihood" in groups:
        out["log_likelihood"] = {"whole_touch": density.touch_log_likelihood(flat).reshape(*shape, -1)}
    if "log_prior" in groups:
        prior = _by_name(_log_densities(likelihood.prior, flat), likelihood.layout)
        out["log_prior"] = {name: a.reshape(*shape, *a.shape[1:]) for name, a in prior.items()}
    if "posterior_predictive" in groups:
        again = _in_parts(density.replicated, flat, np.random.default_rng([seed, 6]), likelihood.missing.size)
        out["posterior_predictive"] = {"reading": of_readings(again, shape)}
    if {"prior", "prior_predictive"} & set(groups):
        rng = np.random.default_rng([seed, 7])
        drawn = _prior_draws(likelihood.prior, len(flat), rng)
        if "prior" in groups:
            out["prior"] = public_draws(fit, drawn.reshape(vectors.shape))
        if "prior_predictive" in groups:
            replicated = partial(FingerDensity(likelihood, likelihood.series).replicated, from_prior=True)
            again = _in_parts(replicated, _within_reach(fit, drawn), rng, likelihood.missing.size)
            out["prior_predictive"] = {"reading": of_readings(again, shape)}
    return out


def _in_parts(
    replicated: Callable[[FloatArray, np.random.Generator], FloatArray],
    vectors: FloatArray,
    rng: np.random.Generator,
    size: int,
) -> FloatArray:
    """Simulated readings (n, t, m) for vectors (n, d), computed in parts that fit into memory; `size` is t times m."""
    held = max(1, NUMBERS_HELD // size)
    return np.concatenate([replicated(vectors[first : first + held], rng) for first in range(0, len(vectors), held)])


def groups_with_effects(
    fit: EffectFit,
    vectors: FloatArray,
    groups: Sequence[str],
    seed: int,
    by_name: Callable[[FloatArray], dict[str, FloatArray]],
) -> Requested:
    """Groups of a calibration with effects, as of `groups_without_effects`.

    `by_name` gives the values of all parameters that are in vectors (chain, draw, d). Readings are simulated without
    outliers, as the readings that are probably wrong are left out of those of the calibration.

    Raises
    ------
    InputError
        If likelihoods or predictions are asked for, and the touches are not independent given the parameters (drifts,
        corrections).
    """
    if not groups:
        return {}
    density, posterior = fit.density, fit.posterior
    if density.tied and set(groups) - {"log_prior", "prior"}:
        raise InputError(
            "groups: drifts and corrections tie the touches together: they have log_prior and prior, no others"
        )
    flat, shape = vectors.reshape(-1, vectors.shape[-1]), vectors.shape[:2]
    out: Requested = {}
    if "log_likelihood" in groups:
        out["log_likelihood"] = {"whole_touch": density.touch_log_likelihood(flat).reshape(*shape, -1)}
    if "posterior_predictive" in groups:
        again = _replicated(posterior, flat, np.random.default_rng([seed, 6]), from_prior=False)
        out["posterior_predictive"] = {"reading": of_readings(again, shape)}
    if {"prior", "prior_predictive"} & set(groups):
        rng = np.random.default_rng([seed, 7])
        drawn = _prior_draws(posterior.prior, len(flat), rng)
        if "prior" in groups:
            out["prior"] = by_name(drawn.reshape(vectors.shape))
        if "prior_predictive" in groups:
            out["prior_predictive"] = {
                "reading": of_readings(_replicated(posterior, drawn, rng, from_prior=True), shape)
            }
    if "log_prior" in groups:
        logs, at = _log_densities(posterior.prior, flat), posterior.layout
        named = [(effect.name, p.name) for effect in posterior.model.effects for p in effect.parameters]
        named += [(drift.name, p.name) for drift, _ in posterior.drifts for p in drift.parameters[:2]]
        named += [(effect.name, p.name) for effect in posterior.effects for p in effect.parameters]
        places = [*range(at.n_base, at.n_chain), *range(at.further.start, at.size)]
        own = {f"{effect}_{name}": logs[:, i] for (effect, name), i in zip(named, places, strict=True)}
        prior = {**_by_name(logs, at), **own}
        out["log_prior"] = {name: a.reshape(*shape, *a.shape[1:]) for name, a in prior.items()}
    return out


def _replicated(
    posterior: EffectPosterior, vectors: FloatArray, rng: np.random.Generator, *, from_prior: bool
) -> FloatArray:
    """Simulated mean readings (n, t, m) of the same touches, given flat vectors (n, d); NaN where missing.

    Loads that were not measured are those of the posterior given the readings, or of the prior with `from_prior`.
    """
    known, noise, at = posterior.known, posterior.noise, posterior.layout
    counts = read_once(known.counts)
    low, high = posterior.bounds
    given = (known.load_reads == 0) & (not from_prior)
    out = np.empty((len(vectors), *known.readings.shape))
    for i, vector in enumerate(np.clip(vectors, low, high)):
        spread = Precisions.of(known, at, vector[None])
        off, load_sd = np.zeros(len(known.load)), spread.load_sd[0]
        if given.any():
            chain = vector[: at.n_chain]
            left = np.where(known.missing, 0.0, known.readings - posterior.model.predict(chain, known.load).touches)
            slope = np.where(known.missing, 0.0, posterior.model.by_load(chain))
            pull, precision = shared_error(left, slope, 1 / np.sqrt(spread.weight[0]), load_sd)
            off, load_sd = np.where(given, pull / precision, 0.0), np.where(given, precision**-0.5, load_sd)
        load = known.load + off + load_sd * rng.standard_normal(len(known.load))
        touches = posterior.model.predict(vector[: at.n_chain], load).touches
        added = noise.added(vector)
        variance = 1 / spread.weight[0] + added.variance(touches, noise.peak) / counts
        shared = noise.shared_errors(added)
        shared = (shared * rng.standard_normal((*shared.shape[:2], 1))).sum(axis=0)
        out[i] = touches + np.sqrt(variance) * rng.standard_normal(touches.shape)
        out[i] += shared
    return np.where(known.missing, np.nan, out)


def _log_densities(prior: FlatPrior, flat: FloatArray) -> FloatArray:
    """Log prior density (n, d) of the values behind the coordinates (n, d), which may be their logarithms."""
    values = np.where(prior.logarithmic, np.exp(np.where(prior.logarithmic, flat, 0.0)), flat)
    return np.stack([each.log_density(column) for each, column in zip(prior.priors, values.T, strict=True)], axis=-1)


def _by_name(logs: FloatArray, at: FlatLayout) -> dict[str, FloatArray]:
    """Parameters of the finger by name, (n,) or (n, m), from an array (n, d)."""
    return {
        "sigma": logs[:, at.sigma],
        "mu": logs[:, at.log_mu],
        "r_s": logs[:, at.depth],
        "theta_s": logs[:, at.angle],
        "response": logs[:, at.response],
        "noise_sd": logs[:, at.noise],
        **({"discrepancy_sd": logs[:, at.log_discrepancy]} if at.discrepancy else {}),
        "force_noise_sd": logs[:, at.force_noise],
    }


def _prior_draws(prior: FlatPrior, n: int, rng: np.random.Generator) -> FloatArray:
    """Flat vectors (n, d) from the prior."""
    values = np.stack([each.quantile(rng.random(n)) for each in prior.priors], axis=-1)
    return np.where(prior.logarithmic, np.log(np.where(prior.logarithmic, values, 1.0)), values)


def _within_reach(fit: FingerFit, vectors: FloatArray) -> FloatArray:
    """Vectors limited to the range in which the readings are tabulated.

    It is four standard deviations of the prior or, if the touches contradict a narrow prior, six of the posterior.
    """
    at, reach, out = fit.likelihood.layout, fit.likelihood.series.reach, vectors.copy()
    out[:, at.sigma] = np.clip(out[:, at.sigma], *reach.sigma)
    out[:, at.log_mu] = np.clip(out[:, at.log_mu], *reach.log_mu)
    out[:, at.depth] = np.minimum(out[:, at.depth], reach.depth)
    return out
