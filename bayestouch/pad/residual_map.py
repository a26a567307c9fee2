"""The empirical map of a pad: a smooth function of location for each element that is added to its kernel.

The correction of the sensitivity of an element is a Gaussian process with the covariance
``amplitude_e² [A² + B² K_e(x) K_e(x')] ρ(|x - x'|/l)`` between locations x and x': an error of size A everywhere and
one of size B in proportion to the kernel K, both with the correlation length l. A, B and l are shared by the elements
and estimated by `bayestouch.pad.misfit_fit.fit_misfit`; amplitude_e is the absolute signal of the element. If the mean
is the kernel, an E map is identified with a prior that is centred on the elastic model; if the mean is a constant, the
prior has no model of location.

Source: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning (2006), equations 2.23 to
2.26, 2.30 (marginal likelihood), 5.12 (leave-one-out).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, solve_triangular

from bayestouch.array_types import FloatArray

# Largest variance of the correction that `functions` leaves out, over the noise variance of the same reading.
_LEFT_OUT = 0.03


def matern_5_2(r: FloatArray) -> FloatArray:
    """Matérn correlation of smoothness 5/2 (twice differentiable); `r` is the distance over the correlation length."""
    s = np.sqrt(5.0) * r
    return np.asarray((1 + s + s * s / 3) * np.exp(-s))


def matern_5_2_by_length(r: FloatArray) -> FloatArray:
    """Derivative of `matern_5_2` over the logarithm of the correlation length."""
    s = np.sqrt(5.0) * r
    return np.asarray(s * s / 3 * (1 + s) * np.exp(-s))


def distances(first: FloatArray, second: FloatArray) -> FloatArray:
    """Distances between locations (n, D) and (k, D), shape (n, k)."""
    square = sum((first[:, None, axis] - second[None, :, axis]) ** 2 for axis in range(first.shape[1]))
    return np.asarray(np.sqrt(square))


@dataclass(frozen=True, eq=False)
class MapDiscrepancy:
    """Covariance of reading minus kernel: smooth correction and noise; n touches, m elements.

    Attributes
    ----------
    location : (n, D) array
        Locations of the touches, mm.
    load : (n,) array
        Loads; the correction is per unit load.
    variance : (n, m) array
        Noise variance of the readings; inf where missing.
    amplitude : (m,) array
        Absolute signal of each element per unit load.
    shape : (n, m) array
        Kernel of each element at each touch.
    misfit : float
        A; 0 for no correction.
    relative : float
        B.
    length_mm : float
        l.
    """

    location: FloatArray
    load: FloatArray
    variance: FloatArray
    amplitude: FloatArray
    shape: FloatArray
    misfit: float = 0.0
    relative: float = 0.0
    length_mm: float = 1.0

    def select(self, index: NDArray[np.int64]) -> MapDiscrepancy:
        """The covariance for some of the touches."""
        return replace(
            self,
            location=self.location[index],
            load=self.load[index],
            variance=self.variance[index],
            shape=self.shape[index],
        )

    @property
    def present(self) -> NDArray[np.bool_]:
        """Whether each reading is present, (n, m)."""
        return np.isfinite(self.variance)

    @cached_property
    def _correlations(self) -> FloatArray:
        rho = matern_5_2(distances(self.location, self.location) / self.length_mm)
        return np.asarray(rho * self.load[:, None] * self.load)

    @cached_property
    def _filled(self) -> FloatArray:
        # A missing reading has a noise so large that it carries no information; 1e9 keeps the factor accurate.
        largest = np.where(self.present, self.variance, 0.0).max(axis=0)
        signal = (self.misfit**2 + self.relative**2) * self.amplitude**2 * (self.load**2).max()
        return np.where(self.present, self.variance, 1e9 * np.maximum(largest + signal, 1e-300))

    @cached_property
    def factors(self) -> tuple[FloatArray, ...]:
        """Lower Cholesky factors of the covariance of each element: (n, n), or the diagonal (n,) without correction."""
        if self.misfit == 0:
            return tuple(np.asarray(np.sqrt(column)) for column in self._filled.T)
        out = []
        for element in range(len(self.amplitude)):
            covariance = self._modulated(element, self._correlations, self.shape[:, element])
            covariance[np.diag_indices_from(covariance)] += self._filled[:, element]
            out.append(np.asarray(np.linalg.cholesky(covariance)))
        return tuple(out)

    def whiten(self, element: int, rows: FloatArray) -> FloatArray:
        """``L^-1 rows`` for rows (n, ...) of an element, with L its factor."""
        factor = self.factors[element]
        if factor.ndim == 1:
            return np.asarray((rows.T / factor).T)
        return np.asarray(solve_triangular(factor, rows, lower=True, check_finite=False))

    def precision(self, element: int) -> FloatArray:
        """Inverse covariance of an element: (n, n), or its diagonal (n,) without correction."""
        factor = self.factors[element]
        if factor.ndim == 1:
            return np.asarray(1 / factor**2)
        return np.asarray(cho_solve((factor, True), np.eye(len(factor)), check_finite=False))

    def cross(self, element: int, location: FloatArray, shape: FloatArray) -> FloatArray:
        """Covariance of the correction at k locations with the readings of an element, (k, n).

        Parameters
        ----------
        element : int
            Index of the element.
        location : (k, D) array
            Locations, mm.
        shape : (k,) array
            Kernel of the element there.
        """
        rho = matern_5_2(distances(location, self.location) / self.length_mm)
        return self._modulated(element, rho * self.load, shape)

    def prior_variance(self, element: int, shape: FloatArray) -> FloatArray:
        """Prior variance of the correction of an element where its kernel is `shape`."""
        return np.asarray(self.amplitude[element] ** 2 * (self.misfit**2 + (self.relative * shape) ** 2))

    def functions(self, variance: FloatArray, most: int) -> tuple[tuple[FloatArray, ...], FloatArray]:
        """The correction of each element as a sum of functions with standard normal weights, and the variance left out.

        The functions are the columns of a pivoted Cholesky factor. It ends when the variance of the rest of the
        correction is far below the noise of every reading, or at `most` functions.

        Parameters
        ----------
        variance : (n, m) array
            Noise variance of the readings.
        most : int
            Largest number of functions of one element.

        Returns
        -------
        tuple of (k_e, n) arrays, (n, m) array
            Change of the readings per unit of each weight, and the variance of the rest of the correction.
        """
        from scipy.linalg.lapack import dpstrf

        functions, left = [], np.empty(self.shape.shape)
        for e in range(len(self.amplitude)):
            sd = np.sqrt(variance[:, e])
            covariance = self._modulated(e, self._correlations, self.shape[:, e]) / np.outer(sd, sd)
            total = np.diag(covariance).copy()
            factor, pivot, rank, _ = dpstrf(covariance, tol=_LEFT_OUT, lower=1)
            rows = np.zeros((len(sd), min(rank, most)))
            rows[pivot - 1] = np.tril(factor)[:, : rows.shape[1]]
            functions.append(np.ascontiguousarray((sd[:, None] * rows).T))
            left[:, e] = sd**2 * np.maximum(total - (rows**2).sum(axis=1), 0.0)
        return tuple(functions), left

    def _modulated(self, element: int, correlation: FloatArray, shape: FloatArray) -> FloatArray:
        own = (self.relative * self.amplitude[element]) ** 2 * np.outer(shape, self.shape[:, element])
        return np.asarray(((self.misfit * self.amplitude[element]) ** 2 + own) * correlation)
