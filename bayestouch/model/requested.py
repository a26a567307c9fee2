"""Groups of the ArviZ schema that are written on request, for calibrations of any body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.results.schema import Requested, of_readings

# Streams of random numbers beside those of the draws, by purpose.
_AGAIN, _PRIOR = 6, 7


class PosteriorOfTouches(Protocol):
    """What the groups need of the posterior of a calibration from t touches and m elements; n flat vectors (n, d)."""

    def touch_log_likelihood(self, vectors: FloatArray) -> FloatArray:
        """Log density (n, t) of the mean readings of each touch."""
        ...

    def log_priors(self, vectors: FloatArray) -> dict[str, FloatArray]:
        """Log prior density of each parameter by its public name, (n,) or (n, m)."""
        ...

    def prior_draws(self, n: int, rng: np.random.Generator) -> FloatArray:
        """`n` flat vectors from the prior."""
        ...

    def named(self, vectors: FloatArray) -> dict[str, FloatArray]:
        """Parameters by public name, (chain, draw) or (chain, draw, m), from vectors (chain, draw, d)."""
        ...

    def replicated(self, vectors: FloatArray, rng: np.random.Generator, *, from_prior: bool) -> FloatArray:
        """Simulated mean readings (n, t, m) of the same touches; NaN where missing.

        What vectors do not hold, as loads that were not measured, is drawn from the posterior or `from_prior`.
        """
        ...


def groups_of_draws(posterior: PosteriorOfTouches, vectors: FloatArray, groups: Sequence[str], seed: int) -> Requested:
    """Groups of a calibration, among those of `bayestouch.results.schema.GROUPS`.

    ``log_likelihood`` has ``whole_touch`` (chain, draw, t), the log density of the mean readings of each touch.
    ``log_prior`` has the log prior density of each parameter, by its name in `bayestouch.calibrate`. Predictions have
    ``reading`` (chain, draw, t, m).

    Parameters
    ----------
    posterior : PosteriorOfTouches
        The posterior.
    vectors : (chain, draw, d) array
        Draws of the flat vector.
    groups : sequence of str
        Names of the groups.
    seed : int
        Seed of the run.
    """
    flat, shape = vectors.reshape(-1, vectors.shape[-1]), vectors.shape[:2]
    out: Requested = {}
    if "log_likelihood" in groups:
        out["log_likelihood"] = {"whole_touch": posterior.touch_log_likelihood(flat).reshape(*shape, -1)}
    if "log_prior" in groups:
        logs = posterior.log_priors(flat)
        out["log_prior"] = {name: values.reshape(*shape, *values.shape[1:]) for name, values in logs.items()}
    if "posterior_predictive" in groups:
        again = posterior.replicated(flat, np.random.default_rng([seed, _AGAIN]), from_prior=False)
        out["posterior_predictive"] = {"reading": of_readings(again, shape)}
    if {"prior", "prior_predictive"} & set(groups):
        rng = np.random.default_rng([seed, _PRIOR])
        drawn = posterior.prior_draws(len(flat), rng)
        if "prior" in groups:
            out["prior"] = posterior.named(drawn.reshape(vectors.shape))
        if "prior_predictive" in groups:
            again = posterior.replicated(drawn, rng, from_prior=True)
            out["prior_predictive"] = {"reading": of_readings(again, shape)}
    return out
