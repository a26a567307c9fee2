"""Search for noise effects in the scatter of samples about the mean of their touch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.grouping import readings_of_groups
from bayestouch.effects.effect import Values
from bayestouch.effects.noise import NoiseEffect, Scatter
from bayestouch.model.base import deviation_left
from bayestouch.model.fitting import Fitted
from bayestouch.model.significance import normal_score

# Largest number of restarts of a search for a maximum; gain in log likelihood below which it ends.
MOST_SEARCHES, SAME = 4, 0.05


@dataclass(frozen=True, eq=False)
class NoiseCandidate:
    """A noise effect with fitted values.

    Attributes
    ----------
    effect : NoiseEffect
        The effect.
    values : tuple of float
        Most probable values.
    z : float
        Normal score of its likelihood ratio.
    gain : float
        Approximate increase of the log marginal likelihood if the effect is added.
    difference : (t,) array
        Increase of the log density of each touch by the effect, fitted to the other half of the touches.
    """

    effect: NoiseEffect
    values: Values
    z: float
    gain: float
    difference: FloatArray


@dataclass(frozen=True, eq=False)
class TouchScatter(Scatter):
    """Deviations of samples from the mean of their touch; n samples, m elements.

    They are scaled so that their variance is that of the noise.

    Attributes
    ----------
    weight : (n,) array
        Weight of a sample in the log likelihood: k samples have k - 1 independent deviations. It is the mean over the
        elements that the sample has, where these have different numbers of readings in the touch.
    touch : (n,) int array
        Touch of each sample.
    half : (n,) int array
        0 or 1: the half of the touches to which the sample belongs.
    share : (n, m) array or None
        The weight of each reading; None if those of a sample are equal.
    """

    weight: FloatArray
    touch: IntArray
    half: IntArray
    share: FloatArray | None = None

    @property
    def weight_of_readings(self) -> FloatArray:
        """Weight of each reading in the log likelihood, (n, m) or (n, 1)."""
        return self.weight[:, None] if self.share is None else self.share

    def log_density(self, effect: NoiseEffect, values: Values, part: TouchScatter | None = None) -> FloatArray:
        """Log density of each sample under an effect, times its weight, (n,), or of the samples of a `part`.

        The own noise of the elements is always estimated from all samples.
        """
        part = self if part is None else part
        terms = effect.terms(part, values, effect.own(self, values))
        if part.share is None or terms.shape != part.share.shape:
            return np.asarray(terms.sum(axis=1) * part.weight)
        return np.asarray((terms * part.share).sum(axis=1))

    def part(self, rows: NDArray[np.bool_]) -> TouchScatter:
        """Some of the samples."""
        z, signal, weight = self.z[rows], self.signal[rows], self.weight[rows]
        share = None if self.share is None else self.share[rows]
        return replace(
            self, z=z, signal=signal, weight=weight, touch=self.touch[rows], half=self.half[rows], share=share
        )

    @classmethod
    def of(cls, fitted: Fitted) -> TouchScatter | None:
        """Scatter of the touches of a fitted model; None if no touch has repeated samples, or all of them are equal.

        A row without readings is no sample, and k is the number of readings of each element. Elements of a touch that
        have readings in different rows share less of a common error than this assumes: their means are over different
        rows.
        """
        model = fitted.model
        observed, predicted = model.known, model.predict(fitted.vector)
        present = ~np.isnan(observed.deviation)
        count = np.where(
            present, readings_of_groups(present, observed.row_touch, observed.n_touches)[observed.row_touch], 0
        )
        repeated = count.max(axis=1) > 1
        # Samples of an element that are all equal say nothing of its noise.
        told = observed.means.pure_error_dof > 0
        if not repeated.any() or not told.any():
            return None
        rows = np.flatnonzero(repeated)
        share = 1 - 1 / np.maximum(count[rows], 1)
        # Whitened by the noise that the model already has: the search is for further effects.
        deviation = deviation_left(observed.deviation, predicted.samples)
        free = (share > 0) & told
        white = fitted.whitening.samples(deviation)[rows] / np.sqrt(np.where(free, share, 1.0))
        z = np.where(free, white, np.nan)
        # Scaled to variance one for each element: the search is for the shape of the distribution, not its size.
        total = np.maximum((free * share).sum(axis=0), 1e-300)
        size = np.sqrt((np.where(free, z, 0.0) ** 2 * share).sum(axis=0) / total)
        size = np.where(size > 0, size, 1.0)
        touch = observed.row_touch[rows]
        share = np.where(free, share, 0.0)
        # Less than the largest by the mean of the differences: equal shares keep all digits.
        largest = share.max(axis=1, keepdims=True)
        less = np.where(free, largest - share, 0.0)
        weight = largest[:, 0] - less.sum(axis=1) / np.maximum(free.sum(axis=1), 1)
        return cls(
            z=z / size,
            signal=predicted.touches[touch] / model.peak,
            sd=size * fitted.noise.sd / model.peak,
            peak=model.peak / model.peak.mean(),
            weight=weight,
            touch=touch,
            half=(touch // 8) % 2,
            share=share if less.any() else None,
        )


def score_noise(fitted: Fitted, effects: tuple[NoiseEffect, ...]) -> tuple[NoiseCandidate, ...]:
    """Fit of each of these noise effects, in decreasing order of the sum of `NoiseCandidate.difference`.

    Empty if no touch has repeated samples, or all of them are equal.
    """
    scatter = TouchScatter.of(fitted)
    if scatter is None:
        return ()
    out = [_score(scatter, effect, fitted.model.known.n_touches) for effect in effects]
    return tuple(sorted(out, key=lambda each: -float(each.difference.sum())))


def _score(scatter: TouchScatter, effect: NoiseEffect, n_touches: int) -> NoiseCandidate:
    at_null = scatter.log_density(effect, effect.without(effect.probes[0]))
    gain = np.zeros(n_touches)
    for half in (0, 1):
        judged = scatter.half == half
        judge, others = scatter.part(judged), scatter.part(~judged)
        values, _ = maximum(effect, partial(_log_likelihood, scatter, effect, others))
        np.add.at(gain, judge.touch, scatter.log_density(effect, values, judge) - at_null[judged])
    values, best = maximum(effect, partial(_log_likelihood, scatter, effect, scatter))
    ratio = 2 * (best - float(at_null.sum()))
    return NoiseCandidate(
        effect=effect,
        values=values,
        z=normal_score(max(ratio, 0.0), len(effect.parameters)),
        gain=0.5 * ratio - 0.5 * len(effect.parameters) * float(np.log(max(n_touches, 2))),
        difference=gain,
    )


def _log_likelihood(scatter: TouchScatter, effect: NoiseEffect, part: TouchScatter, values: Values) -> float:
    """Log likelihood of a part of the samples; the own noise is estimated from all samples."""
    return float(scatter.log_density(effect, values, part).sum())


def maximum(effect: NoiseEffect, log_likelihood: Callable[[Values], float]) -> tuple[Values, float]:
    """Values of maximum likelihood, and its logarithm; the search starts from the best probe."""
    from scipy.optimize import minimize

    ends = [each.normal_prior[2:] for each in effect.parameters]
    low, high = np.array(ends).T

    def from_unconstrained(x: FloatArray) -> Values:
        pairs = zip(effect.parameters, np.clip(x, low, high), strict=True)
        return tuple(each.from_unconstrained(float(value)) for each, value in pairs)

    def cost(x: Any) -> float:
        return -log_likelihood(from_unconstrained(np.asarray(x)))

    start: Values = max(effect.probes, key=log_likelihood)
    place = np.array([p.to_unconstrained(v) for p, v in zip(effect.parameters, start, strict=True)], dtype=np.float64)
    best = np.inf
    # A simplex that has collapsed onto a bound cannot leave it: such a search is restarted from its result.
    for _ in range(MOST_SEARCHES):
        # The first step of a value at a bound is half the width of its range.
        steps = np.where(place <= low, 0.5 * (high - low), np.where(place >= high, 0.5 * (low - high), 0.3 * place))
        steps = np.where(np.isfinite(steps) & (steps != 0), steps, 0.03)
        simplex = np.vstack([place, place + np.diag(steps)])
        options: Any = {"initial_simplex": simplex, "xatol": 1e-3, "fatol": 0.02, "maxfev": 120}
        found = minimize(cost, place.tolist(), method="Nelder-Mead", options=options)
        place, before, best = np.clip(np.asarray(found.x), low, high), best, float(found.fun)
        if before - best < SAME or ((place > low) & (place < high)).all():
            break
    values = from_unconstrained(place)
    return values, log_likelihood(values)
