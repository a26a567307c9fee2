"""Whitening: transforms readings so that their noise is independent with variance one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.arrays import read_once
from bayestouch.data.grouping import readings_of_groups, uneven_groups
from bayestouch.model.columns import WhiteColumns
from bayestouch.model.noise import NoiseModel
from bayestouch.model.observations import Observations
from bayestouch.sampling.rank_one import DiagonalPlusRankOne, inverse_root


@dataclass(frozen=True, eq=False)
class Whitening:
    """Transforms of the mean readings of touches, and of deviations of samples, to unit white noise.

    Attributes
    ----------
    root : (t, m, m) array
        Inverse Cholesky factor of the covariance of the mean readings of each touch: noise, and the error of the load,
        which is shared by all elements, and errors that elements share. Rows and columns of missing readings are zero.
    sample_sd, sample_shared : (n, m) arrays
        Sd of a sample's own noise (inf where missing), and change of the sample by one sd of its shared error.
    """

    root: FloatArray
    sample_sd: FloatArray
    sample_shared: FloatArray

    @classmethod
    def of(cls, observed: Observations, noise: NoiseModel, signal: FloatArray, by_load: FloatArray) -> Whitening:
        """Whitening for touches with predicted signal (t, m) and derivative of the readings over the load (t, m)."""
        means = observed.means
        counts = np.where(np.isnan(means.readings), 0, means.counts)
        present = counts > 0
        variance = np.where(present, noise.mean_variance(signal, read_once(counts)), 1.0)
        root = inverse_root(variance, (by_load * noise.load_sd[:, None], *noise.shared_errors(counts)), present)
        samples = spread_of_samples(observed, noise, signal, ~np.isnan(observed.deviation))
        return cls(root, samples.sd, samples.direction)

    @property
    def present(self) -> NDArray[np.bool_]:
        """Whether each mean reading is present, (t, m)."""
        return np.asarray((self.root != 0).any(axis=2))

    @property
    def log_volume(self) -> FloatArray:
        """Logarithm of the determinant of the transform of each touch's mean readings, (t,), without missing ones."""
        diagonal = np.einsum("tii->ti", self.root)
        return np.asarray(np.log(np.where(diagonal > 0, diagonal, 1.0)).sum(axis=1))

    def log_volume_within(self, touch: IntArray) -> FloatArray:
        """The same of the deviations of samples from the mean of their touch, (t,).

        `touch` (n,) is the touch of each sample. Of n readings of an element, n - 1 deviations are independent. For a
        shared error n is that of the element that is read most, which is exact if no sample lacks single elements.
        """
        present, t = np.isfinite(self.sample_sd), len(self.root)
        own = np.where(present, -np.log(self.sample_sd), 0.0)
        shared = 0.5 * np.log1p(DiagonalPlusRankOne(self.sample_sd, self.sample_shared).length2)
        count = readings_of_groups(present, touch, t)
        of_element = np.maximum(count - 1, 0) / np.maximum(count, 1)
        free = of_element.max(axis=1)
        if not uneven_groups(present, touch, t).any():
            return np.asarray(np.bincount(touch, weights=own.sum(axis=1) - shared, minlength=t) * free)
        total = (own * of_element[touch]).sum(axis=1) - shared * free[touch]
        return np.asarray(np.bincount(touch, weights=total, minlength=t))

    def columns(self, raw: FloatArray) -> WhiteColumns:
        """Whitened columns from columns of mean readings (c, t, m)."""
        return WhiteColumns.of(raw, self.root)

    def touches(self, rows: FloatArray) -> FloatArray:
        """Whitened mean readings (..., t, m)."""
        return np.asarray(np.einsum("tij,...tj->...ti", self.root, _known(rows), optimize=True))

    def samples(self, rows: FloatArray) -> FloatArray:
        """Whitened deviations (..., n, m); zero where missing."""
        return DiagonalPlusRankOne(self.sample_sd, self.sample_shared).whiten(_known(rows))


def spread_of_samples(
    observed: Observations, noise: NoiseModel, signal: FloatArray, present: NDArray[np.bool_]
) -> DiagonalPlusRankOne:
    """Covariance of the deviation of each sample from the mean of its touch; signal (t, m), `present` (n, m)."""
    sd = np.sqrt(noise.own_variance(signal)[observed.row_touch] / observed.weight[:, None])
    sd = np.where(present, sd, np.inf)
    return DiagonalPlusRankOne(sd, np.where(np.isfinite(sd), noise.shared_sd_of_sample(observed.weight), 0.0))


def _known(rows: FloatArray) -> FloatArray:
    """Rows with NaN replaced by zero."""
    return np.where(np.isnan(rows), 0.0, rows)
