"""Noise of the calibration touches of a finger with noise effects, for many parameter vectors at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.data.grouping import uneven_groups
from bayestouch.effects.effect import Values
from bayestouch.effects.noise import NoiseEffect
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatLayout
from bayestouch.finger.model import finger_model
from bayestouch.finger.noise import log_likelihood_of_scatter
from bayestouch.model.base import deviation_left
from bayestouch.model.fitting import Fitted
from bayestouch.model.noise import AddedNoise, parts_shared
from bayestouch.model.noise_posterior import Terms, terms_of
from bayestouch.model.noise_search import TouchScatter
from bayestouch.model.observations import Observations
from bayestouch.model.whitening import Whitening
from bayestouch.sampling.rank_one import DiagonalPlusRankOne, log_density_of_contrasts

# Up to this number of readings of samples, values of outliers are drawn together with all parameters: their likelihood
# then takes at most about two milliseconds.
MOST_READINGS = 4000


@dataclass(frozen=True, eq=False)
class TouchSquares:
    """Samples about the mean of their touch, in the order of the touches; t touches, N samples, m elements.

    Attributes
    ----------
    order : (N,) int array
        Samples in the order of the touches.
    first : (t,) int array
        First sample of each touch in this order.
    deviation, weight : (N, m), (N, 1) arrays
        Deviations in this order, NaN where missing; number of raw readings in each sample.
    products : (t, m, m) array
        Sums over samples of `weight` times the product of the deviations of two elements.
    freedom : (t, m) array
        Number of samples less one; zero without samples.
    """

    order: IntArray
    first: IntArray
    deviation: FloatArray
    weight: FloatArray
    products: FloatArray
    freedom: FloatArray

    @classmethod
    def of(cls, observed: Observations) -> TouchSquares:
        """Deviations of the samples of observed touches."""
        order = np.argsort(observed.row_touch, kind="stable")
        first = np.searchsorted(observed.row_touch[order], np.arange(observed.n_touches))
        deviation, weight = observed.deviation[order], observed.weight[order, None]
        count = np.add.reduceat((~np.isnan(deviation)).astype(float), first, axis=0)
        rows = np.nan_to_num(deviation) * np.sqrt(weight)
        products = np.add.reduceat(rows[:, :, None] * rows[:, None, :], first, axis=0)
        return cls(order, first, deviation, weight, products, np.maximum(count - 1, 0))

    def about(self, predicted: FloatArray) -> FloatArray:
        """Deviations less predicted ones, times the root of `weight`, (N, m), in the order of the touches.

        `predicted` (N, m) is in the order of the observations. The result is zero where missing.
        """
        return np.asarray(np.nan_to_num(self.deviation - predicted[self.order]) * np.sqrt(self.weight))


@dataclass(frozen=True, eq=False)
class UnevenTouches:
    """Touches with samples that have some, but not all, of the elements that the touch has; r rows of samples.

    Attributes
    ----------
    squares : TouchSquares
        Samples of all t touches.
    uneven : (t,) bool array
        Whether each touch is of this kind.
    row, touch : (r,) int arrays
        Their samples, in the order of the touches, and the touch of each.
    present : (r, m) bool array
        Whether a sample has an element whose repeats count.
    """

    squares: TouchSquares
    uneven: BoolArray
    row: IntArray
    touch: IntArray
    present: BoolArray

    @classmethod
    def of(cls, squares: TouchSquares, freedom: FloatArray) -> UnevenTouches:
        """Touches of this kind among all; elements without `freedom` (t, m) do not count."""
        n = len(squares.first)
        touch = np.repeat(np.arange(n), np.diff(squares.first, append=len(squares.order)))
        present = ~np.isnan(squares.deviation) & (freedom > 0)[touch]
        uneven = uneven_groups(present, touch, n)
        row = np.flatnonzero(uneven[touch])
        return cls(squares, uneven, row, touch[row], present[row])

    def log_density(self, variance: FloatArray, shared: FloatArray, samples: FloatArray | None) -> float:
        """Exact normal log density of the samples about the means of each element, up to a constant.

        Parameters
        ----------
        variance : (t, m) array
            Variance of the own noise of one reading.
        shared : (m,) array
            Change of the elements by one sd of the error that they share.
        samples : (N, m) array or None
            Predicted deviations, in the order of the observations.
        """
        squares, root = self.squares, np.sqrt(self.squares.weight[self.row])
        deviation = deviation_left(
            squares.deviation[self.row], None if samples is None else samples[squares.order[self.row]]
        )
        spread = DiagonalPlusRankOne(
            np.where(self.present, np.sqrt(variance[self.touch]) / root, np.inf),
            np.where(self.present, shared / root, 0.0),
        )
        group = (np.cumsum(self.uneven) - 1)[self.touch]
        rows = np.where(self.present, deviation, 0.0)
        return float(log_density_of_contrasts(spread, rows, group, int(self.uneven.sum())).sum())


@dataclass(frozen=True, eq=False)
class EffectNoise:
    """Likelihood of the samples about the mean of their touch, and noise of the means by noise effects.

    If the noise is normal, the deviations of k samples from their mean are independent of the mean. The deviations
    contribute a separate factor: with effects that add noise, the normal density of k - 1 independent samples of each
    touch; with outliers, the likelihood of `bayestouch.model.outlier_likelihood`. What the samples then say of the true
    mean of their touch is not normal; `OutlierLikelihood.true_means` replaces it by a normal density.

    Attributes
    ----------
    known : KnownTouches
        Means, and sums of squares of each element.
    layout : FlatLayout
        Positions in the flat vector.
    effects : tuple of (NoiseEffect, first position of its values)
        Noise effects whose values are in the vector.
    peak : (m,) array
        Peak readings, the unit of shares.
    held : AddedNoise
        Added noise with constant values, which are not in the vector.
    squares : TouchSquares
        Sums over samples.
    scale : (m,) array or None
        With outliers: sd of all noise of a reading.
    terms : callable or None
        With outliers: their likelihood.
    raw : (t, m) array or None
        With outliers: mean of all samples of each touch.
    """

    known: KnownTouches
    layout: FlatLayout
    effects: tuple[tuple[NoiseEffect, int], ...]
    peak: FloatArray
    held: AddedNoise
    squares: TouchSquares
    scale: FloatArray | None = None
    terms: Terms | None = None
    raw: FloatArray | None = None

    @property
    def shared(self) -> bool:
        """Whether elements have a shared error."""
        return bool(self.held.common_touch) or any("common" in e.added(e.probes[0]) for e, _ in self.effects)

    @cached_property
    def _parts(self) -> FloatArray:
        return parts_shared(self.known.counts)

    @cached_property
    def _freedom(self) -> FloatArray:
        return np.where(self.known.scatter_dof > 0, self.squares.freedom, 0.0)

    @cached_property
    def _uneven(self) -> UnevenTouches:
        return UnevenTouches.of(self.squares, self._freedom)

    def shared_errors(self, added: AddedNoise) -> FloatArray:
        """Change of the mean readings by one sd of each error that elements share, (q, t, m), for added noise."""
        return added.shared_errors(self._parts, self.peak)

    def values(self, vector: FloatArray) -> list[Values]:
        """Values of each noise effect in a vector (d,)."""
        return [
            tuple(p.from_unconstrained(float(c)) for p, c in zip(effect.parameters, vector[first:], strict=False))
            for effect, first in self.effects
        ]

    def added(self, vector: FloatArray) -> AddedNoise:
        """Added noise of the effects, at a vector (d,)."""
        out = self.held
        for (effect, _), values in zip(self.effects, self.values(vector), strict=True):
            out = replace(out, **effect.added(values))
        return out

    def log_likelihood(
        self,
        vectors: FloatArray,
        touches: FloatArray,
        samples: FloatArray | None,
        of_outliers: FloatArray | None = None,
    ) -> FloatArray:
        """Log likelihood (n,) of the deviations of samples and repeated loads, given the predicted readings.

        Parameters
        ----------
        vectors : (n, d) array
            Flat vectors.
        touches : (n, t, m) array
            Predicted mean readings.
        samples : (n, N, m) array or None
            Predicted deviations of the samples from these means; None if they are zero.
        of_outliers : (n,) array, optional
            With outliers: `bayestouch.finger.outlier_means.MeanErrors.samples`, if it is already computed.
        """
        at, known = self.layout, self.known
        total = log_likelihood_of_scatter(known, at, vectors)
        if not self.effects and samples is None:
            return total
        # The term of the tactile noise is subtracted here; the terms below replace it.
        log_noise = vectors[:, at.noise]
        total = total + log_noise @ known.scatter_dof + 0.5 * (np.exp(-2 * log_noise) @ known.scatter)
        if of_outliers is not None:
            return np.asarray(total + of_outliers)
        for i, vector in enumerate(vectors):
            own = np.exp(2 * vector[at.noise])
            if self.terms is not None:
                assert self.scale is not None
                total[i] += float(np.sum(self.terms(self.values(vector)[0], own / self.scale**2)))
            else:
                predicted = None if samples is None else samples[i]
                total[i] += self._normal(own, self.added(vector), touches[i], predicted)
        return np.asarray(total)

    def _normal(self, own: FloatArray, added: AddedNoise, touches: FloatArray, samples: FloatArray | None) -> float:
        """Normal log density of the samples about the mean of their touch."""
        squares, freedom, of_uneven = self.squares, self._freedom, 0.0
        variance, size = own + added.variance(touches, self.peak), added.common * added.together(self.peak)
        if added.common > 0 and self._uneven.uneven.any():
            # With a shared error, sums over the samples of a touch are exact only if all samples have its elements.
            of_uneven = self._uneven.log_density(variance, size, samples)
            freedom = np.where(self._uneven.uneven[:, None], 0.0, freedom)
        weight = np.where(freedom > 0, 1 / variance, 0.0)
        rows = None if samples is None else squares.about(samples)
        if rows is None:
            own_squares = float(np.einsum("tm,tmm->", weight, squares.products))
        else:
            own_squares = float((weight * np.add.reduceat(rows**2, squares.first, axis=0)).sum())
        volume = float((freedom * np.log(np.where(weight > 0, weight, 1.0))).sum())
        if added.common == 0:
            return 0.5 * (volume - own_squares)
        pulled = weight * size
        if rows is None:
            along = np.einsum("tm,tml,tl->t", pulled, squares.products, pulled, optimize=True)
        else:
            per_sample = (np.repeat(pulled, np.diff(squares.first, append=len(rows)), axis=0) * rows).sum(axis=1)
            along = np.add.reduceat(per_sample**2, squares.first)
        length2 = pulled @ size
        shared = float(freedom.max(axis=1) @ np.log1p(length2) - (along / (1 + length2)).sum())
        return of_uneven + 0.5 * (volume - own_squares - shared)


def noise_with_effects(
    fitted: Fitted, known: KnownTouches, layout: FlatLayout, effects: tuple[NoiseEffect, ...], raw: Observations
) -> EffectNoise:
    """Noise of a fit.

    Parameters
    ----------
    fitted : Fitted
        The fit.
    known : KnownTouches
        Its touches.
    layout : FlatLayout
        Positions in the flat vector; the values of `effects` are the last ones.
    effects : tuple of NoiseEffect
        Noise effects whose values are unknown, see `joint_effects`.
    raw : Observations
        The touches with all readings, outliers too.
    """
    firsts, place = [], layout.size - sum(len(effect.parameters) for effect in effects)
    for effect in effects:
        firsts.append((effect, place))
        place += len(effect.parameters)
    model = fitted.model
    none = AddedNoise(common_touch=fitted.noise.added.common_touch, common_shared=fitted.noise.added.common_shared)
    held = none if any(e.added(e.probes[0]) for e in effects) else fitted.noise.added
    out = EffectNoise(known, layout, tuple(firsts), fitted.noise.peak, held, TouchSquares.of(model.known))
    if not effects or effects[0].added(effects[0].probes[0]):
        return out
    # These are the touches of the fit: their loads are kept.
    observing = replace(finger_model(model), observed=raw, evaluator=None)
    predicted, by_load = observing.predict(fitted.vector).touches, observing.by_load(fitted.vector)
    whitening = Whitening.of(raw, fitted.noise, predicted, by_load)
    scatter = TouchScatter.of(replace(fitted, model=observing, whitening=whitening))
    assert scatter is not None
    return replace(
        out,
        scale=scatter.sd * model.peak,
        terms=terms_of(scatter, effects[0]),
        raw=raw.means.readings,
    )


def joint_effects(effects: tuple[NoiseEffect, ...], readings: int) -> tuple[NoiseEffect, ...]:
    """Those of the noise effects of a fit whose values are drawn together with all parameters.

    These are the effects that add noise. If no effect does, it is the first one, provided that the samples have at most
    `MOST_READINGS` readings. Given which readings are wrong, the values of the other effects are independent of all
    other parameters; their draws are those of `AddedEffect.draws`.
    """
    adding = tuple(effect for effect in effects if effect.added(effect.probes[0]))
    return adding or (effects[:1] if readings <= MOST_READINGS else ())
