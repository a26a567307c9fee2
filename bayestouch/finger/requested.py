"""Fits of fingers for the groups of the ArviZ schema that are written on request."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

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
from bayestouch.model.requested import groups_of_draws
from bayestouch.results.schema import Requested
from bayestouch.sampling.rank_one import shared_error


@dataclass(frozen=True, eq=False)
class FitGroups:
    """A fit of a finger without effects as a `bayestouch.model.requested.PosteriorOfTouches`."""

    fit: FingerFit

    @cached_property
    def density(self) -> FingerDensity:
        """Posterior density of the fit."""
        return FingerDensity.of(self.fit)

    def touch_log_likelihood(self, vectors: FloatArray) -> FloatArray:
        """See `PosteriorOfTouches`."""
        return self.density.touch_log_likelihood(vectors)

    def log_priors(self, vectors: FloatArray) -> dict[str, FloatArray]:
        """See `PosteriorOfTouches`."""
        likelihood = self.fit.likelihood
        return _by_name(_log_densities(likelihood.prior, vectors), likelihood.layout)

    def prior_draws(self, n: int, rng: np.random.Generator) -> FloatArray:
        """See `PosteriorOfTouches`."""
        return _prior_draws(self.fit.likelihood.prior, n, rng)

    def named(self, vectors: FloatArray) -> dict[str, FloatArray]:
        """See `PosteriorOfTouches`."""
        return public_draws(self.fit, vectors)

    def replicated(self, vectors: FloatArray, rng: np.random.Generator, *, from_prior: bool) -> FloatArray:
        """See `PosteriorOfTouches`; computed in parts that fit into memory."""
        density, likelihood = self.density, self.fit.likelihood
        if from_prior:
            vectors, density = _within_reach(self.fit, vectors), FingerDensity(likelihood, likelihood.series)
        held = max(1, NUMBERS_HELD // likelihood.missing.size)
        parts = (vectors[first : first + held] for first in range(0, len(vectors), held))
        return np.concatenate([density.replicated(part, rng, from_prior=from_prior) for part in parts])


@dataclass(frozen=True, eq=False)
class EffectFitGroups:
    """A fit of a finger with effects as a `bayestouch.model.requested.PosteriorOfTouches`.

    Readings are simulated without outliers, as the readings that are probably wrong are left out of those of the
    calibration.

    Attributes
    ----------
    fit : EffectFit
        The fit.
    by_name : callable
        See `PosteriorOfTouches.named`.
    """

    fit: EffectFit
    by_name: Callable[[FloatArray], dict[str, FloatArray]]

    def touch_log_likelihood(self, vectors: FloatArray) -> FloatArray:
        """See `PosteriorOfTouches`."""
        return self.fit.density.touch_log_likelihood(vectors)

    def log_priors(self, vectors: FloatArray) -> dict[str, FloatArray]:
        """See `PosteriorOfTouches`."""
        posterior = self.fit.posterior
        logs, at = _log_densities(posterior.prior, vectors), posterior.layout
        named = [(effect.name, p.name) for effect in posterior.model.effects for p in effect.parameters]
        named += [(drift.name, p.name) for drift, _ in posterior.drifts for p in drift.parameters[:2]]
        named += [(effect.name, p.name) for effect in posterior.effects for p in effect.parameters]
        places = [*range(at.n_base, at.n_chain), *range(at.further.start, at.size)]
        own = {f"{effect}_{name}": logs[:, i] for (effect, name), i in zip(named, places, strict=True)}
        return {**_by_name(logs, at), **own}

    def prior_draws(self, n: int, rng: np.random.Generator) -> FloatArray:
        """See `PosteriorOfTouches`."""
        return _prior_draws(self.fit.posterior.prior, n, rng)

    def named(self, vectors: FloatArray) -> dict[str, FloatArray]:
        """See `PosteriorOfTouches`."""
        return self.by_name(vectors)

    def replicated(self, vectors: FloatArray, rng: np.random.Generator, *, from_prior: bool) -> FloatArray:
        """See `PosteriorOfTouches`."""
        return _replicated(self.fit.posterior, vectors, rng, from_prior=from_prior)


def groups_with_effects(
    fit: EffectFit,
    vectors: FloatArray,
    groups: Sequence[str],
    seed: int,
    by_name: Callable[[FloatArray], dict[str, FloatArray]],
) -> Requested:
    """Groups of a calibration with effects, as of `groups_of_draws`; `by_name` as in `EffectFitGroups`.

    Raises
    ------
    InputError
        If likelihoods or predictions are asked for, and the touches are not independent given the parameters (drifts,
        corrections).
    """
    if set(groups) - {"log_prior", "prior"} and fit.density.tied:
        raise InputError(
            "groups: drifts and corrections tie the touches together: they have log_prior and prior, no others"
        )
    return groups_of_draws(EffectFitGroups(fit, by_name), vectors, groups, seed)


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
