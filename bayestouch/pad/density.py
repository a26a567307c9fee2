"""Exact posterior density of a pad's calibration: kernel, gains, offsets, positions and effects.

The empirical map, the errors of the loads and the drifts change the readings linearly, so they are integrated out. Size
and correlation time of a drift are entries of the vector, up to `MOST_READINGS`. The noise with the values of noise
effects, and the size and the length of the map, are fixed at the values of the fit; touches are read with the same
values. A nonlinear effect is linearised in the weights of the map, about their most probable values: the weights are
known so well that the effect is nearly linear over their uncertainty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, solve_triangular

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.model.added import AddedEffect
from bayestouch.model.fitting import Fitted, drift_columns, linearised
from bayestouch.model.joint_drifts import DriftEntries, exact_basis, other_functions, without_drifts, without_weights
from bayestouch.model.linear import Functions, Linearised
from bayestouch.model.predictive import precision_of_touches
from bayestouch.pad.map_basis import HeldMap
from bayestouch.pad.model import PadModel
from bayestouch.parallel.parts import of_parts
from bayestouch.priors.parameters import LogNormal, Prior
from bayestouch.sampling.bounds import falling_from_bounds

# Largest number of entries of an array that is computed at once: 8 MB.
NUMBERS_HELD = 1 << 20
# Up to this number of mean readings, size and time of drifts are drawn with all others: an evaluation then takes some
# ten milliseconds at most. More readings determine size and time well, and these are held at their mode.
MOST_READINGS = 1000


@dataclass(frozen=True, eq=False)
class PadDensity:
    """Log posterior of the flat vector of a pad: `PadChain.flat`, values of effects, sizes and times of drifts.

    Entries with a log-normal prior, and those of drifts, are logarithms. t touches, m elements, d entries, of which the
    first n are those of the model.

    Attributes
    ----------
    fitted : Fitted
        Touches, model and noise. The vector of the fit is the mode.
    model : PadModel
        The touches, and the model with a map that is fixed at its most probable weights. The contribution of these
        weights is also added to the mean readings of the touches, so that it cancels in the residuals: the prior of a
        weight has mean zero.
    functions : Functions or None
        Random functions other than drifts that are integrated out in addition to the errors of the loads: the map.
    drifts : DriftEntries
        Drifts, and their entries of the vector. Given these the drifts are exact Matérn functions.
    """

    fitted: Fitted
    model: PadModel
    functions: Functions | None
    drifts: DriftEntries = field(default_factory=DriftEntries)

    @classmethod
    def of(cls, fitted: Fitted, added: Sequence[AddedEffect] = ()) -> PadDensity:
        """The posterior of a fit; the normal approximation of size and time of its drifts is that in `added`."""
        model = fitted.model
        assert isinstance(model, PadModel)
        joint = model.known.means.readings.size <= MOST_READINGS
        drifts = DriftEntries.of(fitted.drifts if joint else (), added)
        if model.map is None or isinstance(model.map, HeldMap):
            return cls(fitted, model, other_functions(fitted, joint=joint), drifts)
        weights = fitted.vector[model.n_chain : model.n_base]
        columns = model.derivatives(fitted.vector)[0][model.n_chain : model.n_base]
        place, observed = np.stack(model.poses(fitted.vector).place, axis=1), model.known
        moved = observed.means.readings + np.tensordot(weights, columns, axes=1)
        observed = replace(observed, means=replace(observed.means, readings=moved))
        held = replace(model, map=HeldMap.of(model.map, weights, place), observed=observed)
        return cls(fitted, held, other_functions(fitted, columns, joint=joint), drifts)

    @property
    def mode(self) -> FloatArray:
        """Mode of the fit, (d,)."""
        return np.concatenate([self.fitted.vector[self._entries], self.drifts.mode])

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the normal approximation about the mode, (d, d)."""
        return self._with_drifts(self.fitted.linear.covariance()[np.ix_(self._entries, self._entries)])

    def approximation(self, farthest: float) -> tuple[FloatArray, FloatArray]:
        """Mean (d,) and covariance (d, d) of the normal density that approximates the posterior between its bounds.

        If the mode of an entry is at a bound, the mean is beyond this bound, by at most `farthest` standard deviations
        (`bayestouch.sampling.bounds.falling_from_bounds`).
        """
        linear, at = self.fitted.linear, self._entries
        held = np.zeros(len(self.fitted.vector), dtype=bool) if linear.held is None else linear.held
        slope = np.where(held, linear.free.gradient(), 0.0)
        beyond, covariance = falling_from_bounds(slope, linear.free.covariance(), farthest)
        mean = np.concatenate([(self.fitted.vector + beyond)[at], self.drifts.mode])
        return mean, self._with_drifts(covariance[np.ix_(at, at)])

    def _with_drifts(self, covariance: FloatArray) -> FloatArray:
        """Covariance (d, d) from that of the entries of the model (n, n), of which those of drifts are independent."""
        return np.asarray(block_diag(covariance, np.diag(self.drifts.sd**2)))

    @property
    def n_model(self) -> int:
        """Number n of entries of the model."""
        return self.model.n_base + len(self.model.value_priors)

    @property
    def tied(self) -> bool:
        """Whether touches depend on each other given the vector."""
        return self.functions is not None or len(self.drifts) > 0

    @property
    def _entries(self) -> IntArray:
        """Indices of the entries of the fit's vector that are not weights of a map, (d,)."""
        fitted = self.fitted
        weights = fitted.model.n_base - self.model.n_base
        return np.delete(np.arange(len(fitted.vector)), np.arange(weights) + self.model.n_base)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Name of each entry: ``gain[0]``, ``sigma`` …, then those of effects and drifts, such as ``creep_share``."""
        own = (each.name for effect in self.model.effects for each in effect.public_parameters())
        return (*self.model.pad.layout, *own, *self.drifts.names)

    @cached_property
    def priors(self) -> tuple[Prior, ...]:
        """Prior of the value of each entry."""
        own = (each.prior for effect in self.model.effects for each in effect.parameters)
        return (*self.model.priors, *own, *(each.prior for each in self.drifts.parameters))

    @cached_property
    def logarithmic(self) -> NDArray[np.bool_]:
        """Whether an entry is the logarithm of its value, (d,)."""
        found = np.array([isinstance(prior, LogNormal) for prior in self.priors])
        found[self.n_model :] = True
        return found

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest value of each entry, two (d,) arrays."""
        low, high = np.array([prior.support for prior in self.priors]).T
        with np.errstate(divide="ignore", invalid="ignore"):
            log_low, log_high = np.log(np.maximum(low, 0.0)), np.log(high)
        return np.where(self.logarithmic, log_low, low), np.where(self.logarithmic, log_high, high)

    def values(self, vectors: FloatArray) -> FloatArray:
        """Values of the parameters from vectors, (..., d): the exponential of the logarithmic entries."""
        return np.where(self.logarithmic, np.exp(np.where(self.logarithmic, vectors, 0.0)), vectors)

    def __call__(self, vectors: FloatArray) -> FloatArray:
        """Log posterior density of vectors, (..., d) to (...), up to a constant; ``-inf`` outside the bounds."""
        flat = vectors.reshape(-1, vectors.shape[-1])
        out = self.log_prior(flat)
        inside = np.isfinite(out)
        out[inside] += self.log_likelihood(flat[inside])
        return out.reshape(vectors.shape[:-1])

    def log_prior(self, vectors: FloatArray) -> FloatArray:
        """Log prior density of vectors (n, d), (n,); ``-inf`` outside the bounds."""
        n, values = self.n_model, self.values(vectors)
        total = np.where(self.logarithmic, vectors, 0.0)[:, :n].sum(axis=1)
        for prior, column in zip(self.priors[:n], values.T[:n], strict=True):
            total = total + prior.log_density(column)
        return np.asarray(total + self.drifts.log_prior(vectors[:, n:]))

    def log_likelihood(self, vectors: FloatArray) -> FloatArray:
        """Log likelihood of vectors (n, d) inside the bounds, (n,): density of all readings together."""
        found = of_parts(lambda part: self._of_data(vectors[part]), self._parts(len(vectors)))
        return np.concatenate([np.empty(0), *found]) + self._log_volume

    def _of_data(self, vectors: FloatArray) -> FloatArray:
        """Log likelihood of some vectors (n, d), (n,), up to the constant `_log_volume`."""
        white, samples, predicted = self.whitened(vectors)
        if len(self.drifts):
            squares = self._drifting(vectors, white, predicted)
        else:
            squares = (white**2).sum(axis=0)
            if self.functions is not None:
                onto = solve_triangular(self.functions.root, self.functions.white.transposed(white), lower=True)
                squares -= (onto**2).sum(axis=0)
        return np.asarray(-0.5 * squares + samples.sum(axis=1))

    def _drifting(self, vectors: FloatArray, white: FloatArray, predicted: FloatArray) -> FloatArray:
        """Sum of squares (n,) of whitened errors (t m, n), map and drifts integrated out, plus the log determinant."""
        rows = np.moveaxis(white.reshape(*self._readings.shape, -1), 2, 0)[..., None]
        gram, log_determinant = self.without_drifts(vectors, predicted, (rows, self.columns[None]))
        return without_weights(gram[:, 0, 0], gram[:, 1:, 0], gram[:, 1:, 1:]) + log_determinant

    @cached_property
    def columns(self) -> FloatArray:
        """Whitened columns of the functions, (t, m, k)."""
        dense = np.zeros((self._readings.size, 0)) if self.functions is None else self.functions.white.dense()
        return dense.reshape(*self._readings.shape, -1)

    def without_drifts(
        self, vectors: FloatArray, predicted: FloatArray, rows: Sequence[FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """`bayestouch.model.joint_drifts.without_drifts` at vectors (n, d) with the mean readings (n, t, m) there."""
        own, logs = vectors[:, : self.n_model], vectors[:, self.n_model :]
        root = np.broadcast_to(self.fitted.whitening.root, (len(vectors), *self.fitted.whitening.root.shape))
        return without_drifts(self.model, self.drifts.drifts, logs, own, predicted, root, rows)

    def at_drifts(self, vector: FloatArray) -> PadDensity:
        """The density of the entries of the model, with size and time of the drifts at those of a vector (d,).

        The drifts are among its `functions`, so that it costs the cube of t m.
        """
        drifts = self.drifts.at(vector[self.n_model :])
        raw = drift_columns(self.model, vector[: self.n_model], drifts, exact_basis)
        raw = raw if self.functions is None else np.concatenate([raw, self.functions.raw])
        return replace(self, functions=Functions.of(raw, self.fitted.whitening.columns(raw)), drifts=DriftEntries())

    def touch_log_likelihood(self, vectors: FloatArray) -> FloatArray:
        """Log density (n, t) of the readings of each touch given those of all others, at vectors (n, d).

        The vectors are inside the bounds. Without a map and drifts the touches are independent, and the sum over the
        touches is `log_likelihood`. With them, this is the density that leave-one-out cross-validation uses (P.-C.
        Bürkner, J. Gabry and A. Vehtari, Computational Statistics 36 (2021) 1243).
        """
        if len(self.drifts):
            each = of_parts(lambda v: self.at_drifts(v).touch_log_likelihood(v[None, : self.n_model]), list(vectors))
            return np.concatenate([np.empty((0, len(self._readings))), *each])
        t, m = self._readings.shape
        out = np.empty((len(vectors), t))
        for part in self._parts(len(vectors)):
            white, samples, _ = self.whitened(vectors[part])
            if self.functions is not None:
                # z: whitened residuals, P: their precision, P_tt: its block of one touch. The density needs (P z)_t
                # and P_tt.
                white = self.functions.without(white)
                spread = np.linalg.solve(self._left_out, white.reshape(t, m, -1))
            else:
                spread = white.reshape(t, m, -1)
            out[part] = -0.5 * (spread**2).sum(axis=1).T + samples
        volume = np.where(self.fitted.whitening.present, self._log_scale, 0.0).sum(axis=1)
        if self.functions is not None:
            volume = volume + np.log(np.diagonal(self._left_out, axis1=1, axis2=2)).sum(axis=1)
        return np.asarray(out + volume)

    @property
    def _readings(self) -> FloatArray:
        return self.model.known.means.readings

    def linearised(self, vector: FloatArray) -> Linearised:
        """The model without drifts, linearised at its vector (n,); a flat prior counts as a normal one of its width."""
        return linearised(self.model, vector, self.fitted.whitening, self.functions)

    def _parts(self, n: int) -> list[slice]:
        size = self._readings.size
        if len(self.drifts):
            # The course of each element at each touch, and the Gram matrix of errors and functions.
            size = max(size * self._readings.shape[1] * len(self.drifts), self.columns.shape[2] ** 2)
        held = max(1, NUMBERS_HELD // size)
        return [slice(first, first + held) for first in range(0, n, held)]

    def whitened(self, vectors: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Whitened residuals (t m, n) of mean readings, log densities (n, t) of samples about their means, and means.

        The means are the mean readings that the model predicts, (n, t, m).
        """
        observed, whitening = self.model.known, self.fitted.whitening
        (t, m), n = self._readings.shape, len(vectors)
        left, samples, means = np.empty((t, m, n)), np.zeros((n, t)), np.empty((n, t, m))
        for i, predicted in enumerate(self.model.predictions(vectors[:, : self.n_model])):
            means[i] = predicted.touches
            left[:, :, i] = self._readings - predicted.touches
            if predicted.samples is not None:
                squares = (whitening.samples(observed.deviation - predicted.samples) ** 2).sum(axis=1)
                samples[i] = -0.5 * np.bincount(observed.row_touch, weights=squares, minlength=t)
        left[np.isnan(self._readings)] = 0.0
        return np.asarray(whitening.root @ left).reshape(t * m, n), samples, means

    @cached_property
    def _log_scale(self) -> FloatArray:
        """Logarithm of each reading's factor in the density of its touch, (t, m)."""
        diagonal = np.einsum("tii->ti", self.fitted.whitening.root)
        return np.asarray(np.log(np.where(diagonal > 0, diagonal, 1.0)) - 0.5 * np.log(2 * np.pi))

    @cached_property
    def _log_volume(self) -> float:
        volume = float(self._log_scale[self.fitted.whitening.present].sum())
        if self.functions is None or len(self.drifts):
            return volume
        return volume - float(np.log(np.diag(self.functions.root)).sum())

    @cached_property
    def _left_out(self) -> FloatArray:
        """Lower Cholesky factor (t, m, m) of each touch's block of the precision of all whitened readings."""
        assert self.functions is not None
        return np.asarray(np.linalg.cholesky(precision_of_touches(self.functions, NUMBERS_HELD)))
