"""Posterior of the values of a noise effect, by the likelihood of the samples of each touch.

A search for effects estimates the own noise of each element from the second moments of its samples. This estimate is
poor if a few samples have most of the variance. Here the own noise of each element is a further unknown.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.grouping import readings_of_groups, uneven_groups
from bayestouch.effects.effect import Values
from bayestouch.effects.noise import NoiseEffect, Outliers
from bayestouch.model.base import deviation_left
from bayestouch.model.fitting import Fitted
from bayestouch.model.noise import AddedNoise, NoiseModel
from bayestouch.model.noise_search import NoiseCandidate, TouchScatter
from bayestouch.model.observations import Observations
from bayestouch.model.outlier_likelihood import OutlierLikelihood
from bayestouch.model.outliers import RightReadings
from bayestouch.model.whitening import Whitening, spread_of_samples
from bayestouch.sampling.rank_one import DiagonalPlusRankOne, log_density_of_contrasts

# Range of the own variance of an element over the variance of all its noise.
OWN = (0.003, 3.0)
# Step of differences, in prior sd or in logarithms: at most a tenth of a posterior sd.
STEP = 2e-3

# Log likelihood as terms of each element (m,), or as one sum (1,). `Terms` is a function of the values and of the own
# variances (m,); `Parts` is a function of one vector.
Terms = Callable[[Values, FloatArray], FloatArray]
Parts = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class FoundNoise:
    """A noise effect with the posterior of its values; m elements.

    Attributes
    ----------
    effect : NoiseEffect
        The effect.
    values, sd : tuple of float
        Most probable values, and their standard deviations.
    own_sd : (m,) array
        Sd of each element's own noise, without that of the effect, in the unit of the readings.
    """

    effect: NoiseEffect
    values: Values
    sd: Values
    own_sd: FloatArray


def settled_noise(fitted: Fitted, found: NoiseCandidate) -> FoundNoise:
    """Posterior of a noise effect: normal approximation at the mode, with the own noise integrated out.

    Parameters
    ----------
    fitted : Fitted
        The model before the effect was added.
    found : NoiseCandidate
        The effect, with values to start from.
    """
    effect, others = found.effect, fitted.noise.added.adds
    scatter = TouchScatter.of(_as_read(fitted) if others and isinstance(effect, Outliers) else fitted)
    assert scatter is not None, "a candidate was found in repeats"
    scale = scatter.sd * fitted.model.peak
    if others and isinstance(effect, Outliers):
        noise, signal = fitted.noise, fitted.model.predict(fitted.vector).touches
        right = RightReadings(noise.sd, noise.peak, noise.added)
        terms: Terms = OutlierLikelihood.of(scatter, right.added_variance(signal) / scale**2)
    elif effect.added(found.values) and (others or _lacks_readings(fitted.model.known)):
        terms = terms_beside_others(fitted, effect, scale)
    else:
        terms = terms_of(scatter, effect)
    values, sd, own = noise_posterior(terms, effect, found.values, effect.own(scatter, found.values))
    return FoundNoise(effect, values, sd, np.sqrt(own) * scale)


def terms_of(scatter: TouchScatter, effect: NoiseEffect) -> Terms:
    """Log likelihood of the deviations of samples from the mean of their touch.

    k normal deviations count as k - 1 independent samples. This is not valid if wrong readings are part of the mean;
    outliers therefore have a likelihood of their own.
    """
    if isinstance(effect, Outliers):
        return OutlierLikelihood.of(scatter)
    share = scatter.share
    if share is None:
        return lambda values, own: scatter.weight @ effect.terms(scatter, values, own)
    weight = {share.shape[1]: share, 1: scatter.weight[:, None]}

    def terms(values: Values, own: FloatArray) -> FloatArray:
        of_readings = effect.terms(scatter, values, own)
        return np.asarray((weight[of_readings.shape[1]] * of_readings).sum(axis=0))

    return terms


def _as_read(fitted: Fitted) -> Fitted:
    """The same fit, whose samples are whitened by each element's own noise alone.

    An error of an outlier is a share of the peak. In samples that are whitened by a noise that grows with the signal,
    it would be smaller where the signal is large.
    """
    return rewhitened(fitted, fitted.noise.with_(added=AddedNoise()))


def rewhitened(fitted: Fitted, noise: NoiseModel) -> Fitted:
    """The same parameters with another noise, which the samples and means are whitened by; `linear` is as before."""
    model, vector = fitted.model, fitted.vector
    whitening = Whitening.of(model.known, noise, model.predict(vector).touches, model.by_load(vector))
    return replace(fitted, noise=noise, whitening=whitening)


def terms_beside_others(fitted: Fitted, effect: NoiseEffect, scale: FloatArray) -> Terms:
    """The same of an effect that adds noise, where the model may have noise of other effects; their values are kept.

    Readings that are whitened by the noise so far do not have the distribution that `NoiseEffect.terms` describes: an
    error that elements share is smaller there where the signal is large. The variances of all effects add up instead.
    The result is exact also where samples lack single elements. `scale` (m,) is the unit of the own noise.
    """
    observed, predicted = fitted.model.known, fitted.model.predict(fitted.vector)
    deviation = deviation_left(observed.deviation, predicted.samples)
    present = ~np.isnan(deviation) & (observed.means.pure_error_dof > 0)
    deviation = np.where(present, deviation, 0.0)
    uneven = uneven_groups(present, observed.row_touch, observed.n_touches)
    lacks = uneven[observed.row_touch]
    count = readings_of_groups(present, observed.row_touch, observed.n_touches).max(axis=1)[observed.row_touch]
    # k samples have k - 1 independent deviations.
    free = np.where(lacks, 0.0, np.maximum(count - 1, 0) / np.maximum(count, 1))
    group = (np.cumsum(uneven) - 1)[observed.row_touch[lacks]]

    def terms(values: Values, own: FloatArray) -> FloatArray:
        added = replace(fitted.noise.added, **effect.added(values))
        noise = fitted.noise.with_(sd=np.sqrt(own) * scale, added=added)
        spread = spread_of_samples(observed, noise, predicted.touches, present)
        log_variance = np.where(present, 2 * np.log(spread.sd), 0.0).sum(axis=1) + np.log1p(spread.length2)
        squares = spread.squared_distance(deviation)
        if not lacks.any():
            return np.array([-0.5 * (squares.sum() + free @ log_variance)])
        partly = DiagonalPlusRankOne(spread.sd[lacks], spread.direction[lacks])
        exact = log_density_of_contrasts(partly, deviation[lacks], group, int(uneven.sum())).sum()
        return np.array([exact - 0.5 * (squares[~lacks].sum() + free @ log_variance)])

    return terms


def _lacks_readings(observed: Observations) -> bool:
    """Whether samples lack elements that their touch has."""
    present = ~np.isnan(observed.deviation) & (observed.means.pure_error_dof > 0)
    return bool(uneven_groups(present, observed.row_touch, observed.n_touches).any())


def noise_posterior(
    terms: Terms, effect: NoiseEffect, start: Values, own: FloatArray
) -> tuple[Values, Values, FloatArray]:
    """Mode and standard deviations of the values of an effect, and own variances (m,) at the mode.

    Parameters
    ----------
    terms : callable
        Terms of the log likelihood.
    effect : NoiseEffect
        The effect, with the priors of its values.
    start, own : tuple of float, (m,) array
        Values and own variances to start from.
    """
    from scipy.optimize import minimize

    count, parameters = len(effect.parameters), effect.parameters
    _, unit, low, high = np.array([p.normal_prior for p in parameters]).T

    def values_at(x: FloatArray) -> Values:
        return tuple(p.from_unconstrained(float(c)) for p, c in zip(parameters, x[:count] * unit, strict=True))

    def parts(x: FloatArray) -> FloatArray:
        """Terms of the log posterior; the first includes the prior."""
        values = values_at(x)
        prior = 0.0
        for p, value in zip(parameters, values, strict=True):
            # The density of a logarithm is the density of the value times the value.
            prior += float(p.prior.log_density(value)) + (np.log(value) if p.logarithmic else 0.0)
        out = terms(values, np.exp(x[count:]))
        return np.concatenate([out[:1] + prior, out[1:]])

    def descent(x: Any) -> tuple[float, FloatArray]:
        return -float(parts(np.asarray(x)).sum()), -gradient_of(parts, np.asarray(x), moves)

    # Central differences need one step on both sides, differences of gradients need two.
    lowest = np.concatenate([low / unit + 2 * STEP, np.full(len(own), np.log(OWN[0]))])
    highest = np.concatenate([high / unit - 2 * STEP, np.full(len(own), np.log(OWN[1]))])
    begin = [p.to_unconstrained(v) for p, v in zip(parameters, start, strict=True)]
    x = np.clip(np.concatenate([begin / unit, np.log(own)]), lowest, highest)
    moves = moves_of(len(parts(x)), count, len(x))
    bounds: Any = np.column_stack([lowest, highest])
    mode = np.asarray(minimize(descent, x, method="L-BFGS-B", jac=True, bounds=bounds).x)
    # An element without readings has no information on its noise: a very wide prior keeps the matrix regular.
    information = curvature(parts, mode, moves) + 1e-6 * np.eye(len(mode))
    variance = np.diag(np.linalg.inv(information))[:count]
    values = values_at(mode)
    # The sd is at most that of the prior, e.g. for the shape of an effect whose amplitude is zero.
    sd = np.minimum(np.sqrt(np.where(variance > 0, variance, np.inf)), 1.0) * unit
    # The sd of a logarithm times the value is the sd of the value.
    sd = sd * np.where([p.logarithmic for p in parameters], values, 1.0)
    return values, tuple(sd.tolist()), np.exp(mode[count:])


def moves_of(n_parts: int, count: int, size: int) -> FloatArray:
    """Steps of differences (s, d), one coordinate per step.

    Coordinates after the first `count` are in one step if each affects one part only.
    """
    if n_parts == size - count:
        return STEP * np.vstack([np.eye(count, size), np.arange(size) >= count])
    return STEP * np.eye(size)


def gradient_of(parts: Parts, x: FloatArray, moves: FloatArray) -> FloatArray:
    """Gradient (d,) of the sum of parts at x (d,), by central differences along the steps of `moves_of`."""
    differences = [(parts(x + h) - parts(x - h)) / (2 * STEP) for h in moves]
    if len(moves) == len(x):
        return np.array([each.sum() for each in differences])
    return np.concatenate([[each.sum() for each in differences[:-1]], differences[-1]])


def curvature(parts: Parts, x: FloatArray, moves: FloatArray) -> FloatArray:
    """Minus the second derivatives (d, d) of the sum of parts at x (d,)."""
    rows = [(gradient_of(parts, x - h, moves) - gradient_of(parts, x + h, moves)) / (2 * STEP) for h in moves]
    if len(moves) == len(x):
        return np.array(rows)
    count = len(moves) - 1
    out = np.zeros((len(x), len(x)))
    out[:count] = rows[:count]
    out[count:, :count] = out[:count, count:].T
    out[count:, count:] = np.diag(rows[-1][count:])
    return out
