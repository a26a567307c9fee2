"""Exact posterior density of the calibration of a finger with effects."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import read_once
from bayestouch.effects import NoiseEffect, RandomEffect, Values
from bayestouch.finger.density import NUMBERS_HELD, log_prior_of_loads
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatLayout, FlatPrior
from bayestouch.finger.model import FingerModel, finger_model
from bayestouch.finger.noise import Precisions
from bayestouch.finger.noise_with_effects import EffectNoise, joint_effects, noise_with_effects
from bayestouch.finger.outlier_means import MeanErrors, mean_errors
from bayestouch.finger.prediction_with_effects import EffectPrediction, EffectReadings
from bayestouch.finger.priors import FingerPriors
from bayestouch.model.columns import WhiteColumns
from bayestouch.model.fitting import Fitted
from bayestouch.model.joint_drifts import FREE, further_columns, without_drifts, without_weights
from bayestouch.model.observations import Observations
from bayestouch.model.own_columns import OwnColumns
from bayestouch.parallel.parts import of_parts
from bayestouch.sampling.rank_one import AlongError, inverse_root, log_density_with_shared_errors

# Number of vectors per evaluation if drifts or a correction make the touches dependent.
TOGETHER = 32


@dataclass(frozen=True, eq=False)
class EffectPosterior:
    """Data and priors of a finger with effects; t touches, m elements.

    Attributes
    ----------
    model : FingerModel
        The finger with its effects.
    known : KnownTouches
        The known touches.
    prior : FlatPrior
        Priors of all coordinates (see `FlatLayout`).
    noise : EffectNoise
        Noise of the samples.
    drifts : tuple of (RandomEffect, values)
        Drifts; their sd and correlation time are unknown, further values are constant.
    columns : (k, t, m) array or None
        Change of the mean readings by each of k further weights with standard normal priors, which are integrated out:
        a correction, or any other discrepancy with a normal prior.
    """

    model: FingerModel
    known: KnownTouches
    prior: FlatPrior
    noise: EffectNoise
    drifts: tuple[tuple[RandomEffect, Values], ...] = ()
    columns: FloatArray | None = None

    @classmethod
    def of(cls, fitted: Fitted, priors: FingerPriors, raw: Observations) -> EffectPosterior:
        """Posterior of a fit.

        Parameters
        ----------
        fitted : Fitted
            The fit.
        priors : FingerPriors
            Priors of the finger without effects.
        raw : Observations
            Its touches with all readings, including those that an effect classified as wrong.
        """
        model = finger_model(fitted.model)
        known, used = KnownTouches.of(model.known.means, model.finger)
        assert used.all()
        known = replace(known, load=model.load)
        effects = joint_effects(tuple(effect for effect, _ in fitted.noise.effects), raw.deviation.size)
        prior = priors.flat(model.finger, known, priors.apparent_response(model.finger, known)).with_values(
            [(p.prior, p.logarithmic) for effect in model.effects for p in effect.parameters],
            [
                *((p.prior, True) for drift, _ in fitted.drifts for p in drift.parameters[:FREE]),
                *((p.prior, p.logarithmic) for effect in effects for p in effect.parameters),
            ],
        )
        noise = noise_with_effects(fitted, known, prior.layout, effects, raw)
        return cls(model, known, prior, noise, fitted.drifts, further_columns(fitted))

    @property
    def layout(self) -> FlatLayout:
        """Positions in the flat vector."""
        return self.prior.layout

    @property
    def effects(self) -> tuple[NoiseEffect, ...]:
        """Noise effects whose values are in the vector."""
        return tuple(effect for effect, _ in self.noise.effects)

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest value of each coordinate."""
        low, high = (ends.copy() for ends in self.prior.bounds)
        _, _, model_low, model_high = self.model.prior()
        n = self.layout.n_chain
        low[:n], high[:n] = np.maximum(low[:n], model_low), np.minimum(high[:n], model_high)
        return low, high


@dataclass(frozen=True, eq=False)
class EffectDensity:
    """Log posterior of the flat vector of a finger with effects (see `FlatLayout`).

    Given the vector, readings are normal: noise of each element, the error of each load, errors that elements share,
    drifts (Matérn functions, exactly, by a Kalman filter) and the weights of `EffectPosterior.columns` are integrated
    out.

    Attributes
    ----------
    posterior : EffectPosterior
        Data and priors.
    predict : EffectPrediction
        Readings of many vectors.
    """

    posterior: EffectPosterior
    predict: EffectPrediction

    def __call__(self, vectors: FloatArray) -> FloatArray:
        """Log posterior density of vectors, (..., d) to (...), up to a constant; ``-inf`` outside the bounds."""
        flat = vectors.reshape(-1, vectors.shape[-1])
        low, high = self.posterior.bounds
        out = np.full(len(flat), -np.inf)
        inside = np.flatnonzero(((flat > low) & (flat < high)).all(axis=1))
        inside = inside[self.predict.within(flat[inside])]
        held = TOGETHER if self.tied else max(1, NUMBERS_HELD // self.posterior.known.missing.size)
        parts = [inside[first : first + held] for first in range(0, len(inside), held)]
        for part, found in zip(parts, of_parts(lambda part: self._inside(flat[part]), parts), strict=True):
            out[part] = found
        return out.reshape(vectors.shape[:-1])

    @property
    def tied(self) -> bool:
        """Whether touches depend on each other given the vector."""
        return bool(self.posterior.drifts) or self.posterior.columns is not None

    def touch_log_likelihood(self, vectors: FloatArray) -> FloatArray:
        """Log density (n, t) of the mean readings of each touch, given flat vectors (n, d), see `FingerDensity`."""
        assert not self.tied
        held = max(1, NUMBERS_HELD // self.posterior.known.missing.size)
        parts = [vectors[first : first + held] for first in range(0, len(vectors), held)]
        return np.concatenate([self._of_part(part, self.predict(part)) for part in parts])

    def _of_part(self, vectors: FloatArray, readings: EffectReadings) -> FloatArray:
        means, slopes = self._errors(vectors, readings)
        return self._of_touches(means, slopes) + self._prior_of_loads(vectors, readings, means)

    def _prior_of_loads(self, vectors: FloatArray, readings: EffectReadings, means: MeanErrors) -> FloatArray:
        """`log_prior_of_loads` (n, t)."""
        load_sd = Precisions.of(self.posterior.known, self.posterior.layout, vectors).load_sd
        of_load = AlongError.of(means.left, readings.by_load, means.weight)
        return log_prior_of_loads(of_load, readings.touches, load_sd)

    def _inside(self, vectors: FloatArray) -> FloatArray:
        posterior = self.posterior
        readings = self.predict(vectors)
        means, slopes = self._errors(vectors, readings)
        if self.tied:
            data = self._tied(vectors, readings, means.left, means.weight, slopes)
        else:
            data = self._of_touches(means, slopes).sum(axis=1)
        data = data + self._prior_of_loads(vectors, readings, means).sum(axis=1)
        samples = posterior.noise.log_likelihood(vectors, readings.touches, readings.samples, means.samples)
        return np.asarray(data + samples + posterior.prior.log_density(vectors))

    @staticmethod
    def _of_touches(means: MeanErrors, slopes: FloatArray) -> FloatArray:
        """Log density (n, t) of the mean readings of each touch, with shared errors (k, n, t, m)."""
        weight = means.weight
        volume = np.log(np.where(weight > 0, weight, 2 * np.pi) / (2 * np.pi)).sum(axis=2)
        return np.asarray(log_density_with_shared_errors(means.left, slopes, weight) + 0.5 * volume + means.gained)

    def _errors(self, vectors: FloatArray, readings: EffectReadings) -> tuple[MeanErrors, FloatArray]:
        """Errors of the mean readings, and errors that elements share (k, n, t, m)."""
        posterior, known = self.posterior, self.posterior.known
        left = np.where(known.missing, 0.0, known.readings) - readings.touches
        spread = Precisions.of(known, posterior.layout, vectors)
        slopes = (readings.by_load * spread.load_sd[..., None])[None]
        load_sd = None if self.tied else slopes[0]
        means = mean_errors(posterior.noise, vectors, left, spread.weight, load_sd)
        if posterior.noise.effects or posterior.noise.shared:
            weight, slopes = self._with_added(vectors, readings, means.weight, slopes)
            means = replace(means, weight=weight)
        return means, slopes

    def _with_added(
        self, vectors: FloatArray, readings: EffectReadings, weight: FloatArray, slopes: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Inverse variances (n, t, m) and shared errors (k, n, t, m), including those of noise effects."""
        known, noise = self.posterior.known, self.posterior.noise
        counts = read_once(known.counts)
        variance, shared = np.zeros(weight.shape), []
        for i, vector in enumerate(vectors):
            added = noise.added(vector)
            variance[i] = added.variance(readings.touches[i], noise.peak) / counts
            shared.append(noise.shared_errors(added))
        weight = weight / (1 + weight * variance)
        return weight, np.concatenate([slopes, np.stack(shared, axis=1)]) if noise.shared else slopes

    def _tied(
        self, vectors: FloatArray, readings: EffectReadings, left: FloatArray, weight: FloatArray, slopes: FloatArray
    ) -> FloatArray:
        """Log likelihood with drifts and further weights integrated out."""
        posterior = self.posterior
        by_own = None if self._own_columns is None else self._own_columns.log_density(left, weight, slopes)
        if by_own is not None:
            return by_own
        n, t, m = left.shape
        present = np.broadcast_to(weight > 0, left.shape).reshape(-1, m)
        variance = 1 / np.where(weight > 0, weight, 1.0)
        root = inverse_root(variance.reshape(-1, m), [each.reshape(-1, m) for each in slopes], present)
        root = root.reshape(n, t, m, m)
        diagonal = np.einsum("ntii->nti", root)
        volume = np.log(np.where(diagonal > 0, diagonal, 1.0)).sum(axis=(1, 2))
        white = root @ left[..., None]
        if posterior.drifts:
            gram, log_determinant = self._filtered(vectors, readings, root, white)
            left_over = without_weights(gram[:, 0, 0], gram[:, 1:, 0], gram[:, 1:, 1:]) + log_determinant
        else:
            left_over = np.concatenate([self._by_element(*each) for each in zip(root, white, strict=True)])
        return np.asarray(volume - 0.5 * left_over)

    @cached_property
    def _own_columns(self) -> OwnColumns | None:
        """Further weights without drifts; most of them change the readings of one element only."""
        columns, known = self.posterior.columns, self.posterior.known
        if columns is None or self.posterior.drifts:
            return None
        return OwnColumns.of(columns, np.where(known.missing, np.inf, known.shares))

    @cached_property
    def _columns(self) -> WhiteColumns | None:
        """Columns of the further weights before whitening.

        Most columns change the readings of one element only, which makes their products fast.
        """
        columns = self.posterior.columns
        if columns is None:
            return None
        _, t, m = columns.shape
        return WhiteColumns.of(columns, np.broadcast_to(np.eye(m), (t, m, m)))

    def _by_element(self, root: FloatArray, white: FloatArray) -> FloatArray:
        """`without_weights` (1,) of one vector without drifts, from its whitening (t, m, m) and errors (t, m, 1).

        A column that changes one element is zero for all others: products are computed element by element.
        """
        assert self._columns is not None
        columns, flat = self._columns.whitened(root), white.reshape(-1, 1)
        return without_weights((flat**2).sum(axis=0), columns.transposed(flat).T, columns.gram()[None])

    def _filtered(
        self, vectors: FloatArray, readings: EffectReadings, root: FloatArray, white: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Gram matrix of errors and columns with the drifts integrated out, and the log determinant."""
        posterior, model = self.posterior, self.posterior.model
        n, t, m, _ = root.shape
        columns = np.zeros((0, t, m)) if posterior.columns is None else posterior.columns
        of_each = root @ np.broadcast_to(np.moveaxis(columns, 0, -1), (n, t, m, len(columns)))
        logs = vectors[:, posterior.layout.further][:, : FREE * len(posterior.drifts)]
        return without_drifts(model, posterior.drifts, logs, vectors, readings.touches, root, (white, of_each))
