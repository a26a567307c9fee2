"""Groups of the ArviZ schema that are written on request, for calibrations of pads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve_triangular

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import COORDINATES
from bayestouch.pad.density import NUMBERS_HELD, PadDensity
from bayestouch.results.schema import Requested, of_readings

#: Groups of simulated readings.
PREDICTED = frozenset({"prior_predictive", "posterior_predictive"})


def groups_of_pad(density: PadDensity, vectors: FloatArray, groups: Sequence[str], seed: int) -> Requested:
    """Groups of a calibration, among those of `bayestouch.results.schema.GROUPS`.

    ``log_likelihood`` has ``whole_touch`` (chain, draw, t), the log density of the mean readings of each touch. With an
    empirical map it is that given all other touches. ``log_prior`` has the log prior density of each parameter.
    Predictions have ``reading`` (chain, draw, t, m).

    Parameters
    ----------
    density : PadDensity
        Posterior density; without effects if `PREDICTED` groups are among the groups.
    vectors : (chain, draw, d) array
        Draws.
    groups : sequence of str
        Names of the groups.
    seed : int
        Seed of the run.
    """
    flat, shape = vectors.reshape(-1, vectors.shape[-1]), vectors.shape[:2]
    out: Requested = {}
    if "log_likelihood" in groups:
        out["log_likelihood"] = {"whole_touch": density.touch_log_likelihood(flat).reshape(*shape, -1)}
    if "log_prior" in groups:
        columns = np.moveaxis(density.values(vectors), -1, 0)
        logs = [prior.log_density(column) for prior, column in zip(density.priors, columns, strict=True)]
        out["log_prior"] = by_name(density, np.stack(logs, axis=-1))
    if "posterior_predictive" in groups:
        again = replicated(density, flat, np.random.default_rng([seed, 6]), learned=True)
        out["posterior_predictive"] = {"reading": of_readings(again, shape)}
    if {"prior", "prior_predictive"} & set(groups):
        rng = np.random.default_rng([seed, 7])
        values = np.stack([prior.quantile(rng.random(len(flat))) for prior in density.priors], axis=-1)
        if "prior" in groups:
            out["prior"] = by_name(density, values.reshape(vectors.shape))
        if "prior_predictive" in groups:
            drawn = np.where(density.logarithmic, np.log(np.where(density.logarithmic, values, 1.0)), values)
            again = replicated(density, drawn, rng, learned=False)
            out["prior_predictive"] = {"reading": of_readings(again, shape)}
    return out


def replicated(density: PadDensity, vectors: FloatArray, rng: np.random.Generator, *, learned: bool) -> FloatArray:
    """Simulated mean readings (n, t, m) of a pad without effects, of the same touches; NaN where missing.

    Given are vectors (n, d). Errors of the loads and noise are new. The weights of the empirical map are drawn from
    what the readings and the vector say of them if `learned`, else from their prior.
    """
    observed = density.fitted.model.known.means.readings
    t, m = observed.shape
    missing = np.isnan(observed)
    whitening = density.fitted.whitening.root + np.where(missing[:, :, None], np.eye(m), 0.0)
    out, some = [], max(1, NUMBERS_HELD // observed.size)
    for first in range(0, len(vectors), some):
        white, _, means = density.whitened(vectors[first : first + some])
        errors = rng.standard_normal(white.shape)
        if density.functions is not None:
            weights = rng.standard_normal((density.functions.white.count, white.shape[1]))
            if learned:
                spread = solve_triangular(density.functions.root.T, weights, lower=False)
                weights = density.functions.weights(white) + spread
            errors = errors + density.functions.white.times(weights)
        again = means + np.moveaxis(np.linalg.solve(whitening, errors.reshape(t, m, -1)), 2, 0)
        out.append(np.where(missing, np.nan, again))
    return np.concatenate(out)


def by_name(density: PadDensity, values: FloatArray) -> dict[str, FloatArray]:
    """Values (..., d) of the entries by name, (...) or (..., m) arrays."""
    m, dimensions = density.model.pad.position.shape
    own = ("gain", "offset", *(f"{axis}_s" for axis in COORDINATES[:dimensions]))
    out = {name: values[..., i * m : (i + 1) * m] for i, name in enumerate(own)}
    first = len(own) * m
    return out | {name: values[..., first + k] for k, name in enumerate(density.names[first:])}
