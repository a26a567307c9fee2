"""Exact posterior density of a finger's calibration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.finger.fit import FingerFit
from bayestouch.finger.likelihood import FingerLikelihood
from bayestouch.finger.local_series import local_series
from bayestouch.finger.noise import Precisions, log_likelihood_of_scatter
from bayestouch.finger.place.touches import PlacedErrors
from bayestouch.sampling.rank_one import log_density_with_shared_error, shared_error

# Readings of so many touches, elements and vectors are held together: half a megabyte, which stays in cache.
NUMBERS_HELD = 1 << 16


@dataclass(frozen=True, eq=False)
class FingerDensity:
    """Log posterior of the flat vector (see `FlatLayout`).

    Attributes
    ----------
    likelihood : FingerLikelihood
        Touches and priors.
    predict : callable
        Readings (n, t, m) at the measured loads, and their derivative with respect to the load, from n flat vectors.
    within : callable
        Where `predict` holds among n vectors.
    errors : PlacedErrors or None
        Errors of readings at the fit, where functions of place are among them. What these and errors of the loads are
        in units of the independent errors is held at the fit; the independent errors are those of each vector.
    """

    likelihood: FingerLikelihood
    predict: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    within: Callable[[FloatArray], NDArray[np.bool_]] = lambda vectors: np.ones(len(vectors), dtype=bool)
    errors: PlacedErrors | None = None

    @classmethod
    def of(cls, fit: FingerFit) -> FingerDensity:
        """The posterior of a fit."""
        likelihood = fit.likelihood
        series = likelihood.posterior_series(fit.laplace)
        near = local_series(series, fit.laplace.mode, fit.laplace.sd, likelihood.standard_errors(fit.vector).sd)
        return cls(likelihood, near, series.covers, fit.placed_errors)

    def __call__(self, vectors: FloatArray) -> FloatArray:
        """Log posterior density of vectors, (..., d) to (...), up to a constant; ``-inf`` outside the bounds."""
        flat = vectors.reshape(-1, vectors.shape[-1])
        low, high = self.likelihood.bounds
        out = np.full(len(flat), -np.inf)
        inside = np.flatnonzero(((flat > low) & (flat < high)).all(axis=1) & self.within(flat))
        held = max(1, NUMBERS_HELD // self.likelihood.missing.size)
        for first in range(0, len(inside), held):
            part = inside[first : first + held]
            out[part] = self._inside(flat[part])
        return out.reshape(vectors.shape[:-1])

    def _inside(self, vectors: FloatArray) -> FloatArray:
        likelihood, known = self.likelihood, self.likelihood.known
        predicted, slope = self.predict(vectors)
        spread = Precisions.of(known, likelihood.layout, vectors)
        left = np.where(likelihood.missing, 0.0, known.readings) - predicted
        if self.errors is not None:
            data = -0.5 * self.errors.low_rank.squared_distance(np.sqrt(spread.weight) * left)
        else:
            # The load's shared error makes the covariance depend on the prediction: its determinant counts.
            data = log_density_with_shared_error(left, slope, spread.weight, spread.load_sd)
        data = data + 0.5 * spread.log_weight
        scatter = log_likelihood_of_scatter(known, likelihood.layout, vectors)
        return np.asarray(data + scatter + likelihood.prior.log_density(vectors))

    def true_loads(self, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and standard deviation (n, t) of each touch's true load in N/m, given all else (n, d)."""
        likelihood, spread = self.likelihood, self.likelihood.standard_errors(vectors)
        predicted, slope = self.predict(vectors)
        left = np.where(likelihood.missing, 0.0, likelihood.known.readings - predicted)
        pull, precision = shared_error(left, slope, spread.sd, spread.load_sd)
        variance = 1 / precision
        return likelihood.known.load + variance * pull, np.sqrt(variance)
