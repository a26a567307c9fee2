"""Groups of the ArviZ schema that are written on request, for calibrations of fingers without effects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.density import NUMBERS_HELD, FingerDensity
from bayestouch.finger.fit import FingerFit
from bayestouch.finger.layout import FlatPrior
from bayestouch.finger.public import public_draws

#: Arrays by group and variable, (chain, draw, ...).
Requested = dict[str, dict[str, FloatArray]]


def requested_groups(
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
        out["log_prior"] = {name: a.reshape(*shape, *a.shape[1:]) for name, a in _log_prior(fit, flat).items()}
    if "posterior_predictive" in groups:
        rng, held = np.random.default_rng([seed, 6]), max(1, NUMBERS_HELD // likelihood.missing.size)
        again = [density.replicated(flat[first : first + held], rng) for first in range(0, len(flat), held)]
        out["posterior_predictive"] = {"reading": _of_readings(np.concatenate(again), shape)}
    if {"prior", "prior_predictive"} & set(groups):
        rng = np.random.default_rng([seed, 7])
        prior = _prior_draws(likelihood.prior, len(flat), rng)
        if "prior" in groups:
            out["prior"] = public_draws(fit, prior.reshape(vectors.shape))
        if "prior_predictive" in groups:
            prior = _within_reach(fit, prior)
            wide = FingerDensity(likelihood, likelihood.series)
            out["prior_predictive"] = {"reading": _of_readings(wide.replicated(prior, rng), shape)}
    return out


def _of_readings(values: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    return np.asarray(values.reshape(*shape, *values.shape[1:]), dtype=np.float32)


def _log_prior(fit: FingerFit, flat: FloatArray) -> dict[str, FloatArray]:
    """Log prior density of the values (not of their logarithms) by name, (n,) or (n, m)."""
    prior, at = fit.likelihood.prior, fit.likelihood.layout
    values = np.where(prior.logarithmic, np.exp(np.where(prior.logarithmic, flat, 0.0)), flat)
    logs = np.stack([each.log_density(column) for each, column in zip(prior.priors, values.T, strict=True)], axis=-1)
    return {
        "sigma": logs[:, at.sigma],
        "mu": logs[:, at.log_mu],
        "r_s": logs[:, at.depth],
        "theta_s": logs[:, at.angle],
        "response": logs[:, at.response],
        "noise_sd": logs[:, at.noise],
        **({"discrepancy_sd": logs[:, at.missed]} if at.discrepancy else {}),
        "force_noise_sd": logs[:, at.force_noise],
    }


def _prior_draws(prior: FlatPrior, n: int, rng: np.random.Generator) -> FloatArray:
    """Flat vectors (n, d) from the prior."""
    values = np.stack([each.quantile(rng.random(n)) for each in prior.priors], axis=-1)
    return np.where(prior.logarithmic, np.log(np.where(prior.logarithmic, values, 1.0)), values)


def _within_reach(fit: FingerFit, vectors: FloatArray) -> FloatArray:
    """Vectors limited to the range in which the readings are tabulated: four standard deviations of the prior."""
    at, reach, out = fit.likelihood.layout, fit.likelihood.series.reach, vectors.copy()
    out[:, at.sigma] = np.clip(out[:, at.sigma], *reach.sigma)
    out[:, at.log_mu] = np.clip(out[:, at.log_mu], *reach.log_mu)
    out[:, at.depth] = np.minimum(out[:, at.depth], reach.depth)
    return out
