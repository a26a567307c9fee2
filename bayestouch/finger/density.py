"""Exact posterior density of a finger's calibration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.finger.fit import FingerFit
from bayestouch.finger.known_touches import LEAST_LOAD
from bayestouch.finger.likelihood import FingerLikelihood
from bayestouch.finger.local_series import local_series
from bayestouch.finger.noise import Precisions, log_likelihood_of_scatter
from bayestouch.finger.place.touches import ErrorsWithPlaces
from bayestouch.parallel.parts import of_parts
from bayestouch.sampling.rank_one import (
    AlongError,
    log_density_with_shared_error,
    log_density_with_shared_errors,
    shared_error,
)

# Largest number of values in an array (vectors, touches, elements): half a megabyte, which fits into the cache.
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
        From n vectors to a mask (n,) of those for which `predict` is valid.
    errors : ErrorsWithPlaces or None
        Errors of the readings at the fit; None without functions of place. The independent errors are those of each
        vector. Functions of place and errors of the loads are scaled with them: their ratio is that at the fit.
    """

    likelihood: FingerLikelihood
    predict: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    within: Callable[[FloatArray], NDArray[np.bool_]] = lambda vectors: np.ones(len(vectors), dtype=bool)
    errors: ErrorsWithPlaces | None = None

    @classmethod
    def of(cls, fit: FingerFit) -> FingerDensity:
        """Posterior density of a fit."""
        likelihood = fit.likelihood
        series = likelihood.posterior_series(fit.laplace)
        noise_sd, errors = likelihood.standard_errors(fit.vector).sd, fit.errors_with_places
        distance = None if errors is None else errors.low_rank.squared_distance
        near = local_series(series, fit.laplace.mode, fit.laplace.sd, noise_sd, distance)
        return cls(likelihood, near, series.covers, errors)

    def __call__(self, vectors: FloatArray) -> FloatArray:
        """Log posterior density of vectors, (..., d) to (...), up to a constant; ``-inf`` outside the bounds."""
        flat = vectors.reshape(-1, vectors.shape[-1])
        low, high = self.likelihood.bounds
        out = np.full(len(flat), -np.inf)
        inside = np.flatnonzero(((flat > low) & (flat < high)).all(axis=1) & self.within(flat))
        held = max(1, NUMBERS_HELD // self.likelihood.missing.size)
        parts = [inside[first : first + held] for first in range(0, len(inside), held)]
        for part, found in zip(parts, of_parts(lambda part: self._inside(flat[part]), parts), strict=True):
            out[part] = found
        return out.reshape(vectors.shape[:-1])

    def _inside(self, vectors: FloatArray) -> FloatArray:
        likelihood, known = self.likelihood, self.likelihood.known
        predicted, slope = self.predict(vectors)
        spread = Precisions.of(known, likelihood.layout, vectors)
        left = np.where(likelihood.missing, 0.0, known.readings) - predicted
        if self.errors is not None:
            data = -0.5 * self.errors.low_rank.squared_distance(np.sqrt(spread.weight) * left)
        else:
            # The covariance depends on the prediction, through the error of the load: its determinant is needed.
            of_load = AlongError.of(left, slope, spread.weight)
            data = log_density_with_shared_error(left, spread.weight, of_load, spread.load_sd)
            data = data + log_prior_of_loads(of_load, predicted, spread.load_sd).sum(axis=1)
        data = data + 0.5 * spread.log_weight
        scatter = log_likelihood_of_scatter(known, likelihood.layout, vectors)
        return np.asarray(data + scatter + likelihood.prior.log_density(vectors))

    def touch_log_likelihood(self, vectors: FloatArray) -> FloatArray:
        """Log density (n, t) of the mean readings of each touch, given flat vectors (n, d) and the measured load.

        The true load is integrated out, with the prior of `log_prior_of_loads`. The scatter of repeats about their
        means is not included. Functions of place are drawn given all readings, once for each vector; given these
        functions, touches are independent.
        """
        rng = np.random.default_rng(0)
        known, missing = self.likelihood.known, self.likelihood.missing
        out = np.empty((len(vectors), len(missing)))
        held = max(1, NUMBERS_HELD // missing.size)
        for first in range(0, len(vectors), held):
            part = slice(first, first + held)
            predicted, slope = self.predict(vectors[part])
            spread = Precisions.of(known, self.likelihood.layout, vectors[part])
            weight, shared = spread.weight, slope * spread.load_sd[..., None]
            left = np.where(missing, 0.0, known.readings) - predicted
            left = left - self._drawn_functions(left, weight, rng)
            volume = np.where(missing, 0.0, np.log(2 * np.pi / np.where(missing, 1.0, weight))).sum(axis=-1)
            prior = log_prior_of_loads(AlongError.of(left, slope, weight), predicted, spread.load_sd)
            out[part] = log_density_with_shared_errors(left, shared[None], weight) - 0.5 * volume + prior
        return out

    def replicated(self, vectors: FloatArray, rng: np.random.Generator, *, from_prior: bool = False) -> FloatArray:
        """Simulated mean readings (n, t, m) of the same touches, given flat vectors (n, d); NaN where missing.

        Loads that were not measured and functions of place are those of the posterior given the readings, or with
        `from_prior` those of their priors.
        """
        likelihood, at_places = self.likelihood, self.likelihood.at_places
        predicted, slope = self.predict(vectors)
        spread = likelihood.standard_errors(vectors)
        load = spread.load_sd * rng.standard_normal(slope.shape[:-1])
        unmeasured = likelihood.known.load_reads == 0
        if not from_prior and unmeasured.any():
            mean, sd = self.true_loads(vectors)
            known = mean - likelihood.known.load + sd * rng.standard_normal(slope.shape[:-1])
            load = np.where(unmeasured, known, load)
        if at_places is not None:
            left = np.where(likelihood.missing, 0.0, likelihood.known.readings) - predicted
            weight = Precisions.of(likelihood.known, likelihood.layout, vectors).weight
            drawn = at_places.drawn(len(vectors), rng) if from_prior else self._drawn_functions(left, weight, rng)
            predicted = predicted + drawn - at_places.shift
        again = predicted + slope * load[..., None] + spread.sd * rng.standard_normal(slope.shape)
        return np.where(likelihood.missing, np.nan, again)

    def _drawn_functions(self, left: FloatArray, weight: FloatArray, rng: np.random.Generator) -> FloatArray | float:
        """Random change of the readings (n, t, m) by functions of place, given the residuals `left` (n, t, m)."""
        at_places = self.likelihood.at_places
        if self.errors is None or at_places is None:
            return 0.0
        missing = self.likelihood.missing
        scaled = np.where(missing, 0.0, np.sqrt(weight) * left)
        return at_places.added(self.errors.low_rank.drawn_weights(scaled, rng))

    def true_loads(self, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and standard deviation (n, t) of the true load of each touch in N/m, for vectors (n, d).

        They are those of the linear model, without the factor 1/P of the prior. It would make the mean smaller by the
        variance over the load.
        """
        likelihood, spread = self.likelihood, self.likelihood.standard_errors(vectors)
        predicted, slope = self.predict(vectors)
        left = np.where(likelihood.missing, 0.0, likelihood.known.readings - predicted)
        pull, precision = shared_error(left, slope, spread.sd, spread.load_sd)
        variance = 1 / precision
        return likelihood.known.load + variance * pull, np.sqrt(variance)


def log_prior_of_loads(of_load: AlongError, predicted: FloatArray, load_sd: FloatArray) -> FloatArray:
    """Log (n, t) of the prior 1/P at the true load P of each touch, over that at the load of the prediction.

    With a prior that is flat in P, each touch would pull all gains down: where the load is integrated out it leaves a
    factor ``1/(dy/dP)`` of the readings y, which is larger for smaller gains. A prior that is flat in ``log P`` leaves
    ``1/(P dy/dP)``. For any power of the load this is proportional to ``1/y`` at the true load, and a touch of unknown
    load then says nothing of a common factor of the gains. So the ratio of the loads is taken as that of the readings
    along their derivative over the load: those at the true load over the predicted ones. Where readings are
    proportional to the load the two ratios are equal; for a flat tip, whose readings are about the 0.85th power of the
    load, only this one is free of the pull.

    Parameters
    ----------
    of_load : AlongError
        Sums of readings minus predictions, along the derivative of the prediction over the load in N/m.
    predicted : (n, t, m) array
        Prediction; finite everywhere.
    load_sd : (n, t) array
        Standard deviation of the true load about that of the prediction, N/m, without this prior and the readings.
    """
    along = np.einsum("ntm,ntm->nt", of_load.pulled, predicted)
    step = of_load.rows / (of_load.squares + load_sd**-2.0)
    change = np.divide(of_load.squares * step, along, out=np.zeros_like(along), where=along > 0)
    # Without a least load the prior 1/P has no integral; loads are searched down to the same share.
    return np.asarray(-np.log(np.maximum(1 + change, LEAST_LOAD)))
