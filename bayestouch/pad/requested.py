"""Fits of pads for the groups of the ArviZ schema that are written on request."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import COORDINATES
from bayestouch.pad.density import NUMBERS_HELD, PadDensity

#: Groups of simulated readings.
PREDICTED = frozenset({"prior_predictive", "posterior_predictive"})


@dataclass(frozen=True, eq=False)
class PadGroups:
    """A pad as a `bayestouch.model.requested.PosteriorOfTouches`.

    With an empirical map, the likelihood of a touch is that given all other touches.

    Attributes
    ----------
    density : PadDensity
        Posterior density; without effects if `PREDICTED` groups are asked for.
    """

    density: PadDensity

    def touch_log_likelihood(self, vectors: FloatArray) -> FloatArray:
        """See `PosteriorOfTouches`."""
        return self.density.touch_log_likelihood(vectors)

    def log_priors(self, vectors: FloatArray) -> dict[str, FloatArray]:
        """See `PosteriorOfTouches`."""
        columns = np.moveaxis(self.density.values(vectors), -1, 0)
        logs = [prior.log_density(column) for prior, column in zip(self.density.priors, columns, strict=True)]
        return by_name(self.density, np.stack(logs, axis=-1))

    def prior_draws(self, n: int, rng: np.random.Generator) -> FloatArray:
        """See `PosteriorOfTouches`."""
        logarithmic = self.density.logarithmic
        values = np.stack([prior.quantile(rng.random(n)) for prior in self.density.priors], axis=-1)
        return np.where(logarithmic, np.log(np.where(logarithmic, values, 1.0)), values)

    def named(self, vectors: FloatArray) -> dict[str, FloatArray]:
        """See `PosteriorOfTouches`."""
        return by_name(self.density, self.density.values(vectors))

    def replicated(self, vectors: FloatArray, rng: np.random.Generator, *, from_prior: bool) -> FloatArray:
        """See `PosteriorOfTouches`."""
        return replicated(self.density, vectors, rng, learned=not from_prior)


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
