"""Normal distributions of many vectors at many points: densities, conditional densities, draws."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.sampling.rank_one import DiagonalPlusRankOne

_LOG_2PI = float(np.log(2 * np.pi))


class Normals(Protocol):
    """Normal distributions of t vectors of m numbers, each at n points."""

    def log_density(self, values: FloatArray) -> FloatArray:
        """Log density (n, t) of vectors `values` (t, m); numbers that are NaN are left out."""
        ...

    def log_given_others(self, values: FloatArray) -> FloatArray:
        """Log density (n, t, m) of each number of `values` (t, m), given the others of its vector; NaN where NaN."""
        ...

    def draw(self, standard: FloatArray) -> FloatArray:
        """Vectors (n, t, m) from independent standard normal numbers of the same shape."""
        ...


@dataclass(frozen=True, eq=False)
class NormalsWithSharedError:
    """`Normals` of numbers with an error of each and one that they share: covariance ``diag(variance) + v vᵀ``.

    Attributes
    ----------
    mean, variance : (n, t, m) arrays
        The variance of a missing number is ``inf``.
    shared : (n, t, m) array
        ``v``: change of each number by one standard deviation of the shared error; always finite.
    """

    mean: FloatArray
    variance: FloatArray
    shared: FloatArray

    def log_density(self, values: FloatArray) -> FloatArray:
        """See `Normals`."""
        here, covariance = np.isfinite(self.variance), self._covariance
        volume = np.where(here, np.log(np.where(here, self.variance, 1.0)) + _LOG_2PI, 0.0).sum(axis=-1)
        square = covariance.squared_distance(np.nan_to_num(values) - self.mean)
        return np.asarray(-0.5 * (square + volume + np.log1p(covariance.length2)))

    def log_given_others(self, values: FloatArray) -> FloatArray:
        """See `Normals`; the formula is that of `CorrelatedNormals.log_given_others`."""
        weight, residual = 1 / self.variance, np.nan_to_num(values) - self.mean
        pulled, grown = weight * self.shared, 1 + self._covariance.length2[..., None]
        precision = weight - pulled**2 / grown
        pull = weight * residual - pulled * (pulled * residual).sum(axis=-1, keepdims=True) / grown
        with np.errstate(divide="ignore", invalid="ignore"):
            log = 0.5 * (np.log(precision) - _LOG_2PI - pull**2 / precision)
        return np.where(weight > 0, log, np.nan)

    def draw(self, standard: FloatArray) -> FloatArray:
        """See `Normals`; NaN for missing numbers."""
        here, covariance = np.isfinite(self.variance), self._covariance
        u, length2 = covariance.scaled, covariance.length2[..., None]
        # (I + u uᵀ)^(1/2) = I + c u uᵀ with c = (sqrt(1 + |u|²) - 1) / |u|², finite as |u| goes to 0.
        spread = standard + u * (u * standard).sum(axis=-1, keepdims=True) / (1 + np.sqrt(1 + length2))
        return np.where(here, self.mean + np.where(here, covariance.sd, 0.0) * spread, np.nan)

    @cached_property
    def _covariance(self) -> DiagonalPlusRankOne:
        return DiagonalPlusRankOne(np.sqrt(self.variance), self.shared)


@dataclass(frozen=True, eq=False)
class CorrelatedNormals:
    """`Normals` of correlated numbers, with one covariance for all points of a vector.

    Attributes
    ----------
    mean : (n, t, m) array
    whitener : (t, m, m) array
        Lower triangular ``W`` with ``Wᵀ W`` the inverse of the covariance; row and column of a missing number are 0.
    """

    mean: FloatArray
    whitener: FloatArray

    def log_density(self, values: FloatArray) -> FloatArray:
        """See `Normals`."""
        diagonal = np.diagonal(self.whitener, axis1=1, axis2=2)
        here = diagonal > 0
        height = np.where(here, np.log(np.where(here, diagonal, 1.0)) - 0.5 * _LOG_2PI, 0.0).sum(axis=-1)
        return np.asarray(height - 0.5 * np.square(self._white(values)).sum(axis=-1))

    def log_given_others(self, values: FloatArray) -> FloatArray:
        """See `Normals`.

        With precision ``Q`` and residual ``r``, a number given the others has variance ``1/Q_ii`` and differs from its
        conditional mean by ``(Q r)_i/Q_ii`` (Bürkner, Gabry and Vehtari 2021, Computational Statistics 36, 1243).
        """
        precision = np.square(self.whitener).sum(axis=1)
        pulled = np.einsum("ntj,tji->nti", self._white(values), self.whitener, optimize=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            log = 0.5 * (np.log(precision) - _LOG_2PI - pulled**2 / precision)
        return np.where(precision > 0, log, np.nan)

    def draw(self, standard: FloatArray) -> FloatArray:
        """See `Normals`; NaN for missing numbers."""
        missing = np.diagonal(self.whitener, axis1=1, axis2=2) == 0
        root = np.linalg.inv(self.whitener + missing[:, :, None] * np.eye(missing.shape[1]))
        spread = np.einsum("tij,ntj->nti", root, standard, optimize=True)
        return np.where(missing, np.nan, self.mean + spread)

    def _white(self, values: FloatArray) -> FloatArray:
        """Independent standard residuals, (n, t, m)."""
        residual = np.nan_to_num(values) - self.mean
        return np.asarray(np.einsum("tij,ntj->nti", self.whitener, residual, optimize=True))
